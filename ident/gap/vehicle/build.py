"""A record of the platform as a regression: blocks of the dynamic and the kinematic channel, columns of every cause."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.errors import RecordError
from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import Processing, moving_rows, zero_phase
from ident.gap.problem import Block, Candidate, Channel, Nominal, Problem, Variant
from ident.gap.vehicle import rows
from ident.gap.vehicle.askew import beside_sliding, stands_askew
from ident.gap.vehicle.library import DRIFTS, ONE_SIDED, SHAPES, TermCause, placed_parameters, term_causes
from ident.gap.vehicle.regions import coordinate_motion, features_of, regions_of
from ident.gap.vehicle.signals import Signals, decimation, signals_of
from ident.gap.vehicle.sliding import (
    ALONG,
    ALONG_STD,
    ANY_WHEEL,
    SlidingCause,
    adhesion,
    slides_alone,
    sliding_cause,
    sliding_causes,
)
from ident.gap.vehicle.transforms import Setting, TransformCause, transform_cause, transform_causes
from ident.records.record import Record, Step, base_step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.effect_terms import TERMS, EffectTerm, term_of
from ident.vehicle.effects import Effect, EffectName
from ident.vehicle.geometry import Geometry
from ident.vehicle.modes import Mode
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES, PARAMETER_UNITS, Parameters

Array = NDArray[np.float64]
Cause = TermCause | TransformCause | SlidingCause

DIAGNOSED: Final = tuple(step for step in ROWS if step is not Step.LANE_CHANGE)
"""Steps that causes are looked for in; the lane change is kept for judging what was found."""

OVERSAMPLED: Final = 3.0
"""Rate at which rows are evaluated, in units of the cutoff of the smoothed signals over π."""

ASKEW: Final = 0.4
"""Steering angle beyond which a wheel that steers at standstill pushes the chassis aside [rad]."""

CREEP: Final = 3e-4
"""Part of the rolling speed by which a wheel may creep, as any tyre does at some percent of its adhesion [-]."""

TURNING_CREEP: Final = 1e-3
"""The same for wheels that turn about their steering axes at standstill, where the chassis is held by creep alone."""

RATTLING: Final = 1000.0
"""Bandwidth of the signals [rad/s]: motors on the compliance of their gears' teeth rattle more slowly than that."""

RATTLING_SHARE: Final = 0.64
"""The same at most, in units of the Nyquist frequency."""

ROUNDING: Final = 1e-12
"""Of a column, relative to what the model has in the same row."""

PRIOR_WEIGHT: Final = 1e-4
"""Of the vehicle file's guesses against the rows, per unit-norm column: only what no row shows is taken from them."""

FORMULAS_KEPT: Final = 4
"""Libraries of causes, and sets of given effects, whose generated formulas a process keeps."""

AT_ONCE: Final = 16
"""Columns that pass the filter together: it makes several copies of them."""


@dataclass(frozen=True)
class Source:
    """Rows of one channel of one segment before they are evaluated.

    Attributes:
        channel: kinematic or dynamic.
        step: the segment's own name.
        spec: rows that the step has.
        inputs: (M, INPUTS) at a rate that the smoothed signals allow.
        sample_time: of them [s].
        factor: every how manieth becomes a row of a block.
        moving: (M,) rows to be used.
        period: (M,).
        record: for messages.
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

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of its rows, a block each."""
        return rows.coordinates(self.channel, self.spec)


