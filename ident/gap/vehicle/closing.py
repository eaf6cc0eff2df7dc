"""How far the gap shrinks on records that took no part: the model with its effects, in all three channels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import ROWS
from ident.estimate.filters import Processing
from ident.gap.diagnosis import Gap
from ident.gap.findings import Findings
from ident.gap.problem import Channel, Problem
from ident.gap.refit import Refit
from ident.gap.vehicle.context import PRIOR_WEIGHT, make_context
from ident.gap.vehicle.creep import contact_speeds, granted_creep
from ident.gap.vehicle.outcome import outcomes
from ident.gap.vehicle.sources import Source, sources_of
from ident.records.record import Record
from ident.records.repeats import repeats_of
from ident.vehicle.description import VehicleDescription
from ident.vehicle.effects import EffectName, make_effect
from ident.vehicle.extended import ExtendedModel
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


def extended_model(findings: Findings, guesses: Parameters) -> ExtendedModel:
    """The parameters refitted jointly with the effects that were found, and these effects.

    A changed parameter is one of them; the parameters are those of the model that was judged.

    Args:
        findings: of a diagnosis.
        guesses: the vehicle file's, for what the records do not show where no model was given (the four steps do not
            split B_w from inertias and mass, and a gear that gives way needs it).
    """
    refit = findings.after
    effects = []
    for cause in findings.causes:
        names = [entry.name for entry in cause.candidate.parameters]
        values = dict(zip(names, cause.part.values.tolist(), strict=True))
        std = dict(zip(names, cause.part.std.tolist(), strict=True))
        effects.append(make_effect(EffectName(cause.candidate.effect), cause.candidate.where, values, std))
    return ExtendedModel(_guessed_where_unseen(refit, findings.problem, guesses), tuple(effects))


def plain_model(findings: Findings, guesses: Parameters) -> ExtendedModel:
    """The model that is judged: as given, or refitted without any effect, with guesses as in `extended_model`."""
    nominal = findings.problem.nominal
    if nominal is not None:
        return ExtendedModel(_stated(nominal.values, nominal.std))
    return ExtendedModel(_guessed_where_unseen(findings.before, findings.problem, guesses))


def _guessed_where_unseen(refit: Refit, problem: Problem, guesses: Parameters) -> Parameters:
    """The fit, moved towards the guesses along what the rows do not show."""
    if problem.nominal is not None:
        return _stated(refit.baseline, refit.baseline_std)
    size, found = np.where(guesses.std > 0, guesses.std, np.abs(guesses.values)), refit.baseline[: len(PARAMETER_NAMES)]
    rows = np.concatenate([block.baseline[block.moving, : len(size)] for block in problem.blocks]) * size
    scale = np.maximum(np.linalg.norm(rows, axis=0).max(), np.finfo(float).tiny)
    normal = (rows / scale).T @ (rows / scale) + PRIOR_WEIGHT**2 * np.eye(len(size))
    pull = PRIOR_WEIGHT**2 * (guesses.values - found) / size
    return _stated(found + size * np.linalg.solve(normal, pull), refit.baseline_std)


def _stated(values: Array, std: Array) -> Parameters:
    """The parameters of (18) among those of the rows."""
    stated = slice(len(PARAMETER_NAMES))
    return Parameters(values[stated], std[stated])


def channel_gaps(
    records: Sequence[Record],
    vehicle: VehicleDescription,
    before: ExtendedModel,
    after: ExtendedModel,
    *,
    repeated: Sequence[Record] = (),
) -> Mapping[Channel, Gap]:
    """Gap of two models on records, by channel, in units of the noise between repeats of each coordinate.

    Args:
        records: that neither model was fitted to; a lane change counts too.
        vehicle: its geometry.
        before, after: the models.
        repeated: further records of the vehicle, for the noise alone, where those above repeat nothing.

    Raises:
        RecordError: a record has no step that the model describes.
    """
    processing = Processing()

    def left_by(model: ExtendedModel, some: Sequence[Record]) -> list[Series]:
        steps, lengths = tuple(ROWS), vehicle.geometry
        sources = [s for record in some for s in sources_of(record, lengths, steps, processing, as_recorded=True)]
        return list(_series(sources, vehicle, model, processing))

    first, second = left_by(before, records), left_by(after, records)
    floors = _floors([*second, *(left_by(after, repeated) if repeated else ())])
    return {channel: _gap(channel, first, second, floors) for channel in Channel}


def _series(
    sources: Sequence[Source], vehicle: VehicleDescription, model: ExtendedModel, processing: Processing
) -> Iterable[Series]:
    context = make_context(sources, vehicle, model.parameters, model.effects, processing)
    for source in sources:
        residual = context.filtered(context.plain(source)[..., 0], source)
        least = _creep(source, vehicle) if source.channel is Channel.KINEMATIC else 0.0
        for row, name in enumerate(source.coordinates):
            rows = _folded(residual[:, row], source.moving[row][:: source.factor], source.period[:: source.factor])
            yield Series(source.channel, source.step, name, rows, least)
        for outcome in outcomes(source, model, vehicle.geometry):
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


def _gap(
    channel: Channel, before: Sequence[Series], after: Sequence[Series], floors: Mapping[tuple[Channel, str], float]
) -> Gap:
    sums, count = np.zeros(2), 0
    for first, second in zip(before, after, strict=True):
        floor = floors.get((channel, first.coordinate), 0.0)
        if first.channel is channel and floor > 0:
            sums += [float(np.sum((one.folded / floor) ** 2)) for one in (first, second)]
            count += first.folded.size
    if not count:
        return Gap(float("nan"), float("nan"), float("nan"))
    return Gap(float(np.sqrt(sums[0] / count)), float(np.sqrt(sums[1] / count)), floor=1.0)
