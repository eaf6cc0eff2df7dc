"""Rows of records before they are evaluated: which samples of which step, in which channel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.integrate import cumulative_trapezoid

from ident.errors import RecordError
from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import Processing, moving_rows, zero_phase
from ident.gap.problem import Channel
from ident.gap.vehicle import rows
from ident.gap.vehicle.rattling import above_band, hammer, rattling
from ident.gap.vehicle.signals import Signals, decimation, signals_of
from ident.gap.vehicle.sliding import rolled_with_others, rolling_rates
from ident.records.record import Record, Step, base_step
from ident.vehicle import kinematics
from ident.vehicle.geometry import WHEELS, Geometry
from ident.vehicle.modes import Mode

Array = NDArray[np.float64]

DIAGNOSED: Final = tuple(step for step in ROWS if step is not Step.LANE_CHANGE)
"""Steps that causes are looked for in; the lane change is kept for judging what was found."""

OVERSAMPLED: Final = 3.0
"""Rate at which rows are evaluated, in units of the cutoff of the smoothed signals over π."""

ASKEW: Final = 0.4
"""Steering angle beyond which a wheel that steers at standstill pushes the chassis aside [rad]."""

SIGNAL_BANDWIDTH: Final = 1000.0
"""Of the signals [rad/s]: motors on the compliance of their gears' teeth rattle more slowly than that."""

SIGNAL_SHARE: Final = 0.64
"""The same at most, in units of the Nyquist frequency."""


@dataclass(frozen=True)
class Source:
    """Rows of one channel of one segment before they are evaluated.

    Attributes:
        channel: kinematic or dynamic.
        step: the segment's own name.
        spec: rows that the step has.
        inputs: (M, INPUTS) at a rate that the smoothed signals allow; wheels whose motors rattle roll as the others do.
        sample_time: of them [s].
        factor: every how manieth becomes a row of a block.
        moving: rows to be used (M,), a mask for each of its coordinates.
        period: (M,).
        record: for messages.
        rattles: (M, 4) where the motor of each wheel rattles in its gear.
        motors: wheels whose motors rattle, if the rows are those of these motors instead of what rolls.
    """

    channel: Channel
    step: str
    spec: RowsOfStep
    inputs: Array
    sample_time: float
    factor: int
    moving: tuple[NDArray[np.bool_], ...]
    period: NDArray[np.int64]
    record: str
    rattles: NDArray[np.bool_]
    motors: tuple[int, ...] = ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of its rows, a block each."""
        if self.motors:
            return tuple(f"rattle_{WHEELS[wheel]}" for wheel in self.motors)
        return rows.coordinates(self.channel, self.spec)

    @property
    def travels(self) -> bool:
        """Whether the vehicle drives in it, wheels steered or not."""
        return self.spec.mode not in (None, Mode.ALIGNMENT)

    @property
    def rolls(self) -> bool:
        """Whether its rows are those of rolling wheels that travel."""
        return self.channel is Channel.KINEMATIC and self.travels and not self.motors


def sources_of(
    record: Record, geometry: Geometry, steps: Sequence[Step], processing: Processing, *, as_recorded: bool = False
) -> list[Source]:
    """Rows of a record that belong to the steps; of what does not move or says nothing there are none.

    Args:
        record: of the vehicle.
        geometry: its lengths.
        steps: whose rows are wanted, variants of them included.
        processing: filters and thresholds.
        as_recorded: whether all is taken as it was measured, motors that rattle too.

    Raises:
        RecordError: it has none of the steps, or moves in none of them.
    """
    found = [
        source
        for signals in signals_of(record, geometry, processing)
        if (spec := _spec(signals.segment.step, steps)) is not None
        for source in _sources(signals, spec, geometry, processing, as_recorded)
    ]
    if not found:
        raise RecordError(
            f"{record.source} holds none of the steps of a diagnosis.",
            f"It needs some of {', '.join(steps)} by these names in the channel step.",
        )
    if not any(mask.any() for source in found for mask in source.moving):
        raise RecordError(
            f"{record.source} does not move in any step of a diagnosis.",
            "Record a drive: angles of wheels and steering must change.",
        )
    return [source for source in found if any(mask.any() for mask in source.moving)]


def processing_of(records: Sequence[Record]) -> Processing:
    """Filters of the estimate, but signals that still show a motor that rattles in its gear."""
    usual = Processing()
    nyquist = min((np.pi / segment.sample_time for record in records for segment in record.segments), default=0.0)
    return replace(usual, signal_cutoff=float(np.clip(SIGNAL_SHARE * nyquist, usual.signal_cutoff, SIGNAL_BANDWIDTH)))


def _spec(step: str, steps: Sequence[Step]) -> RowsOfStep | None:
    base = base_step(step)
    return ROWS[base] if base is not None and base in steps else None


def _sources(
    signals: Signals, spec: RowsOfStep, geometry: Geometry, processing: Processing, as_recorded: bool
) -> Iterable[Source]:
    segment = signals.segment
    factor = decimation(segment, processing.cutoff)
    most = max(1, int(np.pi / (OVERSAMPLED * processing.signal_cutoff * segment.sample_time)))
    stride = next(stride for stride in range(min(most, factor), 0, -1) if factor % stride == 0)
    recorded = signals.as_inputs()
    recorded[:, rows.SLICES["torques"]] = zero_phase(
        recorded[:, rows.SLICES["torques"]], processing.signal_cutoff, segment.sample_time
    )
    rms, rattles = _rattling(signals, () if as_recorded else _against_one_another(spec), geometry, processing)
    inputs = _hammered(recorded, rms, rattles, geometry, segment.sample_time) if rattles.any() else recorded
    common = {
        "step": segment.step,
        "spec": spec,
        "inputs": inputs[::stride],
        "sample_time": segment.sample_time * stride,
        "factor": factor // stride,
        "period": segment.period[::stride],
        "record": signals.record,
        "rattles": rattles[::stride],
    }
    dynamic = tuple(_moving(signals, spec, name, processing)[::stride] for name in spec.coordinates)
    yield Source(channel=Channel.DYNAMIC, moving=dynamic, **common)  # type: ignore[arg-type]
    names = rows.kinematic_coordinates(spec)
    if names and not rattles.any():
        rolling = _rolling(signals, spec, processing)[::stride]
        yield Source(channel=Channel.KINEMATIC, moving=(rolling,) * len(names), **common)  # type: ignore[arg-type]
    if rattles.any() and spec.mode is not Mode.ALIGNMENT:
        # While steering at standstill the unit swings back against the motor, which no other wheel shows.
        motors = tuple(np.flatnonzero(rattles.any(axis=0)).tolist())
        inside = _inside(rattles, processing, segment.sample_time)
        shaking = tuple(inside[::stride, wheel] for wheel in motors)
        yield Source(channel=Channel.KINEMATIC, moving=shaking, motors=motors, **common)  # type: ignore[arg-type]


def _against_one_another(spec: RowsOfStep) -> tuple[int, ...]:
    """Wheels of a step whose motors may rattle and are compared; in the air no floor is hammered, and nothing rolls."""
    if spec.mode is Mode.ALIGNMENT:
        return tuple(WHEELS.index(name[-2:]) for name in rows.kinematic_coordinates(spec))
    return () if spec.mode is None else tuple(range(len(WHEELS)))


def _rattling(
    signals: Signals, wheels: tuple[int, ...], geometry: Geometry, processing: Processing
) -> tuple[Array, NDArray[np.bool_]]:
    """`rattling` of some wheels, none of the others (N, 4).

    What turns with the units is no rattling: at standstill a unit jumps where its friction reverses, and only one motor
    that moves beside it rattles.
    """
    rms, rattles = np.zeros(signals.beta.shape), np.zeros(signals.beta.shape, dtype=np.bool_)
    if not wheels:
        return rms, rattles
    motors = signals.beta
    if len(wheels) < len(WHEELS):
        motors = motors - signals.alpha @ kinematics.complement(Mode.ALIGNMENT, np.zeros((1, 2)), geometry)[0, 5:].T
    picked = np.array(wheels)
    rms[:, picked], rattles[:, picked] = rattling(motors[:, picked], processing, signals.segment.sample_time)
    return rms, rattles


def _inside(rattles: NDArray[np.bool_], processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Where motors rattle (N, 4), away from the ends of the filter."""
    ends, found = round(processing.guard / sample_time), rattles.copy()
    found[:ends] = found[len(found) - ends :] = False
    return found