@dataclass(frozen=True)
class Context:
    """What all rows share.

    Attributes:
        geometry: of the vehicle.
        processing: filters and thresholds.
        parameters: p (11,) at which columns are taken.
        known: the same, by which effects with a memory tell the forces inside the vehicle; a refit does not move them,
            for rows that hardly show a parameter (B_w) let it go anywhere.
        formulas: the equations, effects that are given in them.
        given: effects with a memory that are part of the model too.
        kept: rows of every source for the parameters asked for last.
    """

    geometry: Geometry
    processing: Processing
    parameters: Array
    known: Array
    formulas: rows.Formulas
    given: tuple[tuple[TransformCause | SlidingCause, Array], ...] = ()
    kept: dict[int, tuple[bytes, Array]] = field(default_factory=dict)

    @property
    def constants(self) -> tuple[Array, Array, Array]:
        """What the formulas take beside the inputs."""
        return self.geometry.as_vector(), np.array([COULOMB_EPSILON]), self.parameters

    def setting(self, source: Source) -> Setting:
        """What effects with a memory need beside the signals of a source."""
        return Setting(self.geometry, self.known, source.sample_time)

    def inputs(self, source: Source) -> Array:
        """Measured signals of a source, the given effects with a memory taken out."""
        inputs, setting = source.inputs, self.setting(source)
        for cause, sizes in self.given:
            inputs = cause.without(inputs, sizes, setting)
        return inputs

    def plain(self, source: Source) -> Array:
        """The rows of a source without any further effect (M, rows, 1); the last ones are kept."""
        asked, kept = self.parameters.tobytes(), self.kept.get(id(source))
        if kept is not None and kept[0] == asked:
            return kept[1]
        exact = self.formulas.exact(source.channel, source.spec)
        rows_now = exact(self.inputs(source), *self.constants, np.zeros(0))
        self.kept[id(source)] = (asked, rows_now)
        return rows_now

    def filtered(self, values: Array, source: Source) -> Array:
        """Columns (M, ...) through the filter, thinned to the rows of the source's blocks."""
        flat = values.reshape(len(values), -1)
        thinned = [
            zero_phase(part, self.processing.cutoff, source.sample_time)[:: source.factor]
            for part in np.split(flat, range(AT_ONCE, flat.shape[1], AT_ONCE), axis=1)
        ]
        return np.hstack(thinned).reshape(-1, *values.shape[1:])


def build_problem(
    records: Sequence[Record],
    vehicle: VehicleDescription,
    model: Parameters | None = None,
    *,
    given: Sequence[Effect] = (),
    effects: Sequence[EffectName] = tuple(EffectName),
    steps: Sequence[Step] = DIAGNOSED,
    processing: Processing | None = None,
) -> Problem:
    """Rows and causes of some records.

    Args:
        records: of campaigns with this vehicle as it is.
        vehicle: its geometry is taken as true, its prior only for what no row shows.
        model: values being judged; None: they are refitted, and changed values are no cause.
        given: effects that the model has already.
        effects: that are looked for.
        steps: whose rows are used, variants of them included.
        processing: filters and thresholds; None: those of the estimate, signals as fast as the records allow.

    Raises:
        RecordError: none of the steps is in a record.
    """
    processing = processing or _processing(records)
    sources = [source for record in records for source in sources_of(record, vehicle.geometry, steps, processing)]
    context = make_context(sources, vehicle, model, given, processing)
    causes = _causes(tuple(effects), model is not None)
    units = [unit for cause in causes if isinstance(cause, TermCause) for v in cause.variants for unit in v.units]
    tables = [_table(source, context, units) for source in sources]
    blocks = [block for source, table in zip(sources, tables, strict=True) for block in _blocks(source, table, context)]
    columns = iter(range(_COLUMNS, _COLUMNS + len(units)))
    candidates = [_candidate(cause, columns, sources, tables, context) for cause in causes]
    return Problem(
        names=PARAMETER_NAMES,
        units=tuple(PARAMETER_UNITS.values()),
        blocks=tuple(blocks),
        candidates=tuple(_askew_ones(candidates, sources, context)),
        nominal=Nominal(model.values, model.std) if model else None,
    )


def _processing(records: Sequence[Record]) -> Processing:
    """Filters of the estimate, but signals that still show a motor that rattles in its gear."""
    usual = Processing()
    nyquist = min((np.pi / segment.sample_time for record in records for segment in record.segments), default=0.0)
    return replace(usual, signal_cutoff=float(np.clip(RATTLING_SHARE * nyquist, usual.signal_cutoff, RATTLING)))


def make_context(
    sources: Sequence[Source],
    vehicle: VehicleDescription,
    model: Parameters | None,
    given: Sequence[Effect],
    processing: Processing,
) -> Context:
    """Context of some sources; without a model, parameters are fitted to them."""
    terms = _formulas(tuple(_frozen(term_of(effect)) for effect in given if effect.name in TERMS))
    memories = tuple(_memory(effect) for effect in given if effect.name not in TERMS)
    context = Context(vehicle.geometry, processing, vehicle.prior.values, vehicle.prior.values, terms, memories)
    values = model.values if model else fitted_parameters(sources, vehicle, context)
    return replace(context, parameters=values, known=values)


_FrozenTerm = tuple[EffectName, str, tuple[tuple[str, float], ...]]


def _frozen(term: EffectTerm) -> _FrozenTerm:
    return term.name, term.where, tuple(term.values.items())


