"""What a search takes, of what promises much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ident.diagnosis.problem import Problem, Variant
from ident.diagnosis.search.asked import asked_of
from ident.diagnosis.search.search import Search

World = Callable[..., Any]


def test_what_promises_most_and_keeps_none_of_it_does_not_hide_what_is_there(world: World) -> None:
    """A column that is all that is lacking, of an effect whose exact form adds nothing."""

    def hollow(problem: Problem) -> Problem:
        first, *others = problem.candidates
        parts = [one.variants[0].columns for one in others[:2]]
        promised = Variant(tuple(np.asarray(one) + np.asarray(other) for one, other in zip(*parts, strict=True)))
        empty = replace(
            first,
            variants=(promised,),
            contribution=lambda _values, _parameters: [np.zeros(len(block.target)) for block in problem.blocks],
        )
        return replace(problem, candidates=(empty, *others))

    made = world(7, true={"b": 0.4, "c": 0.4})
    asked = asked_of((hollow(made.problem(0)), hollow(made.problem(1))))
    found = Search(asked.fitter).run()
    assert {asked.design.hypotheses[index].name for index in found.members} == {"b", "c"}


def test_what_stood_beside_another_as_that_lost_its_place_is_not_taken_for_it(world: World) -> None:
    made = world(7)
    search = Search(asked_of((made.problem(0), made.problem(1))).fitter).passing_over([1], beside=[0])
    assert search.barred >= {1}
    assert search.stands_for(0) == frozenset()
    assert search.stands_for(2) == {1}


def test_what_is_refuted_beside_another_is_a_rival_of_that_alone(world: World) -> None:
    made = world(7)
    search = Search(asked_of((made.problem(0), made.problem(1))).fitter).refuting([1], beside=[0]).refuting([3])
    assert search.barred >= {1, 3}
    assert [search.may_stand(one, index) for one, index in ((1, 0), (1, 2), (3, 0), (4, 0))] == [
        True,
        False,
        False,
        True,
    ]
