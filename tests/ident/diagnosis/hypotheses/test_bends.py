"""Exact forms are made once for the numbers that a search comes back to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ident.diagnosis.hypotheses.bends import KEPT, Bends
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.problem import Problem, Series
from ident.diagnosis.search.asked import asked_of


class Counted:
    """A force that grows with the square of its size, and how often it was asked for."""

    def __init__(self, problem: Problem) -> None:
        self.columns = [column for column in problem.candidates[0].variants[0].columns if column is not None]
        self.times = 0

    def __call__(self, numbers: np.ndarray, baseline: np.ndarray) -> Series:
        self.times += 1
        return [float(numbers[0] + numbers[0] ** 2) * column[:, 0] for column in self.columns]


def test_a_search_that_goes_back_and_forth_makes_an_exact_form_once(world: type[Any]) -> None:
    parts = [world(seed=1, true={"a": 2.0}).problem(part) for part in (0, 1)]
    counted = Counted(parts[0])
    problems = [
        replace(part, candidates=(replace(part.candidates[0], contribution=one), *part.candidates[1:]))
        for part, one in zip(parts, (counted, Counted(parts[1])), strict=True)
    ]
    asked = asked_of(problems)
    hypothesis = next(one for one in asked.design.hypotheses if one.key == "a@place")
    bends = Bends(problems, Colours(asked.regression))
    form = bends.form(hypothesis, hypothesis.blocks[0], asked.design.known)
    sizes = [np.array([size]) for size in np.geomspace(10.0, 1e4, KEPT)]
    first = [bends.bend(form, size, None) for size in sizes]
    made = counted.times
    assert all(bends.bend(form, size, None) is before for size, before in zip(sizes, first, strict=True))
    assert counted.times == made
    assert bends.last(hypothesis, hypothesis.blocks[0]) is first[-1]
    # One more is kept in the place of the one that was asked for longest ago.
    bends.bend(form, np.array([1e5]), None)
    assert counted.times > made
    made = counted.times
    bends.bend(form, sizes[0], None)
    assert counted.times > made