@lru_cache(maxsize=FORMULAS_KEPT)
def _formulas(given: tuple[_FrozenTerm, ...]) -> rows.Formulas:
    return rows.Formulas([EffectTerm(name, where, dict(values)) for name, where, values in given])


def _memory(effect: Effect) -> tuple[TransformCause | SlidingCause, Array]:
    """What takes an effect that is no term out of the signals, with its sizes."""
    if effect.name is EffectName.SLIP:
        return sliding_cause(effect.where), np.ones(1)
    return transform_cause(effect.name, effect.where), np.array([effect.size])


def sources_of(record: Record, geometry: Geometry, steps: Sequence[Step], processing: Processing) -> list[Source]:
    """Rows of a record that belong to the steps; of those in which nothing moves there are none.

    Raises:
        RecordError: it has none of the steps, or moves in none of them.
    """
    found = [
        source
        for signals in signals_of(record, geometry, processing)
        if (spec := _spec(signals.segment.step, steps)) is not None
        for source in _sources(signals, spec, processing)
    ]
    if not found:
        raise RecordError(
            f"{record.source} holds none of the steps of a diagnosis.",
            f"It needs some of {', '.join(steps)} by these names in the channel step.",
        )
    moving = [source for source in found if any(mask.any() for mask in source.moving)]
    if not moving:
        raise RecordError(
            f"{record.source} does not move in any step of a diagnosis.",
            "Record a drive: angles of wheels and steering must change.",
        )
    return moving


def _spec(step: str, steps: Sequence[Step]) -> RowsOfStep | None:
    base = base_step(step)
    return ROWS[base] if base is not None and base in steps else None


def _sources(signals: Signals, spec: RowsOfStep, processing: Processing) -> Iterable[Source]:
    segment = signals.segment
    factor = decimation(segment, processing.cutoff)
    most = max(1, int(np.pi / (OVERSAMPLED * processing.signal_cutoff * segment.sample_time)))
    stride = next(stride for stride in range(min(most, factor), 0, -1) if factor % stride == 0)
    inputs = signals.as_inputs()
    inputs[:, rows.SLICES["torques"]] = zero_phase(
        inputs[:, rows.SLICES["torques"]], processing.signal_cutoff, segment.sample_time
    )
    common = {
        "step": segment.step,
        "spec": spec,
        "inputs": inputs[::stride],
        "sample_time": segment.sample_time * stride,
        "factor": factor // stride,
        "period": segment.period[::stride],
        "record": signals.record,
    }
    dynamic = tuple(_moving(signals, spec, name, processing)[::stride] for name in spec.coordinates)
    yield Source(channel=Channel.DYNAMIC, moving=dynamic, **common)  # type: ignore[arg-type]
    names = rows.kinematic_coordinates(spec)
    if names:
        rolling = _rolling(signals, spec, processing)[::stride]
        yield Source(channel=Channel.KINEMATIC, moving=(rolling,) * len(names), **common)  # type: ignore[arg-type]


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


def fitted_parameters(sources: Sequence[Source], vehicle: VehicleDescription, context: Context) -> Array:
    """p (11,) by least squares over the dynamic rows; what they do not show stays at the vehicle file's guesses."""
    prior = vehicle.prior.values
    normal, right = np.zeros((2, len(prior), len(prior)))[0], np.zeros(len(prior))
    for source in sources:
        if source.channel is Channel.DYNAMIC:
            table = _table(source, context, [])
            for row, moving in enumerate(source.moving):
                kept = table[moving[:: source.factor], row]
                theta = kept[:, 1:_COLUMNS] * prior
                normal += theta.T @ theta
                right += theta.T @ (-kept[:, 0] - theta.sum(axis=1))
    scale = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    weighted = normal / np.outer(scale, scale) + PRIOR_WEIGHT * np.eye(len(prior))
    return np.asarray(prior * (1 + np.linalg.solve(weighted, right / scale) / scale))


_COLUMNS: Final = 1 + len(PARAMETER_NAMES)
"""Columns of a table before those of the causes: residual at p = 0, then Θ."""


def _table(source: Source, context: Context, units: Sequence[rows.UnitTerm]) -> Array:
    """Filtered residual at p = 0, regressor and columns of a source: (N, rows, 12 + units)."""
    function = context.formulas.linearised(source.channel, source.spec, units)
    entries = function.entries(context.inputs(source), *context.constants)
    return function.matrices(context.filtered(entries.T, source).T)


