"""What follows the time since the start of a campaign: it makes repeats differ, and is no noise.

It is looked for in what differs between repeats, each row by itself: there nothing that repeats can stand in for it.
What is found is taken off the targets before the search begins. Where nothing repeats, time is one more variable of the
motion, and competes with all others in the rows as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.directions import VISIBLE
from ident.diagnosis.findings import Cause
from ident.diagnosis.law.answer import law_answer
from ident.diagnosis.law.dependence import Basis, Dependence, Variable
from ident.diagnosis.law.free import Curve
from ident.diagnosis.law.learning import Designs
from ident.diagnosis.law.stage import SCALE, Law, next_law
from ident.diagnosis.linear import orthonormal
from ident.diagnosis.probability import Calibration, Ranked
from ident.diagnosis.problem import Block, Candidate, Problem
from ident.diagnosis.refit import Part
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import make_rows
from ident.diagnosis.settings import Settings
from ident.effects.laws import COUNT
from ident.records.repeats import repeats_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def repeats(problems: Sequence[Problem]) -> bool:
    """Whether some rows are driven more than once."""
    return any(len(repeats_of(block.period)) > 1 for problem in problems for block in problem.blocks)


def time_law(problems: Sequence[Problem], settings: Settings, seed: int) -> Law | None:
    """The law of time that explains most of what differs between repeats; None where none does surely."""
    numbers = [index for index, one in enumerate(problems[0].dependences) if one.variable is Variable.TIME]
    if not numbers:
        return None
    single = tuple(_deviations(problem, numbers) for problem in problems)
    regression = Regression(single[0], make_rows(*single), settings, seed)
    law = next_law(single, regression, Designs(single, regression.rows), ())
    return None if law is None else _anchored(problems, law, settings, seed)


def _anchored(problems: Sequence[Problem], law: Law, settings: Settings, seed: int) -> Law:
    """A law of time with its constant, of which what differs between repeats says nothing.

    It is the one that the fitted rows ask for beside the parameters, and beside what is known of those. Where a
    parameter absorbs it, as Coulomb friction does of a law times the direction, the law has no mean in these rows. Nor
    has it where they ask for more than the law varies by: that is another cause, which the drift does not tell.

    Args:
        problems: to fit and to confirm, with all that repeats.
        law: from what differs between repeats.
        settings, seed: of the regression.
    """
    bare = [replace(problem, candidates=(), dependences=()) for problem in problems]
    regression = Regression(bare[0], make_rows(*bare), settings, seed)
    parts = [one for problem in problems for one in problem.dependences if one.key == law.dependence.key]
    design = regression.rows.stack([one for part in parts for one in part.design(law.learnt.knots.basis)], COUNT)
    # The functions sum to one, so that all coefficients together move the law by a constant.
    constant = design.sum(axis=1)
    weights, whole = (
        learnt + _constant(regression, constant, design @ learnt, float(np.ptp(learnt)))
        for learnt in (law.learnt.weights, law.learnt.whole)
    )
    learnt = replace(law.learnt, weights=weights, whole=whole)
    return replace(law, learnt=learnt)


def _constant(regression: Regression, column: Array, known: Array, most: float) -> float:
    """How much of a column (n,) fitted rows hold beside what is known (n,); less its mean if none, or above `most`."""
    pair = np.column_stack([column, known])
    white = regression.white(regression.colour_beside(pair, order=0), (), pair)
    fitted = ~white.confirming
    basis = orthonormal(white.baseline[fitted])
    whole, target = white.columns[fitted, 0], (white.target - white.columns[:, 1])[fitted]
    left = whole - basis @ (basis.T @ whole)
    mean = float(whole @ white.columns[fitted, 1]) / max(float(whole @ whole), np.finfo(float).tiny)
    asked = float(left @ target) / float(left @ left) if left @ left > VISIBLE**2 * (whole @ whole) else -mean
    return asked if abs(asked + mean) < most else -mean


def without_drift(problem: Problem, law: Law) -> Problem:
    """A problem with what follows time taken off its targets, and none of it looked for any more."""
    (dependence,) = [one for one in problem.dependences if one.key == law.dependence.key]
    series = [None if one is None else one @ law.learnt.weights for one in dependence.design(law.learnt.knots.basis)]
    blocks = tuple(
        block if drift is None else replace(block, target=block.target - drift, drift=drift)
        for block, drift in zip(problem.blocks, series, strict=True)
    )
    return replace(problem, blocks=blocks, dependences=without_time(problem))


def without_time(problem: Problem) -> tuple[Dependence, ...]:
    """The dependences of a problem on anything but time, which rows that are averaged over repeats do not show."""
    return tuple(one for one in problem.dependences if one.variable is not Variable.TIME)


def _deviations(problem: Problem, numbers: Sequence[int]) -> Problem:
    """What differs between repeats, a row of its own for every sample, with nothing but some dependences."""
    samples = [repeats_of(block.period) for block in problem.blocks]
    blocks = tuple(
        replace(
            block,
            target=_from_mean(block.target, chosen),
            baseline=_from_mean(block.baseline, chosen),
            moving=_moving(block, chosen),
            period=np.full_like(block.period, -1),
        )
        for block, chosen in zip(problem.blocks, samples, strict=True)
    )
    dependences = tuple(_from_means(problem.dependences[number], samples) for number in numbers)
    return replace(problem, blocks=blocks, candidates=(), dependences=dependences)


def _from_means(dependence: Dependence, samples: Sequence[Indices]) -> Dependence:
    def design(basis: Basis) -> Sequence[Array | None]:
        columns = dependence.design(basis)
        return [None if one is None else _from_mean(one, each) for one, each in zip(columns, samples, strict=True)]

    return replace(dependence, design=design)


def _from_mean(series: Array, samples: Indices) -> Array:
    """A series (N, ...) less its mean over the repeats whose samples (P, m) are given; as it is where P is 1."""
    if len(samples) < 2:
        return series
    found = np.zeros_like(series)
    found[samples] = series[samples] - series[samples].mean(axis=0)
    return found


def _moving(block: Block, samples: Indices) -> NDArray[np.bool_]:
    """Rows of a block that are used in every repeat."""
    if len(samples) < 2:
        return block.moving
    found = np.zeros_like(block.moving)
    found[samples] = block.moving[samples].all(axis=0)
    return found


def drift_cause(law: Law, closed: float, calibration: Calibration) -> Cause:
    """The cause that a law of time is.

    Args:
        law: as it was learnt.
        closed: share of the held-out gap.
        calibration: of probabilities.
    """
    dependence, learnt = law.dependence, law.learnt
    candidate = Candidate(dependence.effect, dependence.where, (SCALE,), ())
    one, none = np.ones(1), np.zeros(1)
    return Cause(
        candidate=candidate,
        part=Part(candidate.key, one, none, one, none, ()),
        ranked=Ranked({}, {}, (candidate.key,)),
        probability=min(law.probability(calibration.temperature), calibration.ceiling),
        log_evidence=learnt.log_evidence,
        log_predictive=learnt.log_predictive,
        closed=closed,
        needed=closed,
        biased={},
        curve=Curve.ITS_OWN,
        sizeless=False,
        law=law,
        law_answer=law_answer(law, "dynamic", None),
    )
