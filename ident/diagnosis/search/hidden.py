"""Ripples that what else is there hid: beside a delay, the spectrum of what is left is that of the delay."""

from __future__ import annotations

from collections.abc import Iterator

from ident.diagnosis.evidence.state import State
from ident.diagnosis.hypotheses.hypotheses import Design
from ident.diagnosis.law.learning import Designs
from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Problem, Variant


def with_hidden_orders(
    problems: tuple[Problem, ...], design: Design, designs: Designs, state: State
) -> tuple[Problem, ...] | None:
    """The problems with the orders that are left beside a set; None where it has no law over the angle of a ripple.

    Such a law may be a ripple of an order that was not tried, where no ripple is named.

    Args:
        problems: to fit and to confirm.
        design: of their hypotheses.
        designs: of their laws.
        state: the set.
    """
    members = [design.hypotheses[index] for index in state.members]
    laws, named = {one.key for one in members if one.free}, {one.candidate for one in members}
    waves = [
        number
        for number, one in enumerate(problems[0].candidates)
        if one.periodic is not None and one.periodic.dependence in laws and number not in named and not one.excluded
    ]
    if not waves:
        return None
    angles = {one.periodic.dependence for one in problems[0].candidates if one.periodic is not None}
    return with_orders(problems, waves, tuple(_taken(problems[0], design, designs, state, angles)))


def _taken(problem: Problem, design: Design, designs: Designs, state: State, angles: set[str]) -> Iterator[Variant]:
    """Members as their columns, but for laws over the angle of a ripple."""
    for index, member in state.members.items():
        hypothesis = design.hypotheses[index]
        column = hypothesis.blocks[member.block].column
        if column is not None:
            yield problem.candidates[column.candidate].variants[column.variant]
        elif hypothesis.key not in angles:
            assert hypothesis.dependence is not None
            yield Variant(tuple(designs.series(hypothesis.dependence)[: len(problem.blocks)]))
