"""Rows of records before they are evaluated: which samples of which step, in which channel."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.records import rows
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.loose import as_it_was, near_middle, taken_apart
from ident.diagnosis.vehicle.records.resting import WIDE, resting_wheel
from ident.diagnosis.vehicle.records.signals import Signals, decimation, signals_of
from ident.diagnosis.vehicle.records.wandering import wanders
from ident.errors import RecordError
from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import SEVEN, Processing, away_from_ends, rate_noise, sliding_samples, zero_phase
from ident.plant.modes import Mode
from ident.records.record import Record, Step, base_step
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON

Array = NDArray[np.float64]

DIAGNOSED: Final = tuple(step for step in ROWS if step is not Step.LANE_CHANGE)
"""Steps that causes are looked for in; the lane change is kept for judging what was found."""

OVERSAMPLED: Final = 3.0
"""Rate at which rows are evaluated, in units of the cutoff of the smoothed signals over π."""

SIGNAL_BANDWIDTH: Final = 1000.0
"""Of the signals [rad/s]: motors on the compliance of their gears' teeth rattle more slowly than that."""

SIGNAL_SHARE: Final = 0.64
"""The same at most, in units of the Nyquist frequency."""

SLIDING: Final = 2 * COULOMB_EPSILON
"""Joint rate from which dry friction is what (16) says, to a thirtieth [rad/s]: below, a joint may stick."""

DRY: Final = SLIDING / 20
"""ε of the friction in rows [rad/s]: what slides at `SLIDING` and above has all of it, whatever it is at rest."""

SURELY: Final = 3.0
"""Standard deviations of a measured rate from which a joint surely moves."""

SHOWN: Final = 0.5
"""Part of what the filter makes a row of that must be samples in which its equation holds."""


@dataclass(frozen=True, eq=False)
class Source:
    """Rows of one channel of one segment before they are evaluated; equal to none but itself.

    Attributes:
        channel: kinematic or dynamic.
        step: the segment's own name.
        spec: rows that the step has.
        inputs: (M, INPUTS) at a rate that the smoothed signals allow; wheels whose motors rattle roll as the others do.
        sample_time: of them [s].
        interval: at which they were recorded [s], which is what sampling is as late as.
        factor: every how manieth becomes a row of a block.
        moving: rows to be used (M,), a mask for each of its coordinates.
        holds: (M, rows) samples in which the equation of each holds: none of its joints sticks.
        period: (M,).
        record: for messages.
        time: (M,) since the record began [s].
        rattles: (M, 4) where the motor of each wheel rattles in its gear.
        own: its rows, if they are those of what is loose, instead of what rolls.
    """

    channel: Channel
    step: str
    spec: RowsOfStep
    inputs: Array
    sample_time: float
    interval: float
    factor: int
    moving: tuple[NDArray[np.bool_], ...]
    holds: NDArray[np.bool_]
    period: NDArray[np.int64]
    record: str
    time: Array
    rattles: NDArray[np.bool_]
    own: rows.OwnRows | None = None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of its rows, a block each."""
        if self.own is not None:
            return self.own.coordinates
        return rows.coordinates(self.channel, self.spec)

    @property
    def across(self) -> float:
        """How far a unit wanders, or a motor moves at rest: the number that its own rows are of [rad]."""
        return 0.0 if self.own is None else float(self.inputs[:, self.own.columns].max())

    @property
    def travels(self) -> bool:
        """Whether the vehicle drives in it, wheels steered or not."""
        return self.spec.mode not in (None, Mode.ALIGNMENT)

    @property
    def rolls_at_standstill(self) -> bool:
        """Whether its rows are those of wheels that roll while a side steers."""
        return self.channel is Channel.KINEMATIC and self.spec.mode is Mode.ALIGNMENT and self.own is None

    @property
    def rolls(self) -> bool:
        """Whether its rows are those of rolling wheels that travel."""
        return self.channel is Channel.KINEMATIC and self.travels and self.own is None


def sources_of(
    record: Record, geometry: Geometry, steps: Sequence[Step], processing: Processing, *, as_recorded: bool = False
) -> list[Source]:
    """Rows of a record that belong to the steps; of what does not move or says nothing there are none.

    Args:
        record: of the vehicle.
        geometry: its lengths.
        steps: whose rows are wanted, variants of them included.
        processing: filters and thresholds.
        as_recorded: whether all is taken as it was measured, what is loose too.

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
    shown = [source for source in _judged_by_others(found) if any(mask.any() for mask in source.moving)]
    if not shown:
        raise RecordError(
            f"{record.source} does not move in any step of a diagnosis.",
            "Record a drive: angles of wheels and steering must change.",
        )
    return shown


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
    recorded[:, SLICES["torques"]] = zero_phase(
        recorded[:, SLICES["torques"]], processing.signal_cutoff, segment.sample_time
    )
    loose = as_it_was(recorded) if as_recorded else taken_apart(recorded, signals, spec, geometry, processing)
    common = {
        "step": segment.step,
        "spec": spec,
        # Column by column, as `copied` keeps them.
        "inputs": np.asfortranarray(loose.inputs[::stride]),
        "sample_time": segment.sample_time * stride,
        "interval": segment.sample_time,
        "factor": factor // stride,
        "period": segment.period[::stride],
        "record": signals.record,
        "time": segment.time[::stride],
        "rattles": loose.rattles[::stride],
    }
    slowest, joints = _slowest(signals, processing), [_joints(spec, name) for name in spec.coordinates]
    slides = [
        sliding_samples(signals.joint_rates[:, own], processing, segment.sample_time, slowest[own]) for own in joints
    ]
    dynamic = tuple(_shown(samples, processing, segment.sample_time)[::stride] for samples in slides)
    holds = np.stack(slides, axis=1)[::stride]
    yield Source(channel=Channel.DYNAMIC, moving=dynamic, holds=holds, **common)  # type: ignore[arg-type]
    names = rows.kinematic_coordinates(spec)
    if names and loose.rolls:
        kinematic = (_rolling(signals, spec, processing)[::stride],) * len(names)
        yield Source(channel=Channel.KINEMATIC, moving=kinematic, holds=_throughout(kinematic), **common)  # type: ignore[arg-type]
    for own, masks in loose.own:
        moving = tuple(mask[::stride] for mask in masks)
        yield Source(channel=Channel.KINEMATIC, moving=moving, holds=_throughout(moving), own=own, **common)  # type: ignore[arg-type]


