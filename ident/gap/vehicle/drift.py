"""Changed values of a given model: the first cause to think of, told apart from missing structure by a refit.

Structure is looked for with all parameters free, so that no changed value can pass for it. What the free parameters
then differ from the model's by is explained by as few changed ones as will do: without any, all must stay within the
standard deviations that the model states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.gap.diagnosis import Verdict
from ident.gap.judge import Cause, Findings, ordered
from ident.gap.probability import Ranked, calibration
from ident.gap.problem import Candidate, Nominal, Problem
from ident.gap.refit import Part, Refit
from ident.gap.remainder import held_out_gap, noise_floors, repeated, shares
from ident.gap.rows import Rows, make_rows
from ident.gap.vehicle.library import placed_parameters
from ident.gap.whitening import row_ages
from ident.vehicle.effects import EffectName
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

LEAST_STD: Final = 1e-3
"""Standard deviation that a model's value has at least, relative to the value: nobody knows friction better."""

LEAST_EVIDENCE: Final = 4.0
"""Log evidence, the price of its numbers paid, that a changed value needs."""

MOST: Final = 3
"""Changed values named at most."""

_MASS: Final = PARAMETER_NAMES.index("m_ch")
_INERTIA: Final = PARAMETER_NAMES.index("C_ch")


@dataclass(frozen=True)
class _Evidence:
    """Normal equations of some rows around the model's values, in units of the noise.

    Attributes:
        matrix: information (11, 11).
        vector: score (11,) at the model's values.
        count: independent rows.
    """

    matrix: Array
    vector: Array
    count: float

    def solved(self, free: Sequence[int], std: Array) -> tuple[Array, Array]:
        """Changes (11,) and their covariance, those in `free` without prior, the others within `std`."""
        prior = 1 / std**2
        prior[list(free)] = 0.0
        inverse: Array = np.asarray(
            np.linalg.pinv(self.matrix + np.diag(prior), rcond=1e-12, hermitian=True), dtype=float
        )
        return inverse @ self.vector, inverse

    def gain(self, free: Sequence[int], std: Array) -> float:
        """Half of what the changes take off the sum of squares."""
        return 0.5 * float(self.vector @ self.solved(free, std)[0])

    def loss(self, change: Array) -> float:
        """Half of what given changes leave of the sum of squares, up to a constant."""
        return 0.5 * float(change @ self.matrix @ change) - float(self.vector @ change)


@dataclass(frozen=True)
class _Change:
    """A cause by the parameters that it changes."""

    name: EffectName
    where: str
    free: tuple[int, ...]

    @property
    def key(self) -> str:
        return f"{self.name}@{self.where}"


_CHANGES: Final = (
    *(_Change(EffectName.PARAMETER_CHANGE, name, (index,)) for index, name in enumerate(PARAMETER_NAMES)),
    _Change(EffectName.PAYLOAD, "chassis", (_MASS, _INERTIA)),
)


def with_drift(findings: Findings, fit: Problem, confirm: Problem, nominal: Nominal) -> Findings:
    """Findings of a search with free parameters, completed by the changed values of the model that was given."""
    rows = make_rows(fit, confirm)
    structure = _structure(findings, rows)
    std = np.maximum(nominal.std, LEAST_STD * np.abs(nominal.values))
    fitted, confirming = (_evidence(rows, structure, nominal.values, rows.confirming == part) for part in (False, True))
    floors = noise_floors(rows, findings.after.blocks, rows.target - rows.stack(list(findings.after.blocks)))
    judged = [block.baseline @ nominal.values for block, _ in rows.blocks]
    free = nominal.values + fitted.solved(range(len(PARAMETER_NAMES)), std)[0]
    refitted = [block.baseline @ free + extra for (block, _), extra in zip(rows.blocks, structure, strict=True)]
    gap = held_out_gap(rows, floors, judged, refitted)
    causes = _causes(fitted, confirming, nominal.values, std, gap.closed)
    verdict = Verdict.EFFECT if causes and findings.verdict is Verdict.NONE else findings.verdict
    invisible = tuple(name for name in findings.invisible if name not in (EffectName.PAYLOAD,))
    together = ordered((*findings.causes, *causes))
    return replace(
        findings,
        verdict=verdict,
        causes=together,
        gap=gap,
        where=shares(rows, floors, judged),
        invisible=invisible,
        before=Refit(nominal.values, nominal.std, (), tuple(judged)),
        repeated_before=repeated(rows, floors, judged),
    )


def _structure(findings: Findings, rows: Rows) -> list[Array]:
    """What the effects found add to every block."""
    baseline = findings.after.baseline
    models = zip(rows.blocks, findings.after.blocks, strict=True)
    return [model - block.baseline @ baseline for (block, _), model in models]