def _blocks(source: Source, table: Array, context: Context) -> Iterable[Block]:
    """One block a coordinate; the target is what baseline and causes add up to."""
    for row, name in enumerate(source.coordinates):
        motion = coordinate_motion(source.inputs, source.spec, name, context.geometry)
        position, rate, acceleration = (values[:: source.factor] for values in motion)
        target = -table[:, row, 0]
        load = context.filtered(np.abs(source.inputs[:, rows.SLICES["torques"]]).sum(axis=1), source)
        yield Block(
            record=source.record,
            channel=source.channel,
            step=source.step,
            coordinate=name,
            unit=_unit(source.channel, name),
            sample_time=source.sample_time * source.factor,
            bandwidth=context.processing.cutoff,
            target=target,
            baseline=table[:, row, 1:_COLUMNS],
            moving=source.moving[row][:: source.factor],
            period=source.period[:: source.factor],
            regions=regions_of(position, rate, acceleration, load),
            features=features_of(position, rate, acceleration, load),
            tolerance=tolerated_creep(source, context.geometry) if source.channel is Channel.KINEMATIC else 0.0,
        )


def tolerated_creep(source: Source, geometry: Geometry) -> float:
    """Speed of the contacts (rms) that creep may take from rolling [m/s]."""
    speed = geometry.wheel_radius * source.inputs[:, rows.SLICES["beta_rate"]]
    return granted_creep(source.spec.mode, speed[source.moving[0]])


def granted_creep(mode: Mode | None, speed: Array) -> float:
    """The same of contacts that roll at some speeds (..., 4) [m/s] in a mode."""
    creep = TURNING_CREEP if mode is Mode.ALIGNMENT else CREEP
    return creep * float(np.sqrt(np.mean(speed**2)))


def _unit(channel: Channel, coordinate: str) -> str:
    if channel is Channel.KINEMATIC:
        return "m/s"
    return "N" if coordinate in ("x", "y") else "Nm"


@lru_cache(maxsize=FORMULAS_KEPT)
def _causes(effects: tuple[EffectName, ...], judged: bool) -> tuple[Cause, ...]:
    names = tuple(name for name in effects if judged or name not in DRIFTS)
    sliding = sliding_causes() if EffectName.SLIP in names else []
    return (*term_causes(names), *transform_causes(names), *sliding)


def _candidate(
    cause: Cause, columns: Iterator[int], sources: Sequence[Source], tables: Sequence[Array], context: Context
) -> Candidate:
    if isinstance(cause, SlidingCause):
        return _sliding(cause, sources, context)
    if isinstance(cause, TransformCause):
        variants: tuple[Variant, ...] = tuple(_probed(cause, sources, context))
    else:
        variants = tuple(
            Variant(_picked([next(columns) for _ in variant.units], tables), variant.start, variant.bent)
            for variant in cause.variants
        )
    linear = isinstance(cause, TermCause) and SHAPES[cause.name].is_linear
    return Candidate(
        effect=cause.name,
        where=cause.where,
        parameters=placed_parameters(cause.name, cause.where),
        variants=variants,
        contribution=None if linear else _contribution(cause, _acting(variants, sources), sources, context),
        drift=cause.name in DRIFTS,
        least=0.0 if cause.name in ONE_SIDED else None,
    )


def _sliding(cause: SlidingCause, sources: Sequence[Source], context: Context) -> Candidate:
    """What was slid, as it was found; the friction coefficient by the traction that it took."""
    travelling = [source for source in sources if _travels(source)]
    drives = [(context.inputs(source), context.setting(source)) for source in travelling]
    slid = _slid(cause, sources, context)
    held = [adhesion(inputs, cause.wheels, setting) for inputs, setting in drives]
    friction = max(held, default=0.0) / ALONG
    return Candidate(
        effect=cause.name,
        where=cause.where,
        parameters=placed_parameters(cause.name, cause.where),
        variants=(Variant(tuple(_side_by_side([column]) for column in slid), lambda _: np.array([friction])),),
        least=0.0,
        excluded=not slides_alone(cause, drives),
        spread=(friction * ALONG_STD / ALONG,),
    )


def _askew_ones(candidates: Sequence[Candidate], sources: Sequence[Source], context: Context) -> Iterator[Candidate]:
    """The candidates, sliding beside those that stand askew."""
    slid = _slid(ANY_WHEEL, sources, context)
    rolling = [mask for source in sources for mask in [_nothing_slides(source, context)] * len(source.coordinates)]
    for candidate in candidates:
        yield beside_sliding(candidate, slid, rolling) if stands_askew(candidate) else candidate


