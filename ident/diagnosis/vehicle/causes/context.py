"""What all rows share: geometry, filter, values of the model, equations, and effects that the model has already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import MEMORIES, EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.causes.askew import sliding_aside
from ident.diagnosis.vehicle.causes.bending import BristleCause
from ident.diagnosis.vehicle.causes.library import every_unit
from ident.diagnosis.vehicle.records import rows
from ident.diagnosis.vehicle.records.sliding import SlidingCause, sliding_cause
from ident.diagnosis.vehicle.records.sources import DRY, Source
from ident.diagnosis.vehicle.records.transforms import Setting, TransformCause, transform_cause
from ident.effects import Effect, EffectTerm, at_single_places, effect_term, terms_of
from ident.estimate.filters import Processing, zero_phase
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

Remembering = TransformCause | BristleCause | SlidingCause
"""What takes an effect with a memory out of the signals."""

PRIOR_WEIGHT: Final = 1e-4
"""Of the vehicle file's guesses against the rows, per unit-norm column: only what no row shows is taken from them."""

HELD: Final = 1.0
"""The same of a parameter that stays at the guess."""

FORMULAS_KEPT: Final = 4
"""Sets of given effects whose generated formulas a process keeps."""

AT_ONCE: Final = 16
"""Columns that pass the filter together: it makes several copies of them."""


@dataclass(frozen=True)
class Context:
    """What all rows share.

    Attributes:
        geometry: of the vehicle.
        processing: filters and thresholds.
        parameters: p (11,) at which columns are taken.
        known: the same, by which effects with a memory tell the forces inside the vehicle; a refit does not move them,
            for rows that hardly show a parameter (B_w) let it go anywhere.
        asked: p (11,) by which the rows ask for torques: the model's, or the fit's where the model's may be wrong.
        formulas: the equations, effects that are given in them.
        given: effects with a memory that are part of the model too.
        lag: of the torques, by the model; None: it says nothing of that in these records.
        kept: rows of every source for the parameters asked for last.
    """

    geometry: Geometry
    processing: Processing
    parameters: Array
    known: Array
    asked: Array
    formulas: rows.Formulas
    given: tuple[tuple[Remembering, Array], ...] = ()
    lag: Lag | None = None
    kept: dict[int, tuple[bytes, Array]] = field(default_factory=dict)

    @property
    def constants(self) -> tuple[Array, Array, Array]:
        """What the formulas take beside the inputs."""
        return self.geometry.as_vector(), np.array([DRY]), self.parameters

    def setting(self, source: Source) -> Setting:
        """What effects with a memory need beside the signals of a source."""
        aside = sliding_aside(source.spec.mode, self.geometry)
        return Setting(self.geometry, self.known, source.sample_time, aside)

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
        rows_now = self.rows_of(self.inputs(source), source)
        self.kept[id(source)] = (asked, rows_now)
        return rows_now

    def rows_of(self, inputs: Array, source: Source) -> Array:
        """The rows of a source (M, rows, 1) with other signals (M, INPUTS)."""
        if source.own is not None:
            return source.own.of(inputs)[..., None]
        return np.asarray(self.formulas.exact(source.channel, source.spec)(inputs, *self.constants, np.zeros(0)))

    def filtered(self, values: Array, source: Source) -> Array:
        """Columns (M, ...) through the filter, thinned to the rows of the source's blocks."""
        flat = values.reshape(len(values), -1)
        thinned = [
            zero_phase(part, self.processing.cutoff, source.sample_time)[:: source.factor]
            for part in np.split(flat, range(AT_ONCE, flat.shape[1], AT_ONCE), axis=1)
        ]
        return np.hstack(thinned).reshape(-1, *values.shape[1:])

    def in_rows(self, terms: Array, source: Source, rows: Sequence[int]) -> Array:
        """Terms (M, k) of the equations of a source through the filter, as `filtered`.

        What sticks takes any force, and the filter would spread by how much over the rows beside it: where an equation
        does not hold, all of its terms are zero.

        Args:
            terms: before the filter.
            source: that they belong to.
            rows: (k,) number of the coordinate that each stands in.
        """
        return self.filtered(np.where(source.holds[:, list(rows)], terms, 0.0), source)


