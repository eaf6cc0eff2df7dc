"""A constant that is halved is halved wherever it is used, and whole again afterwards."""

from __future__ import annotations

from examples.halved_and_doubled import changed, constants_of
from ident.diagnosis.answer import contest
from ident.diagnosis.check import sized
from ident.diagnosis.search import search


def test_it_is_halved_where_it_is_made_and_where_it_is_used() -> None:
    surely = next(one for one in constants_of(["check"]) if one.name == "SURELY")
    with changed(surely, 0.5):
        assert sized.SURELY == 1.0
        assert contest.SURELY == 1.0
    assert sized.SURELY == 2.0
    assert contest.SURELY == 2.0


def test_what_counts_stays_whole_and_at_least_one() -> None:
    found = {one.name: one for one in constants_of(["search", "noise"])}
    assert found["TURNS"].times(0.5) == search.TURNS // 2
    assert found["MEMORIES"].times(2.0) == (0.2, 1.0, 4.0)
    assert found["INSTEAD"].times(0.5) == 1
    assert "USUAL" not in found


def test_every_constant_is_of_one_module() -> None:
    found = [one.key for one in constants_of()]
    assert len(found) == len(set(found)) > 50
    assert "answer.contest.SURELY" not in found