def _hammered(recorded: Array, rms: Array, rattles: NDArray[np.bool_], geometry: Geometry, sample_time: float) -> Array:
    """Signals (N, INPUTS) with what motors do that rattle, and with wheels that roll in spite of it."""
    wheels = np.flatnonzero(rattles.any(axis=0)).tolist()
    rolled = rolling_rates(recorded, wheels, geometry)
    inputs = rolled_with_others(recorded, wheels, rolled, sample_time)
    against = recorded[:, rows.SLICES["beta"]].copy()
    against[:, wheels] -= cumulative_trapezoid(rolled, dx=sample_time, axis=0, initial=0)
    moved = above_band(against, sample_time)
    weights = np.where(rattles, hammer(moved, rms), 0.0)
    inputs[:, rows.SLICES["hammer"]], inputs[:, rows.SLICES["rattle"]] = weights, weights * moved
    return inputs


def _moving(signals: Signals, spec: RowsOfStep, coordinate: str, processing: Processing) -> NDArray[np.bool_]:
    joints = [joint - 3 for joint in spec.joints]
    if spec.mode is None:
        joints = [2 + spec.coordinates.index(coordinate)]
    elif coordinate == "x":
        joints = [2, 3, 4, 5]
    return moving_rows(signals.joint_rates[:, joints], processing, signals.segment.sample_time)


def _rolling(signals: Signals, spec: RowsOfStep, processing: Processing) -> NDArray[np.bool_]:
    """Rows in or near motion, away from the ends of the filter: where nothing moves, no constraint can be broken.

    Steering at standstill, wheels that stand askew push the chassis aside, and what holds it there creeps.
    """
    dt = signals.segment.sample_time
    width = 2 * round(processing.guard / dt) + 1
    moving = np.any(np.abs(signals.joint_rates) > processing.moving, axis=1)
    near = ndimage.binary_dilation(moving, np.ones(width, dtype=bool))
    near[: width // 2] = near[-(width // 2) :] = False
    if spec.mode is Mode.ALIGNMENT:
        near &= np.all(np.abs(signals.alpha) < ASKEW, axis=1)
    return np.asarray(near)