def _judged_by_others(sources: Sequence[Source]) -> Sequence[Source]:
    """The sources of a record, without rows at standstill that what is loose elsewhere moves."""
    own = [source for source in sources if source.own is not None and source.spec.mode is Mode.ALIGNMENT]
    loose = list(_resting(sources))
    shown = [*loose, *_wandering([source for source in own if resting_wheel(source.own) is None])]
    # The motion of a motor in a wide play would pass for that of wheels, whichever side steers.
    wide = any(source.across > WIDE for source in loose)
    left_out = [*own, *(source for source in sources if wide and source.rolls_at_standstill)]
    return [source for source in sources if source in shown or source not in left_out]


def _resting(sources: Sequence[Source]) -> Iterator[Source]:
    """Steps in which a motor moves at rest that rattles in some drive of the record."""
    rattles = np.any([source.rattles.any(axis=0) for source in sources], axis=0)
    return (source for source in sources if (wheel := resting_wheel(source.own)) is not None and rattles[wheel])


def _wandering(sources: Sequence[Source]) -> Iterator[Source]:
    """Of a unit that may wander, the step in which it goes furthest, if that is a play."""
    furthest: dict[rows.OwnRows | None, Source] = {}
    for source in sources:
        if source.own not in furthest or source.across > furthest[source.own].across:
            furthest[source.own] = source
    for source in furthest.values():
        if wanders(source.across, [other.across for other in furthest.values() if other is not source]):
            yield source


def _throughout(moving: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """What rolls, or is loose, has equations that hold at rest as well."""
    return np.ones((len(moving[0]), len(moving)), dtype=bool)


def _slowest(signals: Signals, processing: Processing) -> Array:
    """Rate of every joint (6,), as in `Signals.joint_rates`, from which it surely slides [rad/s]."""
    segment = signals.segment
    angles = np.hstack([segment.steering_angles, segment.wheel_angles])
    noise = rate_noise(angles, processing, segment.sample_time, SEVEN)
    return np.asarray(np.maximum(SLIDING, SURELY * noise))


def _shown(holds: NDArray[np.bool_], processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Rows (N,) of mostly those samples in which their equation holds, away from the ends of the filter.

    Rows beside and among samples that stick hold as well: all of their terms are zero there (`Context.in_rows`).
    """
    shown = zero_phase(holds.astype(float), processing.cutoff, sample_time) > SHOWN
    return away_from_ends(shown, processing, sample_time)


def _joints(spec: RowsOfStep, coordinate: str) -> list[int]:
    """Columns of `Signals.joint_rates` whose friction is in the dynamic row of a coordinate."""
    if spec.mode is None:
        return [2 + spec.coordinates.index(coordinate)]
    return [2, 3, 4, 5] if coordinate == "x" else [joint - 3 for joint in spec.joints]


def _rolling(signals: Signals, spec: RowsOfStep, processing: Processing) -> NDArray[np.bool_]:
    """Rows in or near motion, away from the ends of the filter: where nothing moves, no constraint can be broken.

    Steering at standstill, wheels that stand askew push the chassis aside, and what holds it there creeps.
    """
    dt = signals.segment.sample_time
    width = 2 * round(processing.guard / dt) + 1
    moving = np.any(np.abs(signals.joint_rates) > processing.moving, axis=1)
    near = away_from_ends(ndimage.binary_dilation(moving, np.ones(width, dtype=bool)), processing, dt)
    if spec.mode is Mode.ALIGNMENT:
        near &= near_middle(signals)
    return np.asarray(near)
