"""Recorded torques through the emulated vehicle, held to the recorded motion: it needs what it lacks, nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.effects import Unlibraried, Wanted
from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype, load_prototype
from emulator.replay import Guide, ReplayedVehicle, Start
from emulator.vehicle import EmulatedVehicle
from ident.effects.text import parse_effect
from ident.errors import UserError

Array = NDArray[np.float64]

CYCLE, STEPS, SWING = 2e-3, 2, 0.6
"""Cycle [s], engine steps in it, frequency of the swing [Hz]."""


@dataclass
class Recorded:
    """What a vehicle without noise did, its motors swinging alike: the motion of `straight`."""

    torques: list[list[float]] = field(default_factory=list)
    readings: list[list[float]] = field(default_factory=list)
    rates: list[list[float]] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)


def drive(prototype: Prototype, make_engine: MakeEngine, effects: Sequence[Wanted], cycles: int = 500) -> Recorded:
    recorded, gear = Recorded(), prototype.geometry.gear_ratio
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0, make_engine=make_engine, effects=effects) as vehicle:
        mechanics = vehicle._mechanics
        for drive in vehicle.drives:
            drive.enable()
        for cycle in range(cycles):
            torque = 1.2 * math.sin(2 * math.pi * SWING * cycle * CYCLE)
            for motor, direction in zip(vehicle.drives, prototype.drive.directions, strict=True):
                motor.command(direction * torque)
            now = vehicle.engine.rates()
            recorded.torques.append([motor.wheel_torque / gear for motor in vehicle.drives])
            angles = [mechanics.steering.steering_angle(side) for side in range(2)]
            recorded.readings.append([*angles, *(mechanics.shafts.wheel_angle(wheel) for wheel in range(4))])
            recorded.rates.append([now[0], now[2], *(mechanics.shafts.wheel_rate(wheel) for wheel in range(4))])
            recorded.speed.append(vehicle.engine.twist()[0])
            vehicle.advance(CYCLE)
    return recorded


def lacking(
    prototype: Prototype, make_engine: MakeEngine, recorded: Recorded, effects: Sequence[Wanted], begin: int = 0
) -> Array:
    """Force along travel that the vehicle with these effects needs beyond the torques (N,) [N]."""
    radius, truth = prototype.geometry.wheel_radius, prototype.truth
    mass = truth["m_ch"] + 4 * truth["B_w"] / radius**2
    samples = len(recorded.torques) - begin
    weights = [[[0.0, 0.0, *[1 / radius] * 4]]] * samples
    guide = Guide(recorded.readings[begin:], recorded.rates[begin:], weights, [60.0**2 * mass], [120.0 * mass])
    angles, rates = recorded.readings[begin], recorded.rates[begin]
    start = Start(
        time=begin * CYCLE,
        heading=0.0,
        twist=(recorded.speed[begin], 0.0, 0.0),
        steering=tuple(angles[:2]),
        wheels=tuple(angles[2:]),
        steering_rates=tuple(rates[:2]),
        wheel_rates=tuple(rates[2:]),
    )
    with ReplayedVehicle(prototype, effects=effects, make_engine=make_engine) as vehicle:
        forces = vehicle.follow(start, recorded.torques[begin:], guide, STEPS)
    return np.array(forces)[:, 0]


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


EFFECTS = (
    None,
    "stribeck@wheels=1Nm",
    "quadratic_drag@chassis=40N s^2/m^2",
    "torque_gain@drive_rl=4%",
    "slope@chassis=0.2deg",
    "payload@chassis=40kg",
    "time_delay@drive_rl=6ms",
    "elasticity@drive_rr=0.003rad/Nm",
    "backlash@drive_rr=0.02rad",
    "parameter_change@m_ch=5%",
)


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_vehicle_needs_nothing_to_do_again_what_it_did(make_engine: MakeEngine, effect: str | None) -> None:
    """Beside what the drives gave; without the effect it needs far more."""
    prototype = load_prototype()
    effects = () if effect is None else (parse_effect(effect),)
    recorded = drive(prototype, make_engine, effects)
    own = rms(lacking(prototype, make_engine, recorded, effects))
    given = prototype.geometry.gear_ratio / prototype.geometry.wheel_radius * rms(np.sum(recorded.torques, axis=1))
    # A motor in its play bounces between the flanks, and how depends on every digit.
    assert own < (1e-2 if effect is not None and effect.startswith("backlash") else 2e-3) * given
    if effect is not None:
        assert own < 0.15 * rms(lacking(prototype, make_engine, recorded, ()))


def test_the_force_that_lacks_is_the_bias_of_the_drive(make_engine: MakeEngine) -> None:
    """i_G u / r, at any speed."""
    prototype = load_prototype()
    recorded = drive(prototype, make_engine, (parse_effect("torque_bias@drive_fl=0.05Nm"),))
    moving = np.abs(recorded.rates)[:, 2] > 0.5
    force = lacking(prototype, make_engine, recorded, ())[moving]
    expected = prototype.geometry.gear_ratio * 0.05 / prototype.geometry.wheel_radius
    assert np.mean(force) == pytest.approx(expected, rel=0.02)
    assert np.std(force) < 0.15 * expected


def test_the_force_that_lacks_is_the_mass_times_its_acceleration(make_engine: MakeEngine) -> None:
    prototype = load_prototype()
    recorded = drive(prototype, make_engine, (parse_effect("payload@chassis=60kg"),))
    force = lacking(prototype, make_engine, recorded, ())
    moving = np.abs(recorded.rates)[:, 2] > 0.5
    acceleration = np.gradient(
        prototype.geometry.wheel_radius * np.mean(np.array(recorded.rates)[:, 2:], axis=1), CYCLE
    )
    slope = np.sum(force[moving] * acceleration[moving]) / np.sum(acceleration[moving] ** 2)
    # Negative: the heavier one accelerates less under these torques.
    assert slope == pytest.approx(-60.0, rel=0.03)


def test_it_can_begin_in_the_middle_of_a_motion(make_engine: MakeEngine) -> None:
    prototype = load_prototype()
    recorded = drive(prototype, make_engine, ())
    given = prototype.geometry.gear_ratio / prototype.geometry.wheel_radius * rms(np.sum(recorded.torques, axis=1))
    assert abs(recorded.speed[150]) > 0.05
    assert rms(lacking(prototype, make_engine, recorded, (), begin=150)) < 5e-3 * given


def test_a_load_is_taken_aboard_and_the_stand_holds_the_chassis(make_engine: MakeEngine) -> None:
    with ReplayedVehicle(load_prototype(), make_engine=make_engine) as vehicle:
        mass = sum(body.mass for body in vehicle.engine.bodies().values())
        vehicle.stand(lifted=False, load=35.0)
        assert sum(body.mass for body in vehicle.engine.bodies().values()) == pytest.approx(mass + 35.0)
        vehicle.stand(lifted=True)
        assert sum(normal for normal, _ in vehicle.engine.floor_forces()) == 0.0


def test_an_effect_that_no_vehicle_can_have_is_refused() -> None:
    with pytest.raises(UserError, match="no such effect"):
        ReplayedVehicle(load_prototype(), effects=(Unlibraried("gremlins", "chassis", 1.0),))
