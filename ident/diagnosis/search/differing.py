"""What members differ by between repeats is no noise: friction that warms up is another one in every repeat.

What else differs between repeats measures the noise, and a drift would hide itself in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.evidence.state import State
from ident.diagnosis.hypotheses.hypotheses import Design
from ident.diagnosis.law.learning import Designs
from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.problem import Block, Problem, Series, contributions_of, summed

Array = NDArray[np.float64]

LESS: Final = 0.1
"""Part of the power of the noise that must go somewhere, and not come elsewhere, to be what a set differs by."""


def with_known_differences(
    problems: tuple[Problem, ...], regression: Regression, design: Design, designs: Designs, state: State
) -> tuple[Problem, ...]:
    """The problems, what a set differs by between repeats known; as they are where the noise is hardly less without it.

    Args:
        problems: to fit and to confirm.
        regression: their rows, with the noise that is measured with it.
        design: of their hypotheses.
        designs: of their laws.
        state: the set.
    """
    parts = list(_parts(problems, design, designs, state))
    if not parts:
        return problems
    added = summed(parts)
    shares = [
        after.covariance[0] / before.covariance[0]
        for before, after in zip(regression.repeats, regression.repeats_without(added), strict=True)
        if before.count and before.covariance[0] > 0
    ]
    if min(shares, default=1.0) > 1 - LESS or max(shares, default=1.0) > 1 + LESS:
        return problems
    waiting = iter(added)
    return tuple(
        replace(problem, blocks=tuple(_known(block, next(waiting)) for block in problem.blocks)) for problem in problems
    )


def _known(block: Block, series: Array | None) -> Block:
    if series is None:
        return block
    return replace(block, irregular=series + (0.0 if block.irregular is None else block.irregular))


def _parts(problems: tuple[Problem, ...], design: Design, designs: Designs, state: State) -> Iterator[Series]:
    """What every member adds to every block, unaveraged; but what turns others, which adds nothing of its own."""
    means = state.target.means(state.members)
    for index, member in state.members.items():
        hypothesis = design.hypotheses[index]
        if hypothesis.candidate is not None and problems[0].candidates[hypothesis.candidate].turned is not None:
            continue
        block, bent = hypothesis.blocks[member.block], state.bends.get(index)
        if hypothesis.dependence is not None:
            columns = designs.series(hypothesis.dependence)
            rows = design.columns[:, block.place] @ means[index]
            numbers = least_squares(designs.columns(hypothesis.dependence), rows)
        else:
            assert hypothesis.candidate is not None
            assert block.column is not None
            candidates = [problem.candidates[hypothesis.candidate] for problem in problems]
            if bent is not None:
                yield contributions_of(candidates, bent.numbers, bent.beside)
                continue
            columns = [one for each in candidates for one in each.variants[block.column.variant].columns]
            numbers = np.zeros(block.column.width)
            numbers[block.kept] = means[index] / block.sizes
        yield [None if one is None else one @ numbers for one in columns]
