"""Torques that move nothing: four motors drive one motion, so three combinations of them are free.

Both sides against each other press the wheels sideways against the floor; front against rear wheel of a side twists
its steering, which dry friction holds. Each combination has a frequency of its own, so that the torque of every single
drive is distinguished from the others, whatever the vehicle does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.campaign.reference import Reference
from ident.campaign.steps import StepSpec
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

HELD_SHARE: Final = 0.35
"""Share of a side's steering friction that the dither may ask to hold the wheels."""

GRIP_SHARE: Final = 0.15
"""Share of the adhesion of a wheel."""

TORQUE_SHARE: Final = 0.2
"""Share of the peak torque of a motor."""

_GRAVITY: Final = 9.81


@dataclass(frozen=True)
class Pattern:
    """One combination of the four wheel torques.

    Attributes:
        wheels: shares of fl, rl, fr, rr.
        harmonic: of the excitation's period, above those of the excitation.
        side: 0 or 1 where it twists the steering of a side, else None.
    """

    wheels: tuple[float, float, float, float]
    harmonic: int
    side: int | None


PATTERNS: Final = (
    Pattern((1.0, 1.0, -1.0, -1.0), 9, None),
    Pattern((1.0, -1.0, 0.0, 0.0), 11, 0),
    Pattern((0.0, 0.0, 1.0, -1.0), 13, 1),
)
"""The null space of straight motion with held steering."""


def add_dither(reference: Reference, spec: StepSpec, vehicle: VehicleDescription) -> Reference:
    """The reference with all PATTERNS in its feed-forward, while its excitation repeats.

    Args:
        reference: of straight motion.
        spec: its step.
        vehicle: for the limits.
    """
    first = int(np.argmax(reference.period >= 0))
    time = (np.arange(len(reference)) - first) * reference.sample_time
    torques = dither_torques(time, spec.period, vehicle)
    torques[reference.period < 0] = 0.0
    return replace(reference, feed_forward=reference.feed_forward + torques)


def dither_torques(time: NDArray[np.floating], period: float, vehicle: VehicleDescription) -> Array:
    """Motor torques (N, 4) of all PATTERNS [Nm], for a time (N,) since an excitation of some period began [s]."""
    torques = np.zeros((len(time), 4))
    for pattern in PATTERNS:
        wave = np.sin(2 * math.pi * pattern.harmonic * time / period)
        torques += wave[:, None] * dither_amplitude(pattern, vehicle) * np.array(pattern.wheels)
    return torques / vehicle.geometry.gear_ratio


def dither_amplitude(pattern: Pattern, vehicle: VehicleDescription) -> float:
    """Wheel torque of a pattern [Nm]: what grip, motor and steering friction leave, by the prior parameters."""
    geometry, limits, prior = vehicle.geometry, vehicle.limits, vehicle.prior
    grip = GRIP_SHARE * limits.floor_friction * prior["m_ch"] * _GRAVITY / 4 * geometry.wheel_radius
    motor = TORQUE_SHARE * limits.peak_torque * geometry.gear_ratio
    if pattern.side is None:
        return min(grip, motor)
    # Steering torque of a side: (a/r) times the difference of its two wheel torques.
    held = HELD_SHARE * (prior["d_cl"], prior["d_cr"])[pattern.side]
    return min(grip, motor, held * geometry.wheel_radius / geometry.wheel_offset / 2)
