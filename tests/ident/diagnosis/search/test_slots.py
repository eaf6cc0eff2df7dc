"""What may stand in one place is compared alike, whichever of it stands there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.evidence.tables import Member
from ident.diagnosis.problem import Problem, Variant
from ident.diagnosis.search.slots import Slot, slot_of

Asked = Callable[[Problem, Problem], Any]

SHAPES = 6
"""Of a rival that is true in one of them."""


def with_a_rival(problem: Problem, part: float) -> Problem:
    """A candidate `c` that is the `b` of the problem and a part of its `f`, in one of several shapes."""
    b, f = ([np.asarray(column) for column in problem.candidates[number].variants[0].columns] for number in (1, 5))
    variants = tuple(
        Variant(tuple(one + part * turn * other for one, other in zip(b, f, strict=True)))
        for turn in np.linspace(-1.0, 1.0, SHAPES)
    )
    candidates = [replace(one, variants=variants) if one.effect == "c" else one for one in problem.candidates]
    return replace(problem, candidates=tuple(candidates))


def slot_with(question: Any, key: str, excess: float) -> Slot:
    """Of the set that has this hypothesis alone, whose rows scatter by `excess` beyond their noise along it."""
    fitter, number = question.search.fitter, question.number(key)
    state = fitter.state({number: Member(0, 1.0)}, None)
    return slot_of(question.search, fitter.among_all(state), number, excess)


@pytest.mark.parametrize("excess", [3.0, 6.0])
def test_of_two_rivals_the_same_is_ahead_whichever_of_them_stands_there(
    world: Callable[..., Any], asked: Asked, excess: float
) -> None:
    """Though one misfits its rows, by which the evidence for both was tempered where it was the member."""
    made = world(7, samples=400, true={"b": 0.4, "f": 0.4 * 0.25})
    question = asked(*(with_a_rival(made.problem(part), 0.25) for part in (0, 1)))
    b, c = question.number("b@place"), question.number("c@place")
    for slot in (slot_with(question, "b@place", excess), slot_with(question, "c@place", 1.0)):
        assert slot.logs[c] > slot.logs[b]
