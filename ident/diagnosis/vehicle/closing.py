"""How far the gap shrinks on records that took no part: the model with its effects, in all three channels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.check.refit import Refit
from ident.diagnosis.diagnosis import Gap
from ident.diagnosis.law.answer import law_effect
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel, Problem
from ident.diagnosis.vehicle.causes.context import PRIOR_WEIGHT, make_context
from ident.diagnosis.vehicle.causes.creep import contact_speeds, granted_creep
from ident.diagnosis.vehicle.outcome import outcomes
from ident.diagnosis.vehicle.records.sources import Source, sources_of
from ident.effects import Effect, make_effect
from ident.effects.combining import combined
from ident.effects.extended import ExtendedModel
from ident.estimate.equations import ROWS
from ident.estimate.filters import Processing
from ident.estimate.uncertainty import correlation_of
from ident.records.record import Record
from ident.records.repeats import repeats_of
from ident.vehicle.description import VehicleDescription
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

_STEERING_ROWS: Final = ("alpha_l", "alpha_r")


@dataclass(frozen=True)
class Series:
    """What a model leaves of one coordinate of one segment.

    Attributes:
        channel, step, coordinate: which.
        folded: (P, N) by repeats of the excitation; P = 1 where nothing repeats.
        least: floor that noise does not go below.
    """

    channel: Channel
    step: str
    coordinate: str
    folded: Array
    least: float = 0.0


def extended_model(
    findings: Findings,
    guesses: Parameters,
    *,
    given: Sequence[Effect] = (),
    lag: Lag | None = None,
    held_out: bool = False,
) -> ExtendedModel:
    """The parameters refitted jointly with the effects that were found, and these effects.

    A changed parameter is one of them; the parameters are those of the model that was judged.

    Args:
        findings: of a diagnosis.
        guesses: the vehicle file's, for what the records do not show where no model was given (the four steps do not
            split B_w from inertias and mass, and a gear that gives way needs it).
        given: effects that the model that was judged has already; more of one of them is added to it.
        lag: of the torques, by that model.
        held_out: whether the confirming rows take no part.
    """
    refit = findings.held_out.extended if held_out else findings.after
    causes = {cause.candidate.key: cause for cause in findings.causes}
    effects = []
    for part in refit.parts:
        cause = causes[part.key]
        candidate = cause.candidate
        if cause.law is not None:
            law = law_effect(cause.law, float(part.values[0]), float(part.std[0]))
            effects += [] if law is None else [law]
            continue
        names = [entry.name for entry in candidate.parameters]
        values, std = (dict(zip(names, numbers.tolist(), strict=True)) for numbers in (part.values, part.std))
        effects.append(make_effect(EffectName(candidate.effect), candidate.where, values, std))
    fitted = {part.key for part in refit.parts}
    drifts = [cause.law for cause in findings.causes if cause.law is not None and cause.candidate.key not in fitted]
    effects += [law for drift in drifts if (law := law_effect(drift, 1.0, 0.0)) is not None]
    return ExtendedModel(_guessed_where_unseen(refit, findings.problem, guesses), combined(given, effects), lag)


def plain_model(
    findings: Findings, guesses: Parameters, *, given: Sequence[Effect] = (), held_out: bool = False
) -> ExtendedModel:
    """The model that is judged: as given, or refitted without any effect; all else as in `extended_model`."""
    nominal = findings.problem.nominal
    if nominal is not None:
        return ExtendedModel(_stated(nominal.values, nominal.std, nominal.correlation), tuple(given))
    refit = findings.held_out.plain if held_out else findings.before
    return ExtendedModel(_guessed_where_unseen(refit, findings.problem, guesses), tuple(given))


def _guessed_where_unseen(refit: Refit, problem: Problem, guesses: Parameters) -> Parameters:
    """The fit, moved towards the guesses along what the rows do not show."""
    if problem.nominal is not None:
        return _stated(refit.baseline, refit.baseline_std, correlation_of(refit.covariance))
    size, found = np.where(guesses.std > 0, guesses.std, np.abs(guesses.values)), refit.baseline[: len(PARAMETER_NAMES)]
    rows = np.concatenate([block.baseline[block.moving, : len(size)] for block in problem.blocks]) * size
    scale = np.maximum(np.linalg.norm(rows, axis=0).max(), np.finfo(float).tiny)
    normal = (rows / scale).T @ (rows / scale) + PRIOR_WEIGHT**2 * np.eye(len(size))
    pull = PRIOR_WEIGHT**2 * (guesses.values - found) / size
    return _stated(found + size * np.linalg.solve(normal, pull), refit.baseline_std, correlation_of(refit.covariance))


def _stated(values: Array, std: Array, correlation: Array | None) -> Parameters:
    """The parameters of (18) among those of the rows."""
    stated = slice(len(PARAMETER_NAMES))
    return Parameters(values[stated], std[stated], None if correlation is None else correlation[stated, stated])


@dataclass(frozen=True)
class Comparison:
    """What two models leave of the same segments.

    Attributes:
        before, after: one a coordinate and segment, in the same order.
        floors: rms of the noise by channel and coordinate.
    """

    before: Sequence[Series]
    after: Sequence[Series]
    floors: Mapping[tuple[Channel, str], float]

    def gaps(self, chosen: Callable[[str], bool] = lambda _: True) -> Mapping[Channel, Gap]:
        """Gap by channel of the steps whose names are chosen; NaN where nothing has a floor."""
        pairs = [pair for pair in zip(self.before, self.after, strict=True) if chosen(pair[0].step)]
        return {channel: _gap(channel, pairs, self.floors) for channel in Channel}


def channel_gaps(
    records: Sequence[Record],
    vehicle: VehicleDescription,
    before: ExtendedModel,
    after: ExtendedModel,
    *,
    repeated: Sequence[Record] = (),
) -> Mapping[Channel, Gap]:
    """Gap of two models on records, by channel: that of all steps of `compared`."""
    return compared(records, vehicle, before, after, repeated=repeated).gaps()


def compared(
    records: Sequence[Record],
    vehicle: VehicleDescription,
    before: ExtendedModel,
    after: ExtendedModel,
    *,
    part: Callable[[Source], Source] | None = None,
    repeated: Sequence[Record] = (),
) -> Comparison:
    """Two models on records, in units of the noise between repeats of each coordinate.

    Args:
        records: that neither model was fitted to; a lane change counts too.
        vehicle: its geometry.
        before, after: the models.
        part: rows of a source that are compared; None: all.
        repeated: further records of the vehicle, for the noise alone, where some coordinate above does not repeat.

    Raises:
        RecordError: a record has no step that the model describes.
    """
    processing = Processing()

    def rows_of(some: Sequence[Record]) -> list[Source]:
        steps, lengths = tuple(ROWS), vehicle.geometry
        return [s for record in some for s in sources_of(record, lengths, steps, processing, as_recorded=True)]

    def left_by(model: ExtendedModel, sources: Sequence[Source]) -> list[Series]:
        return list(_series(sources, vehicle, model, processing)) if sources else []

    sources = rows_of(records) if part is None else [part(source) for source in rows_of(records)]
    sources = [source for source in sources if any(moving.any() for moving in source.moving)]
    first = left_by(before, sources)
    second = first if after is before else left_by(after, sources)
    floors = _floors(second)
    # Simulating takes long: other records are asked for the noise only where these do not show it.
    if any((one.channel, one.coordinate) not in floors and one.folded.size for one in second):
        repeating = [record for record in repeated if any(len(segment.periods) > 1 for segment in record.segments)]
        floors = _floors([*second, *left_by(after, rows_of(repeating))])
    return Comparison(first, second, floors)


def _series(
    sources: Sequence[Source], vehicle: VehicleDescription, model: ExtendedModel, processing: Processing
) -> Iterable[Series]:
    context = make_context(sources, vehicle, model.parameters, model.effects, processing)
    for source in sources:
        residual = context.in_rows(context.plain(source)[..., 0], source, range(len(source.coordinates)))
        least = _creep(source, vehicle) if source.channel is Channel.KINEMATIC else 0.0
        for row, name in enumerate(source.coordinates):
            rows = _folded(residual[:, row], source.moving[row][:: source.factor], source.period[:: source.factor])
            yield Series(source.channel, source.step, name, rows, least)
    for outcome in outcomes(sources, model, vehicle.geometry):
        rows = _folded_runs(outcome.differences, outcome.repeat, outcome.place)
        yield Series(Channel.OUTCOME, outcome.step, outcome.coordinate, rows)


def _creep(source: Source, vehicle: VehicleDescription) -> float:
    """No model says how much the wheels creep, so that much is noise [m/s]."""
    return granted_creep(source.spec.mode, contact_speeds(source, vehicle.geometry))


def _folded(values: Array, moving: NDArray[np.bool_], period: NDArray[np.int64]) -> Array:
    """Moving rows (P, N), those that move in every repeat."""
    samples = repeats_of(period)
    return values[samples[:, moving[samples].all(axis=0)]]


def _folded_runs(differences: Array, repeat: NDArray[np.int64], place: NDArray[np.int64]) -> Array:
    numbers = [number for number in np.unique(repeat) if number >= 0]
    if len(numbers) < 2:
        return differences.reshape(1, -1)
    shared = set.intersection(*(set(place[repeat == number].tolist()) for number in numbers))
    return np.stack([differences[(repeat == number) & np.isin(place, list(shared))].ravel() for number in numbers])


def _floors(series: Sequence[Series]) -> Mapping[tuple[Channel, str], float]:
    """Rms of the noise by channel and coordinate, pooled over segments with repeats."""
    pooled: dict[tuple[Channel, str], list[tuple[float, float]]] = {}
    for one in series:
        if len(one.folded) > 1 and one.folded.size:
            entry = (float(one.folded.var(axis=0, ddof=1).mean()), one.least)
            pooled.setdefault((one.channel, one.coordinate), []).append(entry)
    floors = {
        key: max(float(np.sqrt(np.mean([variance for variance, _ in entries]))), max(least for _, least in entries))
        for key, entries in pooled.items()
    }
    for channel in Channel:
        sides = [floors[channel, name] for name in _STEERING_ROWS if (channel, name) in floors]
        if sides:
            floors.setdefault((channel, "alpha_v"), float(np.hypot.reduce(sides)))
    return floors


def _gap(channel: Channel, pairs: Sequence[tuple[Series, Series]], floors: Mapping[tuple[Channel, str], float]) -> Gap:
    sums, count = np.zeros(2), 0
    for first, second in pairs:
        floor = max(floors.get((channel, first.coordinate), 0.0), first.least)
        if first.channel is channel and floor > 0:
            sums += [float(np.sum((one.folded / floor) ** 2)) for one in (first, second)]
            count += first.folded.size
    if not count:
        return Gap(float("nan"), float("nan"), float("nan"))
    return Gap(float(np.sqrt(sums[0] / count)), float(np.sqrt(sums[1] / count)), floor=1.0)