def _travels(source: Source) -> bool:
    return source.spec.mode not in (None, Mode.ALIGNMENT)


def _slid(cause: SlidingCause, sources: Sequence[Source], context: Context) -> Sequence[Array | None]:
    """What sliding adds to every block, (N,)."""
    acting = [_travels(source) for source in sources]
    return _contribution(cause, acting, sources, context)(np.ones(1), context.parameters)


def _nothing_slides(source: Source, context: Context) -> NDArray[np.bool_] | None:
    """Rows of a kinematic source that no sliding reaches through the filter; None for other sources."""
    if source.channel is not Channel.KINEMATIC or not _travels(source):
        return None
    slides = ANY_WHEEL.sliding(context.inputs(source), context.setting(source)).any(axis=1)
    width = 2 * round(context.processing.guard / source.sample_time) + 1
    return np.asarray(~ndimage.binary_dilation(slides, np.ones(width, dtype=bool))[:: source.factor], dtype=np.bool_)


def _acting(variants: Sequence[Variant], sources: Sequence[Source]) -> list[bool]:
    """Whether any column of a cause acts in any row of each source."""
    acting, end = [], 0
    for source in sources:
        blocks = slice(end, end + len(source.coordinates))
        acting.append(any(column is not None for variant in variants for column in variant.columns[blocks]))
        end = blocks.stop
    return acting


def _picked(columns: list[int], tables: Sequence[Array]) -> tuple[Array | None, ...]:
    """The columns of every block; None where they are all zero, but for rounding."""
    found: list[Array | None] = []
    for table in tables:
        for row in range(table.shape[1]):
            block, scale = table[:, row][:, columns], float(np.abs(table[:, row, :_COLUMNS]).max(initial=0.0))
            found.append(block if np.any(np.abs(block) > ROUNDING * scale) else None)
    return tuple(found)


def _probed(cause: TransformCause, sources: Sequence[Source], context: Context) -> Iterator[Variant]:
    """The effect alone, then with what may come along."""
    exact = _contribution(cause, [True] * len(sources), sources, context)
    changes: list[Sequence[Array | None]] = []
    for place, probe in enumerate(cause.probes):
        sizes = np.zeros(len(cause.probes))
        sizes[place] = probe
        found = exact(sizes, context.parameters)
        changes.append([None if change is None else change / probe for change in found])
        yield Variant(tuple(_side_by_side(columns) for columns in zip(*changes, strict=True)))


def _side_by_side(columns: Sequence[Array | None]) -> Array | None:
    """Columns (N,) as one array, None for zeros; None where all are."""
    there = [column for column in columns if column is not None]
    if not there:
        return None
    return np.stack([np.zeros_like(there[0]) if column is None else column for column in columns], axis=1)


def _contribution(
    cause: Cause, acting: Sequence[bool], sources: Sequence[Source], context: Context
) -> Callable[[Array, Array], Sequence[Array | None]]:
    """What the cause adds to every block, exactly, for numbers of its own and of the model."""

    def contribution(values: Array, parameters: Array) -> list[Array | None]:
        found: list[Array | None] = []
        for source, acts in zip(sources, acting, strict=True):
            if not acts:
                found += [None] * len(source.coordinates)
                continue
            change = _change(cause, source, context, values, parameters)
            if change is None:
                found += [None] * len(source.coordinates)
                continue
            columns = context.filtered(change, source).T
            found += [column if np.any(column) else None for column in columns]
        return found

    return contribution


def _change(cause: Cause, source: Source, context: Context, values: Array, parameters: Array) -> Array | None:
    """The same for one source before the filter (M, rows); None where it is zero."""
    context = replace(context, parameters=parameters)
    inputs, plain = context.inputs(source), context.formulas.exact(source.channel, source.spec)
    if isinstance(cause, TermCause):
        exact = context.formulas.exact(source.channel, source.spec, cause.name, cause.where)
        after = exact(inputs, *context.constants, values)
    else:
        changed = cause.without(inputs, values, context.setting(source))
        seen = [element for argument, element in plain.inputs if argument == 0]
        if np.array_equal(changed[:, seen], inputs[:, seen]):
            return None
        after = plain(changed, *context.constants, np.zeros(0))
    return np.asarray((after - context.plain(source))[..., 0])
