"""A simulator that is held to the recorded motion, and what force that takes: what its own forces lack.

It is given the recorded torques as well, so that a simulator without error needs nothing but what the load that
fluctuates took. Nothing adds up over time, as it does in a simulator that runs free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.signals import Signals, signals_of
from ident.errors import RecordError
from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import Processing, moving_rows, zero_phase
from ident.estimate.noise import torque_unit
from ident.plant import kinematics
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.modes import Mode
from ident.records.record import Record, Segment, base_step
from ident.records.repeats import repeats_of
from ident.vehicle.geometry import WHEELS, Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

STIFFNESS: Final = 60.0
"""Corner frequency of what holds the simulator [rad/s]: above what is compared, below what a late drive can follow."""

_SIDES: Final = ("alpha_l", "alpha_r")
_BETA: Final = slice(5, 9)


@dataclass(frozen=True, eq=False)
class Following:
    """One segment to be followed.

    Attributes:
        signals: of it, smoothed.
        spec: of its step.
        coordinates: that the step drives; both sides for a virtual steering angle.
        weights: (N, n, 6) by which each takes part in the joints: steering left, right; wheels fl, rl, fr, rr.
        inertias: (n,) of each, about [kg or kg m^2].
        recorded: (N, n) generalized torque of the drives, filtered [N or Nm].
        moving: (N, n) rows to be compared; the others are stiction.
    """

    signals: Signals
    spec: RowsOfStep
    coordinates: tuple[str, ...]
    weights: Array
    inertias: Array
    recorded: Array
    moving: NDArray[np.bool_]

    @property
    def segment(self) -> Segment:
        """As it was recorded."""
        return self.signals.segment

    @property
    def lifted(self) -> bool:
        """Whether the wheels are in the air."""
        return self.spec.mode is None

    @property
    def readings(self) -> Array:
        """(N, 6) smoothed: alpha left, right, beta fl, rl, fr, rr [rad]."""
        return np.hstack([self.signals.alpha, self.signals.beta])

    @property
    def stiffness(self) -> Array:
        """(n,) force per displacement."""
        return STIFFNESS**2 * self.inertias

    @property
    def damping(self) -> Array:
        """(n,) force per speed; critical."""
        return 2 * STIFFNESS * self.inertias


@dataclass(frozen=True, eq=False)
class Difference:
    """What a simulator lacks of the torque of one coordinate in one segment, in rows that move in every repeat.

    Attributes:
        step, coordinate: which.
        unit: Nm or N.
        time: (P, N) in the segment, by repeats; P = 1 where nothing repeats [s].
        recorded: (P, N) generalized torque of the drives.
        needed: (P, N) the same with what the simulator needs beyond it for that motion.
        runs: (N,) number of the stretch without a gap.
    """

    step: str
    coordinate: str
    unit: str
    time: Array
    recorded: Array
    needed: Array
    runs: NDArray[np.int64]

    @property
    def off(self) -> Array:
        """(P, N) what the simulator lacks."""
        return self.needed - self.recorded


def followings_of(
    record: Record, geometry: Geometry, parameters: Parameters, processing: Processing
) -> list[Following]:
    """Every segment that drives a coordinate.

    Args:
        record: of the vehicle.
        geometry: its lengths.
        parameters: about its own, for the gains.
        processing: filters.

    Raises:
        RecordError: it holds no such step, or is sampled too slowly.
    """
    found = []
    for signals in signals_of(record, geometry, processing):
        base = base_step(signals.segment.step)
        spec = None if base is None else ROWS.get(base)
        if spec is not None:
            found.append(_following(signals, spec, geometry, parameters, processing))
    if not found:
        raise RecordError(f"{record.source} has no step to simulate.", f"Record one of: {', '.join(ROWS)}.")
    return found


def _following(
    signals: Signals, spec: RowsOfStep, geometry: Geometry, parameters: Parameters, processing: Processing
) -> Following:
    names = tuple(name for own in spec.coordinates for name in (_SIDES if own == "alpha_v" else (own,)))
    columns = [_joints(signals, spec, name, geometry) for name in names]
    torques = geometry.gear_ratio * signals.torques
    moved = [np.einsum("nw,nw->n", wheels, torques) for _, wheels in columns]
    dt = signals.segment.sample_time
    return Following(
        signals,
        spec,
        names,
        np.stack([weights for weights, _ in columns], axis=1),
        np.array([_inertia(name, geometry, parameters) for name in names]),
        zero_phase(np.stack(moved, axis=1), processing.cutoff, dt),
        np.stack([moving_rows(_rates(signals, spec, name), processing, dt) for name in names], axis=1),
    )


def _joints(signals: Signals, spec: RowsOfStep, name: str, geometry: Geometry) -> tuple[Array, Array]:
    """Weights (N, 6) of the joints at which a coordinate is held, and (N, 4) of the wheels that drive it."""
    samples = len(signals.heading)
    weights = np.zeros((samples, 6))
    if name in _SIDES:
        weights[:, _SIDES.index(name)] = 1.0
        H = kinematics.complement(Mode.ALIGNMENT, signals.alpha, geometry)
        return weights, H[:, _BETA, _SIDES.index(name)]
    if spec.mode is None:
        weights[:, 2 + WHEELS.index(name.removeprefix("beta_"))] = 1.0
    else:
        H = kinematics.complement(spec.mode, signals.alpha, geometry)
        weights[:, 2:] = H[:, _BETA, GENERALIZED_VELOCITIES[spec.mode].index(name)]
    return weights, weights[:, 2:]


def _rates(signals: Signals, spec: RowsOfStep, name: str) -> Array:
    """Rates of the joints whose friction acts in a coordinate's row; all must move."""
    if name == "x":
        return signals.beta_rate
    if spec.mode is None:
        return signals.beta_rate[:, [WHEELS.index(name.removeprefix("beta_"))]]
    return signals.joint_rates[:, [joint - 3 for joint in spec.joints]]


def _inertia(name: str, geometry: Geometry, p: Parameters) -> float:
    wheels = p["B_w"] / geometry.wheel_radius**2
    if name in _SIDES:
        return p["C_l" if name == "alpha_l" else "C_r"] + 2 * geometry.wheel_offset**2 * wheels
    if name == "gamma":
        return p["C_ch"] + p["C_l"] + p["C_r"] + 4 * geometry.rotation_lever**2 * wheels
    return p["m_ch"] + 4 * wheels if name in ("x", "y") else p["B_w"]


def differences_of(following: Following, forces: Array, processing: Processing) -> list[Difference]:
    """What a simulator lacks, of each coordinate that the step drives and that moves.

    Args:
        following: that it was held to.
        forces: (N, n) that held it.
        processing: its `cutoff` is that of the comparison.
    """
    segment = following.segment
    lacking = zero_phase(forces, processing.cutoff, segment.sample_time)
    samples = repeats_of(segment.period)
    found = []
    for column, name in enumerate(following.coordinates):
        kept = samples[:, following.moving[samples, column].all(axis=0)]
        if not kept.size:
            continue
        recorded = following.recorded[kept, column]
        found.append(
            Difference(
                segment.step,
                name,
                torque_unit(name),
                segment.time[kept] - segment.time[0],
                recorded,
                recorded + lacking[kept, column],
                np.cumsum(np.diff(kept[0], prepend=kept[0, 0]) > 1),
            )
        )
    return found


def all_differences(
    followings: Sequence[Following], forces: Sequence[Array], processing: Processing
) -> list[Difference]:
    """Of all segments."""
    return [
        difference
        for following, own in zip(followings, forces, strict=True)
        for difference in differences_of(following, own, processing)
    ]
