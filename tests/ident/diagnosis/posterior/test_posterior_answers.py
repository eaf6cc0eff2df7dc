"""What is there is named, what is not there is not, and what nobody knows is said to be unknown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.findings import Findings
from ident.diagnosis.posterior.answer import judge_by_posterior

World = Callable[..., Any]


def judged(made: Any) -> Findings:
    return judge_by_posterior(made.problem(0), made.problem(1), seed=1)


def named(findings: Findings) -> list[str]:
    return [cause.candidate.effect for cause in findings.causes]


@pytest.mark.parametrize("seed", range(3))
def test_a_cause_is_named_with_its_size(world: World, seed: int) -> None:
    findings = judged(world(seed, true={"b": 0.5}))
    assert findings.verdict is Verdict.EFFECT
    (cause,) = findings.causes
    assert cause.candidate.effect == "b"
    assert cause.probability > 0.95
    assert abs(cause.part.values[0] - 0.5) < 3.5 * cause.part.std[0]
    assert cause.closed > 0.9


def test_two_causes_are_both_named(world: World) -> None:
    assert sorted(named(judged(world(4, true={"a": 0.5, "e": -0.4})))) == ["a", "e"]


def test_noise_has_no_cause(world: World) -> None:
    """At most one in twenty worlds without a gap has one, and that is never sure; none is unknown."""
    found = [judged(world(seed, samples=300)) for seed in range(40)]
    false = [one for one in found if one.verdict is not Verdict.NONE]
    assert len(false) <= 2
    assert all(cause.probability < 0.95 for one in false for cause in one.causes)
    assert Verdict.UNKNOWN not in {one.verdict for one in false}


def test_what_is_no_candidate_is_unknown(world: World) -> None:
    findings = judged(world(6, hidden=2.0))
    assert findings.verdict is Verdict.UNKNOWN
    assert findings.lasting


def test_the_same_column_at_two_places_is_one_cause_and_an_alternative(world: World) -> None:
    findings = judged(world(8, true={"b": 0.5}, alike={"c": "b"}))
    (cause,) = findings.causes
    assert {cause.candidate.effect, *(one.name for one in cause.alternatives)} == {"b", "c"}


def test_nothing_depends_on_the_order_of_the_candidates(world: World) -> None:
    names = ("a", "b", "c", "d", "e", "f")
    first, second = (judged(world(9, names=order, true={"c": 0.3})) for order in (names, names[::-1]))
    assert named(first) == named(second) == ["c"]
    assert first.causes[0].probability == pytest.approx(second.causes[0].probability, abs=0.05)


def test_without_repeats_a_cause_is_still_found(world: World) -> None:
    assert named(judged(world(10, repeats=1, samples=3000, true={"d": 0.5}))) == ["d"]


def test_probabilities_are_of_what_may_stand_there(world: World) -> None:
    findings = judged(world(11, true={"b": 0.08}))
    for cause in findings.causes:
        total = sum(cause.ranked.probabilities.values())
        assert 0 < total <= 1 + 1e-9
        assert np.all(np.diff(list(cause.ranked.probabilities.values())) <= 1e-12)