def make_context(
    sources: Sequence[Source],
    vehicle: VehicleDescription,
    model: Parameters | None,
    given: Sequence[Effect],
    processing: Processing,
) -> Context:
    """Context of some sources; without a model, parameters are fitted to them."""
    terms = _formulas(tuple(map(_frozen, terms_of([effect for effect in given if effect.name not in MEMORIES]))))
    memories = tuple(_memory(effect) for effect in at_single_places(given) if effect.name in MEMORIES)
    guess = vehicle.prior.values
    context = Context(vehicle.geometry, processing, guess, guess, guess, terms, memories)
    values = model.values if model else fitted_parameters(sources, vehicle, context)
    return replace(context, parameters=values, known=values, asked=values)


def fitted_parameters(sources: Sequence[Source], vehicle: VehicleDescription, context: Context) -> Array:
    """p (11,) by least squares over the dynamic rows; what they do not show stays at the vehicle file's guesses.

    On the floor all wheels roll with vehicle and units, so that rows split B_w from inertias and mass only as far as
    something is wrong with them: a gear that gives way made it 40 % too large. Wheels in the air show it.
    """
    prior = vehicle.prior.values
    weights = np.full(len(prior), PRIOR_WEIGHT)
    if not any(source.spec.mode is None for source in sources):
        weights[PARAMETER_NAMES.index("B_w")] = HELD
    normal, right = np.zeros((2, len(prior), len(prior)))[0], np.zeros(len(prior))
    for source in sources:
        if source.channel is Channel.DYNAMIC:
            table = table_of(source, context, [])
            for row, moving in enumerate(source.moving):
                kept = table[moving[:: source.factor], row]
                theta = kept[:, 1 : rows.MODEL_COLUMNS] * prior
                normal += theta.T @ theta
                right += theta.T @ (-kept[:, 0] - theta.sum(axis=1))
    scale = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    weighted = normal / np.outer(scale, scale) + np.diag(weights)
    return np.asarray(prior * (1 + np.linalg.solve(weighted, right / scale) / scale))


def table_of(source: Source, context: Context, units: Sequence[rows.UnitTerm]) -> Array:
    """Filtered residual at p = 0, regressor and columns of a source: (N, rows, 12 + units)."""
    if source.own is not None:
        plain = context.filtered(context.plain(source), source)
        return np.concatenate([plain, np.zeros((*plain.shape[:2], rows.MODEL_COLUMNS - 1 + len(units)))], axis=2)
    function = context.formulas.linearised(source.channel, source.spec, units)
    entries = function.entries(context.inputs(source), *context.constants, context.asked)
    return function.matrices(context.in_rows(entries.T, source, function.places[0].tolist()).T)


_FrozenTerm = tuple[str, str, tuple[tuple[str, float], ...]]


def _frozen(term: EffectTerm) -> _FrozenTerm:
    return term.name, term.where, tuple(term.values.items())


@lru_cache(maxsize=FORMULAS_KEPT)
def _formulas(given: tuple[_FrozenTerm, ...]) -> rows.Formulas:
    return rows.Formulas([effect_term(name, where, dict(values)) for name, where, values in given], every_unit())


def _memory(effect: Effect) -> tuple[Remembering, Array]:
    """What takes an effect that is no term out of the signals, with its sizes."""
    if effect.name == EffectName.SLIP:
        return sliding_cause(effect.where), np.ones(1)
    if effect.name == EffectName.PRESLIDING:
        return BristleCause(effect.where), np.array([effect["amplitude"], effect["angle"]])
    return transform_cause(EffectName(effect.name), effect.where), np.array([effect.size])