def _evidence(rows: Rows, structure: Sequence[Array], values: Array, chosen: NDArray[np.bool_]) -> _Evidence:
    target = rows.target - rows.stack(list(structure)) - rows.baseline @ values
    matrix, vector, count = np.zeros((len(values), len(values))), np.zeros(len(values)), 0.0
    for group in np.unique(rows.group[chosen]):
        place = np.flatnonzero(chosen & (rows.group == group))
        theta, left = rows.baseline[place], target[place]
        if not np.any(theta):
            continue
        scale = np.maximum(np.linalg.norm(theta, axis=0), np.finfo(float).tiny)
        residual = left - (theta / scale) @ np.linalg.lstsq(theta / scale, left, rcond=1e-6)[0]
        variance = float(np.mean(residual**2)) * _memory(residual, row_ages(rows)[place])
        matrix += theta.T @ theta / variance
        vector += theta.T @ left / variance
        count += len(place)
    return _Evidence(matrix, vector, count)


def _memory(residual: Array, age: NDArray[np.int64]) -> float:
    """How many rows of a first-order process count as one."""
    later = np.flatnonzero(age > 0)
    power = max(float(residual @ residual), np.finfo(float).tiny)
    correlation = float(residual[later] @ residual[later - 1]) / power
    correlation = min(max(correlation, 0.0), 0.97)
    return (1 + correlation) / (1 - correlation)


def _causes(fitted: _Evidence, confirming: _Evidence, values: Array, std: Array, closed: float) -> list[Cause]:
    """Changed values, one after the other, each confirmed."""
    taken: tuple[int, ...] = ()
    causes: list[Cause] = []
    while len(causes) < MOST:
        open_changes = [change for change in _CHANGES if not set(change.free) & set(taken)]
        evidence = {change: _log_evidence(fitted, change, taken, std) for change in open_changes}
        best = max(evidence, key=lambda change: evidence[change])
        free = (*taken, *best.free)
        before, after = fitted.solved(taken, std)[0], fitted.solved(free, std)[0]
        confirmed = confirming.loss(before) - confirming.loss(after)
        if evidence[best] < LEAST_EVIDENCE or confirmed < LEAST_EVIDENCE / 2:
            break
        causes.append(_cause(best, evidence, confirmed, _sum(fitted, confirming).solved(free, std), values, closed))
        taken = free
    return causes


def _sum(first: _Evidence, second: _Evidence) -> _Evidence:
    return _Evidence(first.matrix + second.matrix, first.vector + second.vector, first.count + second.count)


def _log_evidence(fitted: _Evidence, change: _Change, taken: tuple[int, ...], std: Array) -> float:
    after, _ = fitted.solved((*taken, *change.free), std)
    if change.name is EffectName.PAYLOAD and (after[_MASS] <= 0 or after[_INERTIA] < 0):
        return -np.inf
    gain = fitted.gain((*taken, *change.free), std) - fitted.gain(taken, std)
    return gain - 0.5 * len(change.free) * float(np.log(fitted.count))


def _cause(
    change: _Change,
    evidence: dict[_Change, float],
    confirmed: float,
    solved: tuple[Array, Array],
    values: Array,
    closed: float,
) -> Cause:
    shift, covariance = solved
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = values[change.free[0]] if change.name is EffectName.PARAMETER_CHANGE else 1.0
    index = list(change.free)
    alike = [change.key]
    if change.free == (_MASS,) and shift[_MASS] > 0:
        alike.append("payload@chassis")
    ranked = _ranked(evidence, alike)
    return Cause(
        candidate=Candidate(change.name, change.where, placed_parameters(change.name, change.where), (), drift=True),
        part=Part(change.key, shift[index] / unit, deviations[index] / abs(unit)),
        ranked=ranked,
        probability=min(ranked.probability, calibration().ceiling),
        log_evidence=evidence[change],
        log_predictive=confirmed,
        closed=closed,
        biased={},
    )


def _ranked(evidence: dict[_Change, float], alike: Sequence[str]) -> Ranked:
    """Probabilities by evidence, against no change at all; what is alike shares what it has."""
    found = {change.key: value for change, value in evidence.items()}
    found |= {key: found[alike[0]] for key in alike}
    scores = np.array([*found.values(), 0.0])
    weights = np.exp(scores - scores.max())
    parts = weights[:-1] / weights.sum()
    probabilities = dict(sorted(zip(found, parts.tolist(), strict=True), key=lambda entry: -entry[1]))
    names: dict[str, float] = {}
    for key, probability in probabilities.items():
        name = key.partition("@")[0]
        names[name] = names.get(name, 0.0) + probability
    return Ranked(probabilities, dict(sorted(names.items(), key=lambda entry: -entry[1])), tuple(alike))
