"""Causes as candidates: columns of every block, and bounds of their numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import LATE, EffectName
from ident.diagnosis.observations.delays import HELD, RARER
from ident.diagnosis.observations.linear import ROUNDING
from ident.diagnosis.problem import Candidate, Variant
from ident.diagnosis.vehicle.causes.askew import MODES, Travelling, sliding_aside, with_drag, with_shares
from ident.diagnosis.vehicle.causes.bending import BristleCause
from ident.diagnosis.vehicle.causes.bristles import bristle_candidate, bristle_causes
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.causes.contribution import Cause, acting_in, contribution_of, side_by_side
from ident.diagnosis.vehicle.causes.library import (
    DRIFTS,
    ONE_SIDED,
    SHAPES,
    TermCause,
    placed_parameters,
    ripple_over,
    term_causes,
)
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.rows import MODEL_COLUMNS
from ident.diagnosis.vehicle.records.sliding import (
    ALONG,
    ALONG_STD,
    ANY_WHEEL,
    SlidingCause,
    adhesion,
    slides_alone,
    sliding_cause,
    sliding_causes,
    sliding_times,
)
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import TransformCause, transform_causes
from ident.plant.places import DRIVES, STEERING, WHEEL_PLACES, indices
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]


OFFSET_STD: Final = 2.2e-5
"""Of an offset of the steering, beyond the scatter of the rows [rad].

What a contact gives way by beside its creep in proportion (`LEFT_OVER`: 40 to 100 μm/m) passes for an offset. On 38
cases of exams for tuning, offsets of 54 to 311 μrad alike were wrong by 25 μrad rms where the rows scattered by 12.
"""

COMPLIANCE_STD: Final = 1.5e-6
"""Of the compliance of a gear, beyond the scatter of the rows [rad/Nm].

Damping of the gear and give of the contact are not in the columns. On 26 cases of exams for tuning, compliances of
69 to 344 μrad/Nm alike were too small, by 0.7 to 1.9 μrad/Nm.
"""

PLAY_STD: Final = 2e-5
"""Of the play of a gear, beyond the scatter of the rows [rad].

The range of a motor at rest holds what pushes the chassis and some noise. On 15 records for tuning, plays of 0.4 to
5 mrad, ranges were wrong by up to 0.02 mrad and a thirtieth.
"""

PLAY_PART: Final = 1 / 30
"""The same as part of it."""

COUPLING_PLAY_STD: Final = 1e-5
"""Of the play of a steering coupling, beyond the scatter of the rows [rad]: encoders add to a range, on cases of exams
for tuning 7 to 20 μrad to plays of 90."""

LOAD_STD: Final[Mapping[str, float]] = MappingProxyType(dict.fromkeys(DRIVES, 0.5) | dict.fromkeys(STEERING, 4.0))
"""Of the load of a gear and of a coupling, beyond the scatter of the rows [Nm]: what yields to it passes for a play.

