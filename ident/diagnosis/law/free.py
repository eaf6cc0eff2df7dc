"""Whether a name fits the curve of its variable as well as a free function does.

A name says a family of functions: drag, Stribeck friction, a pair of frictions. A curve of another family is fitted by
the nearest of them, surely, and nearly; what tells is a free function of the same variable in its place, in the same
rows, beside the same other causes and with noise of the same colour. Both evidences are then of one kind: the family
pays for its numbers, the function for its freedom.
"""

from __future__ import annotations

from collections.abc import Sequence

from ident.diagnosis.evidence import Evidence
from ident.diagnosis.functions import function_of
from ident.diagnosis.law.learning import Designs, Learner, Learnt
from ident.diagnosis.law.stage import SAME, SURELY, cosine
from ident.diagnosis.problem import Candidate, Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.whitening import Whitener


def free_functions(problem: Problem, candidate: Candidate) -> list[int]:
    """Numbers of the dependences of which a named candidate is a function; none where it is no function of one."""
    function = function_of(candidate.effect)
    return [
        index
        for index, one in enumerate(problem.dependences)
        if function == (one.variable, one.partner) and one.where == candidate.where
    ]


def best_free_function(
    regression: Regression, designs: Designs, whitener: Whitener, others: Sequence[int], dependences: Sequence[int]
) -> Learnt | None:
    """The best free function in the place of a name; None where there is none.

    Args:
        regression: of the rows.
        designs: of the dependences in them.
        whitener: with which the name was judged.
        others: variants taken beside it.
        dependences: of which it is a function.
    """
    learner = Learner(regression, whitener, others)
    knots = {index: designs.knots(index) for index in dependences}
    learnt = [learner.learn(index, designs.columns(index), one) for index, one in knots.items() if one is not None]
    return max((one for one in learnt if one is not None), key=lambda one: one.total(0.0), default=None)


def is_another_curve(free: Learnt, evidence: Evidence, variant: int) -> bool:
    """Whether a free function explains surely more than a name in its place, and is not nearly the same in these rows.

    Args:
        free: function.
        evidence: in that place.
        variant: of the name.
    """
    surely = free.total(0.0) - float(evidence.log_evidence[variant]) > SURELY
    return surely and cosine(free.shape, evidence.explained(variant)) < SAME
