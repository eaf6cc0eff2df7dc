"""Channels that stand still while the others move: frozen, or clipped at a level that they leave again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.campaign.steps import EXCITATIONS
from ident.faults.channels import ALPHA, BETA, TORQUE, Group, Place, singles
from ident.faults.clock import grouped, stuck_runs
from ident.faults.fault import Fault, FaultName
from ident.faults.rolling import (
    Rates,
    independent_samples,
    predicted_steering_rate,
    predicted_wheel_rate,
    rates_of,
    rolls,
)
from ident.plant import dynamics
from ident.records.record import Segment, Step, base_step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import COULOMB_EPSILON

Array = NDArray[np.float64]

SHORTEST: Final = 0.02
"""Duration of a run of equal values that is looked at [s]."""

MOVES: Final = 0.3
"""Part of the usual motion of its step by which a channel should have moved in a run to stand still in it."""

PART: Final = 0.03
"""Part of the longest motion of a record that a channel must have missed in a segment: turning round takes less."""

LEVELS: Final = 2
"""Runs at the same level that make a channel clipped: it came back to it."""

SAME: Final = 1e-6
"""Relative difference of values that are the same."""

SATURATED: Final = 0.1
"""Part of a level by which the torque has to go beyond it, and drives at their limit do not."""


@dataclass(frozen=True)
class Stand:
    """A run of equal values in which the channel should have moved.

    Attributes:
        step, level: where, and at which value.
        inner: the channel moves before and after it.
        missed: what it should have moved in it, as `_motion_of` counts.
        weight: number of independent samples in it.
    """

    step: str
    level: float
    inner: bool
    missed: float
    weight: float


def stuck(pairs: Sequence[tuple[Segment, Segment]], vehicle: VehicleDescription) -> list[Fault]:
    """Frozen and clipped channels.

    Args:
        pairs: segments as recorded, and filtered and decimated.
        vehicle: its geometry and priors.
    """
    faults = []
    for place in singles():
        least = PART * max((_motion_of(place.group, low) for _, low in pairs), default=0.0)
        runs = [_stands(place, full, low, vehicle) for full, low in pairs]
        stands = [stand for found in runs if sum(each.missed for each in found) > least for stand in found]
        if stands:
            faults.append(_fault(place, stands, [full for full, _ in pairs]))
    return grouped(faults)


def _motion_of(group: Group, low: Segment) -> float:
    """Of the channel of a group that moves most in a segment: way of an angle [rad], integral of a torque [Nm s]."""
    values: Array = getattr(low, group.field)
    ways = np.abs(values) * low.sample_time if group is TORQUE else np.abs(np.diff(values, axis=0))
    return float(np.max(np.sum(ways, axis=0)))


def _fault(place: Place, stands: Sequence[Stand], segments: Sequence[Segment]) -> Fault:
    steps = {stand.step for stand in stands}
    steps_of_all = {segment.step for segment in segments if _concerned(place, segment)}
    step = steps.pop() if len(steps) == 1 and len(steps_of_all) > 1 else ""
    level = stands[0].level
    one_level = np.ptp([abs(stand.level) for stand in stands]) <= SAME * max(abs(level), SAME)
    clipped = sum(stand.inner for stand in stands) >= LEVELS and one_level and level != 0
    evidence = sum(stand.weight for stand in stands)
    name = FaultName.CLIPPED if clipped else FaultName.FROZEN
    value = abs(level) if clipped else level
    return Fault(name, place.name, value, place.group.unit, 0.0, max(evidence, 1.0) * math.log(100), False, (), step)


def _concerned(place: Place, segment: Segment) -> bool:
    return place.group is TORQUE or rolls(segment)


def _stands(place: Place, full: Segment, low: Segment, vehicle: VehicleDescription) -> list[Stand]:
    if not _concerned(place, full):
        return []
    values = place.of(full)[:, 0]
    runs = list(stuck_runs(values, max(3, round(SHORTEST / full.sample_time))))
    if not runs:
        return []
    motion, usual = _should(place, low, vehicle)
    if usual <= 0:
        return []
    factor = low.sample_time / full.sample_time
    found = []
    for begin, end in runs:
        first = min(int(begin / factor), len(motion) - 1)
        part = motion[first : max(int(end / factor), first + 1)]
        level = float(values[begin])
        if _moves(place, part, level, usual):
            missed = float(np.sum(np.abs(part))) * low.sample_time
            inner = begin > 0 and end < len(values)
            weight = independent_samples(part[:, None], low.sample_time) if len(part) > 2 else 0.0
            found.append(Stand(full.step, level, inner, missed, max(weight, 0.5)))
    return found


def _moves(place: Place, motion: Array, level: float, usual: float) -> bool:
    """Whether a channel at a level should have been elsewhere: rates that are usual, or torques beyond it."""
    if place.group is not TORQUE:
        return float(np.sqrt(np.mean(motion**2))) > MOVES * usual
    varies = float(np.std(motion)) > MOVES * usual
    beyond = float(np.mean(motion)) * np.sign(level) > (1 + SATURATED) * abs(level)
    return varies or (level != 0 and beyond) or (level == 0 and float(np.sqrt(np.mean(motion**2))) > MOVES * usual)


def _should(place: Place, low: Segment, vehicle: VehicleDescription) -> tuple[Array, float]:
    """What the other channels say (N,): rates of an angle or values of a torque, and how much is usual."""
    rates = rates_of(low)
    column = place.columns[0]
    if place.group is BETA:
        return predicted_wheel_rate(rates, vehicle.geometry, column), _rms(np.delete(rates.wheels, column, axis=1))
    if place.group is ALPHA:
        return _steering(rates, column, vehicle)
    return _torque(low, rates, column, vehicle)


def _steering(rates: Rates, side: int, vehicle: VehicleDescription) -> tuple[Array, float]:
    """By the wheels of a side, where they roll against each other, as they do for nothing but steering."""
    front, rear = rates.wheels[:, 2 * side], rates.wheels[:, 2 * side + 1]
    if _rms(front + rear) > MOVES * _rms(front - rear):
        return np.zeros(len(front)), 0.0
    return predicted_steering_rate(rates, vehicle.geometry, side), _rms(rear - front) / (
        2 * vehicle.geometry.lever_ratio
    )


def _torque(low: Segment, rates: Rates, wheel: int, vehicle: VehicleDescription) -> tuple[Array, float]:
    """By the parts that the other drives bear of the load; of a wheel in the air by what is known of it."""
    step = base_step(low.step)
    if step is Step.WHEEL_LIFTED:
        spinning = np.gradient(rates.wheels[:, wheel], low.sample_time)
        speed = rates.wheels[:, wheel]
        prior, ratio = vehicle.prior, vehicle.geometry.gear_ratio
        friction = prior["d_vw"] * speed + prior["d_cw"] * np.tanh(speed / COULOMB_EPSILON)
        motion = (prior["B_w"] * spinning + friction) / ratio
        return motion, _rms(motion)
    spec = EXCITATIONS.get(step) if step is not None else None
    if spec is None or spec.mode is None:
        return np.zeros(len(low)), 0.0
    per_drive = dynamics.projected_input(spec.mode, low.steering_angles, vehicle.geometry)
    row = {"alpha_l": 0, "alpha_r": 1, "x": 1}.get(spec.coordinate, 0)
    direction = np.mean(per_drive[:, row], axis=0)
    if abs(direction[wheel]) < MOVES * np.max(np.abs(direction)):
        return np.zeros(len(low)), 0.0
    others = np.delete(np.arange(len(direction)), wheel)
    load = low.motor_torques[:, others] @ direction[others]
    motion = load * direction[wheel] / float(direction[others] @ direction[others])
    return motion, _rms(motion)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
