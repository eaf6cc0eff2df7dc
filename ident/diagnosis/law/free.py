"""Whether a name fits the curve of its variable as well as a free function does.

A name says a family of functions: drag, Stribeck friction, a pair of frictions. A curve of another family is fitted by
the nearest of them, surely, and nearly; what tells is a free function of the same variable in its place, in the same
rows, beside the same other causes and with noise of the same colour. Both evidences are then of one kind: the family
pays for its numbers, the function for its freedom.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence

from ident.diagnosis.evidence import Evidence
from ident.diagnosis.functions import function_of
from ident.diagnosis.law.learning import Designs, Learner, Learnt
from ident.diagnosis.law.stage import SAME, SURELY, cosine
from ident.diagnosis.problem import Candidate, Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.search import Found, without


class Curve(enum.Enum):
    """What the records say of the curve that a name has.

    Attributes:
        ITS_OWN: it is of the name's family, or nearly the same in these rows; or the name is no function of a variable.
        UNDECIDED: neither the family nor a free function that is not nearly the same is surely better.
        ANOTHER: such a free function is surely better.
    """

    ITS_OWN = enum.auto()
    UNDECIDED = enum.auto()
    ANOTHER = enum.auto()


def curves(problems: Sequence[Problem], regression: Regression, found: Found) -> tuple[Curve, ...]:
    """What the records say of the curve of every name that was found."""
    designs = Designs(problems, regression.rows)
    return tuple(_curve(problems[0], regression, designs, found, index) for index in range(len(found.variants)))


def _curve(problem: Problem, regression: Regression, designs: Designs, found: Found, index: int) -> Curve:
    variant, others = found.variants[index], without(found.variants, index)
    dependences = _dependences(problem, problem.candidates[regression.owners[variant]])
    free = _best(Learner(regression, found.whitener, others), designs, dependences) if dependences else None
    return Curve.ITS_OWN if free is None else _beside(free, found.slots[index].evidence, variant)


def _dependences(problem: Problem, candidate: Candidate) -> list[int]:
    """Numbers of the dependences of which a named candidate is a function; none where it is no function of one."""
    function = function_of(candidate.effect)
    return [
        index
        for index, one in enumerate(problem.dependences)
        if function == (one.variable, one.partner) and one.where == candidate.where
    ]


def _best(learner: Learner, designs: Designs, dependences: Sequence[int]) -> Learnt | None:
    """The free function that explains most in the place of a name; None where there is none."""
    knots = {index: designs.knots(index) for index in dependences}
    learnt = [learner.learn(index, designs.columns(index), one) for index, one in knots.items() if one is not None]
    return max((one for one in learnt if one is not None), key=lambda one: one.total(0.0), default=None)


def _beside(free: Learnt, evidence: Evidence, variant: int) -> Curve:
    """What a free function says of the family of the name in whose place it stands."""
    odds = free.total(0.0) - float(evidence.log_evidence[variant])
    if odds < -SURELY or cosine(free.shape, evidence.explained(variant)) > SAME:
        return Curve.ITS_OWN
    return Curve.UNDECIDED if odds <= SURELY else Curve.ANOTHER