Three percent of a gear's, which may stay untold (`rattling.UNTOLD`); half of what dry friction takes of a coupling's.
On cases of an exam gears of 172 μrad/Nm seemed to have plays of 58 and 80 μrad, couplings of 20 μrad/Nm of 40 and 57.
"""

SPREADS: Final[Mapping[tuple[EffectName, str], float]] = MappingProxyType(
    dict.fromkeys([(EffectName.STEERING_OFFSET, place) for place in STEERING], OFFSET_STD)
    | dict.fromkeys([(EffectName.ELASTICITY, place) for place in DRIVES], COMPLIANCE_STD)
    | dict.fromkeys([(EffectName.BACKLASH, place) for place in DRIVES], PLAY_STD)
    | dict.fromkeys([(EffectName.BACKLASH, place) for place in STEERING], COUPLING_PLAY_STD)
)
"""Standard deviations of sizes beyond the scatter of the rows, by effect and place, in their units."""


def causes_of(effects: tuple[EffectName, ...], judged: bool) -> tuple[Cause, ...]:
    """Causes with these names, changed values only where a model is judged."""
    names = tuple(name for name in effects if judged or name not in DRIFTS)
    sliding = sliding_causes() if EffectName.SLIP in names else []
    bending = bristle_causes() if EffectName.PRESLIDING in names else []
    return (*term_causes(names), *transform_causes(names), *bending, *sliding)


def candidate_of(
    cause: Cause, columns: Iterator[int], sources: Sequence[Source], tables: Sequence[Array], context: Context
) -> Candidate:
    """A cause as a candidate; `columns` are the numbers of those in the tables that come next."""
    if isinstance(cause, SlidingCause):
        return _sliding(cause, sources, context)
    if isinstance(cause, BristleCause):
        return bristle_candidate(cause, sources, context)
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
        contribution=None if linear else contribution_of(cause, acting_in(variants, sources), sources, context),
        drift=cause.name in DRIFTS,
        least=0.0 if cause.name in ONE_SIDED else None,
        negligible=_by_sampling(cause, sources, context),
        spread=(SPREADS[cause.name, cause.where],) if (cause.name, cause.where) in SPREADS else (),
        part=PLAY_PART if cause.name == EffectName.BACKLASH and cause.where in DRIVES else 0.0,
        yielding=LOAD_STD[cause.where] if cause.name == EffectName.BACKLASH else 0.0,
        periodic=ripple_over(cause.where, context.geometry) if cause.name == EffectName.TORQUE_RIPPLE else None,
        price=RARER if cause.name == EffectName.TORQUE_FILTER else 0.0,
    )


def _by_sampling(cause: Cause, sources: Sequence[Source], context: Context) -> tuple[float, float]:
    """Sizes of a delay or a filter [s], as a lead and as itself, up to which sampling may be what it is.

    How late it makes all drives the model may say.
    """
    if cause.name not in LATE:
        return 0.0, 0.0
    held = HELD * max((source.interval for source in sources), default=0.0)
    return held, held if cause.where == "drives" and context.lag is None else 0.0


def slid_by_any(sources: Sequence[Source], context: Context) -> Sequence[Array | None]:
    """What all sliding that was found adds to every block, (N,)."""
    return _slid(ANY_WHEEL, sources, context)


def seen_together(
    candidates: Sequence[Candidate], sources: Sequence[Source], tables: Sequence[Array], context: Context
) -> Iterator[Candidate]:
    """The candidates: offsets of the steering with shares, couplings with drag, slip of wheels that slide alone."""
    driving = [source for source in sources if source.rolls and not source.rattles.any()]
    inputs, settings = [context.inputs(one) for one in driving], [context.setting(one) for one in driving]
    times = np.sum([np.zeros(len(WHEEL_PLACES)), *map(sliding_times, inputs, settings)], axis=0)
    blocks = list(_travelling(sources, tables, context.geometry))
    dragging = context.known[PARAMETER_NAMES.index("m_ch")] * GRAVITY / 4 * context.geometry.wheel_radius
    for candidate in candidates:
        if candidate.effect == EffectName.SLIP:
            yield replace(candidate, excluded=not slides_alone(sliding_cause(candidate.where), times))
        elif candidate.effect == EffectName.STEERING_OFFSET:
            # Two of the four wheels slide by the whole angle, or all by half of it.
            yield with_shares(candidate, blocks, dragging / 2)
        elif candidate.effect == EffectName.ELASTICITY and indices(candidate.where, STEERING):
            yield with_drag(candidate, dragging)
        else:
            yield candidate


def _travelling(sources: Sequence[Source], tables: Sequence[Array], geometry: Geometry) -> Iterator[Travelling | None]:
    """What every block is of drives in which wheels roll."""
    friction = 1 + PARAMETER_NAMES.index("d_cw")
    for source, table in zip(sources, tables, strict=True):
        mode = source.spec.mode
        if mode not in MODES or source.own is not None:
            yield from [None] * len(source.coordinates)
            continue
        part = sliding_aside(mode, geometry)
        rate = part * np.abs(source.inputs[:: source.factor, SLICES["beta_rate"]]).mean(axis=1)
        for row in range(len(source.coordinates)):
            yield Travelling(MODES.index(mode), None if source.rolls else part * table[:, row, friction], rate)


def _sliding(cause: SlidingCause, sources: Sequence[Source], context: Context) -> Candidate:
    """What was slid, as it was found; the friction coefficient by the traction that it took."""
    travelling = [source for source in sources if source.travels and not source.rattles.any()]
    slid = _slid(cause, sources, context)
    held = [adhesion(context.inputs(source), cause.wheels, context.setting(source)) for source in travelling]
    friction = max(held, default=0.0) / ALONG
    return Candidate(
        effect=cause.name,
        where=cause.where,
        parameters=placed_parameters(cause.name, cause.where),
        variants=(Variant(tuple(side_by_side([column]) for column in slid), lambda _: np.array([friction])),),
        least=0.0,
        as_found=True,
        spread=(friction * ALONG_STD / ALONG,),
    )


def _slid(cause: SlidingCause, sources: Sequence[Source], context: Context) -> Sequence[Array | None]:
    """What sliding adds to every block, (N,); drives that rattle aside, for there the play is why wheels slide."""
    acting = [source.travels and not source.rattles.any() for source in sources]
    return contribution_of(cause, acting, sources, context)(np.ones(1), context.parameters)


def _picked(columns: list[int], tables: Sequence[Array]) -> tuple[Array | None, ...]:
    """The columns of every block; None where they are all zero, but for rounding."""
    found: list[Array | None] = []
    for table in tables:
        for row in range(table.shape[1]):
            block, scale = table[:, row][:, columns], float(np.abs(table[:, row, :MODEL_COLUMNS]).max(initial=0.0))
            found.append(block if np.any(np.abs(block) > ROUNDING * scale) else None)
    return tuple(found)


def _probed(cause: TransformCause, sources: Sequence[Source], context: Context) -> Iterator[Variant]:
    """The effect alone, then with what may come along."""
    exact = contribution_of(cause, [True] * len(sources), sources, context)
    changes: list[Sequence[Array | None]] = []
    for place, probe in enumerate(cause.probes):
        sizes = np.zeros(len(cause.probes))
        sizes[place] = probe
        found = exact(sizes, context.parameters)
        changes.append([None if change is None else change / probe for change in found])
        yield Variant(tuple(side_by_side(columns) for columns in zip(*changes, strict=True)), beside=place)
