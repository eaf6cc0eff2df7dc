"""A vehicle with one soft or loose gear, integrated from first principles: its wheel is found behind the motor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.records.inputs import INPUTS, SLICES
from ident.diagnosis.vehicle.records.transforms import Setting, transform_cause
from ident.estimate.filters import SEVEN, differentiate, second_derivative
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

DT = 0.002
MASS, RADIUS, SPIN, VISCOUS, DRY = 842.0, 0.1, 0.121, 0.73, 3.97
GEOMETRY = Geometry(wheelbase=1.2, track_width=0.8, wheel_offset=0.12, wheel_radius=RADIUS, gear_ratio=20.0)
KNOWN = np.array([dict(m_ch=MASS, B_w=SPIN, d_vw=VISCOUS, d_cw=DRY).get(name, 0.0) for name in PARAMETER_NAMES])


@dataclass(frozen=True)
class Ride:
    """Torque at the wheel (N,) [Nm], angles of motor and wheel (N,) [rad], torque through the gear (N,) [Nm]."""

    torque: Array
    motor: Array
    wheel: Array
    load: Array


def ride(gap: float, compliance: float, seconds: float = 6.0) -> Ride:
    """Straight ahead and back, all four motors with the same torque; play and a damped spring behind the first one."""
    inner = DT / 20
    time = np.arange(round(seconds / inner)) * inner
    torques = 22 * np.sin(2 * math.pi * 0.5 * time) + 16 * np.sin(2 * math.pi * 1.3 * time + 1)
    motor_inertia, rest = SPIN / 2, MASS * RADIUS**2 + 3.5 * SPIN
    stiffness = 1 / compliance
    damping = 0.4 * math.sqrt(stiffness * motor_inertia)
    states, loads = np.zeros((len(time), 4)), np.zeros(len(time))
    motor = motor_rate = wheel = wheel_rate = 0.0
    for number, torque in enumerate(torques.tolist()):
        twist = motor - wheel
        beyond = twist - math.copysign(min(abs(twist), gap / 2), twist)
        load = stiffness * beyond + (damping * (motor_rate - wheel_rate) if beyond else 0.0)
        load = load if load * beyond > 0 else 0.0
        friction = 4 * (VISCOUS * wheel_rate + DRY * math.tanh(wheel_rate / 0.01))
        motor_rate += inner * (torque - load) / motor_inertia
        wheel_rate += inner * (3 * torque + load - friction) / rest
        motor += inner * motor_rate
        wheel += inner * wheel_rate
        states[number], loads[number] = (motor, motor_rate, wheel, wheel_rate), load
    return Ride(torques[::20], states[::20, 0], states[::20, 2], loads[::20])


def smooth(values: Array) -> Array:
    """What the rows of a regression let through: 40 rad/s."""
    return np.asarray(signal.sosfiltfilt(signal.butter(2, 40 / math.tau, fs=1 / DT, output="sos"), values))


def slope(values: Array) -> Array:
    return np.asarray(np.gradient(values, DT))


def inputs_of(ride: Ride) -> Array:
    inputs = np.zeros((len(ride.torque), INPUTS))
    inputs[:, SLICES["torques"].start] = ride.torque / GEOMETRY.gear_ratio
    rate, acceleration = (
        differentiate(ride.motor, DT, SEVEN),
        second_derivative(ride.motor, DT, SEVEN),
    )
    for name, values in zip(
        ("beta", "beta_rate", "beta_acceleration", "motor_acceleration"),
        (ride.motor, rate, acceleration, acceleration),
        strict=True,
    ):
        inputs[:, SLICES[name].start] = values
    return inputs


CASES = [
    (EffectName.ELASTICITY, (1.5e-4,), 0.0, 1.5e-4),
    (EffectName.BACKLASH, (1e-3, 3e-5), 1e-3, 3e-5),
    (EffectName.BACKLASH, (3e-3, 3e-5), 3e-3, 3e-5),
]


@pytest.mark.parametrize(("name", "sizes", "gap", "compliance"), CASES)
def test_the_wheel_is_found_behind_its_motor(
    name: EffectName, sizes: tuple[float, ...], gap: float, compliance: float
) -> None:
    """Of the difference in speed between motor and wheel next to nothing is left."""
    driven = ride(gap, compliance)
    cause = transform_cause(name, "drive_fl")
    found = cause.without(inputs_of(driven), np.array(sizes), Setting(GEOMETRY, KNOWN, DT))
    inner = slice(150, -150)
    truth = slope(smooth(driven.motor - driven.wheel))[inner]
    left = smooth(found[:, SLICES["beta_rate"].start])[inner] - slope(smooth(driven.wheel))[inner]
    assert np.std(left) < 0.3 * np.std(truth)
    share = truth @ (truth - left) / (truth @ truth)
    assert share == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize(
    ("name", "sizes", "hammered"),
    [
        (EffectName.ELASTICITY, (1.5e-4,), False),
        (EffectName.ELASTICITY, (1.5e-4,), True),
        (EffectName.BACKLASH, (1e-3, 3e-5), False),
        (EffectName.BACKLASH, (1e-3,), True),
    ],
)
def test_half_of_a_gear_taken_out_twice_is_all_of_it(
    name: EffectName, sizes: tuple[float, ...], hammered: bool
) -> None:
    """The load of the gear stays what it was, whatever part of its twist is known already."""
    inputs, setting = inputs_of(ride(1e-3, 3e-5)), Setting(GEOMETRY, KNOWN, DT)
    inputs[:, SLICES["hammer"].start] = float(hammered)
    cause, half = transform_cause(name, "drive_fl"), np.array(sizes) / 2
    once = cause.without(inputs, 2 * half, setting)
    twice = cause.without(cause.without(inputs, half, setting), half, setting)
    assert np.std(twice - once, axis=0) == pytest.approx(np.zeros(INPUTS), abs=1e-9 * np.abs(inputs).max())


def test_what_accelerates_the_motor_beyond_its_wheel_does_not_reach_the_wheel() -> None:
    """The torque left for a rigid gear with the whole of B_w is the load and the motor's share at the wheel's pace."""
    driven = ride(0.0, 1.5e-4)
    cause = transform_cause(EffectName.ELASTICITY, "drive_fl")
    found = cause.without(inputs_of(driven), np.array([1.5e-4]), Setting(GEOMETRY, KNOWN, DT))
    acceleration = slope(slope(driven.wheel))
    truth = smooth(driven.load + SPIN / 2 * acceleration)[150:-150]
    left = smooth(GEOMETRY.gear_ratio * found[:, SLICES["torques"].start])[150:-150] - truth
    without = smooth(driven.torque)[150:-150] - truth
    assert np.std(left) < 0.2 * np.std(without)
