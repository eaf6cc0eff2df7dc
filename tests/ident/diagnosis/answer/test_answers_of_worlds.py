"""What is there is named, what is not there is not, and what nobody knows is said to be unknown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.answer.contest import better
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.answer.standing import Standing
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.problem import Candidate, Nominal, Problem, Variant
from ident.diagnosis.search.asked import Asked, asked_of
from ident.diagnosis.search.search import Search
from ident.diagnosis.search.slots import UNLISTED
from ident.effects import EffectParameter

World = Callable[..., Any]


def judged(made: Any) -> Findings:
    return judge(made.problem(0), made.problem(1), seed=1)


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
    assert findings.lacking


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
    (cause,) = findings.causes
    listed = sum(cause.ranked.probabilities.values()) / (1 - UNLISTED)
    assert listed + (findings.nothing or 0.0) == pytest.approx(1.0)
    assert 0.5 < cause.probability < 1.0


def wandering(made: Any, size: float) -> list[Problem]:
    """The world's problems, with a share of column `b` that is another one in every stretch, and zero in the mean."""
    problems = [made.problem(part) for part in (0, 1)]
    for part, problem in enumerate(problems):
        generator = np.random.default_rng([made.seed, part, 9])
        for block, column in zip(problem.blocks, problem.candidate("b@place").variants[0].columns, strict=True):
            assert column is not None
            share = np.repeat(generator.normal(size=len(column) // 100), 100)
            block.target[:] += size * share * column[:, 0]
    return problems


def test_nothing_is_likelier_than_what_is_not_believed(world: World) -> None:
    """Where rows scatter beyond their noise as well, by which what is likely is told less surely."""
    found = [judge(*wandering(world(seed), 0.4), seed=1) for seed in (5, 11, 13, 14)]
    assert all(one.verdict is Verdict.NONE and one.doubtful for one in found)
    for one in found:
        assert max(one.doubtful.values()) < 1 - sum(one.doubtful.values())


def with_candidates(made: Any, *merged: tuple[str, ...], least: float | None = None) -> list[Problem]:
    """The world's problems, some of its columns being those of one candidate each, of the first one's name."""
    found = []
    for problem in (made.problem(0), made.problem(1)):
        columns = {str(one.effect): one.variants[0].columns for one in problem.candidates}
        candidates = tuple(
            replace(
                problem.candidate(f"{names[0]}@place"),
                parameters=tuple(EffectParameter(name, "Nm", "") for name in names),
                variants=(Variant(tuple(np.hstack(parts) for parts in zip(*map(columns.get, names), strict=True))),),
                least=least,
            )
            for names in merged
        )
        found.append(replace(problem, candidates=candidates))
    return found


def test_a_cause_of_two_numbers_is_named_if_either_is_there(world: World) -> None:
    for seed in (12, 13, 14):
        problems = with_candidates(world(seed, true={"b": 0.4}), ("a", "b"), ("c",))
        findings = judge(*problems, seed=1)
        assert named(findings) == ["a"]
        assert findings.causes[0].part.values == pytest.approx([0.0, 0.4], abs=0.15)


def test_a_cause_of_one_sign_is_none_of_the_other(world: World) -> None:
    for names in (("a",), ("a", "b")):
        problems = with_candidates(world(15, true={"a": -2.0}), names, ("c",), least=0.0)
        findings = judge(*problems, seed=1)
        assert not findings.causes
        assert findings.verdict is Verdict.UNKNOWN


def test_two_causes_of_which_neither_makes_sense_alone_are_both_named(world: World) -> None:
    """By itself the second one has the wrong sign, as most of it goes against the first."""
    made = world(16, true={"a": 2.0, "b": 1.0})

    def opposed(problem: Problem) -> Problem:
        first, second = (
            [one for one in problem.candidate(f"{name}@place").variants[0].columns if one is not None] for name in "ab"
        )
        against = tuple(0.3 * y - x for x, y in zip(first, second, strict=True))
        noise = [b.target - 2.0 * x[:, 0] - y[:, 0] for b, x, y in zip(problem.blocks, first, second, strict=True)]
        whole = [t + 6 * x[:, 0] + 4 * z[:, 0] for t, x, z in zip(noise, first, against, strict=True)]
        candidates = (
            problem.candidate("a@place"),
            replace(problem.candidate("b@place"), variants=(Variant(against),), least=0.0),
        )
        blocks = tuple(replace(b, target=t) for b, t in zip(problem.blocks, whole, strict=True))
        return replace(problem, blocks=blocks, candidates=candidates)

    findings = judge(opposed(made.problem(0)), opposed(made.problem(1)), seed=1)
    assert sorted(named(findings)) == ["a", "b"]


def test_what_the_baseline_absorbs_is_said_to_be_invisible(world: World) -> None:
    made = world(17, true={"b": 0.5})

    def absorbed(problem: Problem) -> Problem:
        columns = tuple(block.baseline[:, :1] for block in problem.blocks)
        first = replace(problem.candidates[0], variants=(Variant(columns),))
        return replace(problem, candidates=(first, *problem.candidates[1:]))

    findings = judge(absorbed(made.problem(0)), absorbed(made.problem(1)), seed=1)
    assert findings.invisible == ("a",)
    assert named(findings) == ["b"]


def test_what_comes_along_with_a_cause_of_no_size_is_something_unknown(world: World) -> None:
    """As wheels drag that stand askew; and no candidate stands for that alone."""

    def dragging(problem: Problem) -> Problem:
        askew, drag, *others = problem.candidates
        both = zip(askew.variants[0].columns, drag.variants[0].columns, strict=True)
        columns = tuple(np.hstack([one, other]) for one, other in both if one is not None and other is not None)
        wide = Variant(columns, beside=1, itself=False)
        return replace(problem, candidates=(replace(askew, variants=(*askew.variants, wide)), *others))

    for own, verdict in ((0.2, Verdict.EFFECT), (0.0, Verdict.UNKNOWN)):
        made = world(22, true={"a": own, "b": 0.4})
        findings = judge(dragging(made.problem(0)), dragging(made.problem(1)), seed=1)
        assert findings.verdict is verdict
        assert named(findings) == ["a"] * (own > 0)


@pytest.mark.parametrize(("shift", "verdict"), [(0.8, Verdict.EFFECT), (1.5, Verdict.UNKNOWN)])
def test_a_gap_that_only_the_confirming_record_shows_is_something_unknown(
    world: World, shift: float, verdict: Verdict
) -> None:
    """Without repeats, of a parameter that is another one in each record: half as much again as the noise, or less."""
    made = world(31, true={"c": 0.3}, repeats=1, samples=3200)
    confirm = made.problem(1)
    moved = tuple(replace(block, target=block.target + shift * block.baseline[:, 0]) for block in confirm.blocks)
    findings = judge(made.problem(0), replace(confirm, blocks=moved), seed=1)
    assert named(findings) == ["c"]
    assert findings.verdict is verdict


@pytest.mark.parametrize(("deviation", "verdict"), [(1.5, Verdict.NONE), (1e-3, Verdict.UNKNOWN)])
def test_a_parameter_within_what_is_known_of_it_is_no_gap(world: World, deviation: float, verdict: Verdict) -> None:
    made = world(33, repeats=1, samples=3200)
    nominal = Nominal(np.array([2.8, -2.0, 0.5]), np.array([deviation, 1e-3, 1e-3]))
    findings = judge(*(replace(made.problem(part), nominal=nominal) for part in (0, 1)), seed=1)
    assert findings.verdict is verdict
    assert named(findings) == []


def test_noise_in_a_handful_of_rows_is_nothing_unknown(world: World) -> None:
    found = [judged(world(400 + seed, samples=40)).verdict for seed in range(40)]
    assert sum(verdict is not Verdict.NONE for verdict in found) <= 2


def test_what_is_known_to_come_and_go_stays_known_beside_a_cause(world: World) -> None:
    """Sliding that was found in every repeat is part of a cause as well: taken off once more it would be noise."""
    made, generator = world(34, true={}), np.random.default_rng(5)
    slid = [[generator.normal(size=len(block.target)) for block in made.problem(part).blocks] for part in (0, 1)]

    def sliding(part: int, share: float) -> Problem:
        problem = made.problem(part)
        blocks = tuple(
            replace(block, target=block.target + share * one, irregular=one)
            for block, one in zip(problem.blocks, slid[part], strict=True)
        )
        first = replace(problem.candidates[0], variants=(Variant(tuple(one[:, None] for one in slid[part])),))
        return replace(problem, blocks=blocks, candidates=(first, *problem.candidates[1:]))

    findings = judge(sliding(0, 1.0), sliding(1, 1.0), seed=1)
    assert named(findings) == ["a"]
    assert findings.causes[0].part.values[0] == pytest.approx(1.0, abs=0.1)
    assert findings.causes[0].part.std[0] < 0.1


def test_what_is_hardly_what_stands_there_is_not_named_though_its_likelier_rival_has_lost_the_place(
    world: World,
) -> None:
    asked, lost = _blended(world)
    search = Search(asked.fitter).passing_over(lost)
    state = search.run()
    assert [asked.design.hypotheses[index].name for index in state.members] == ["a"]
    left = better(Standing(asked, search, state, seed=1))
    assert left is not None
    assert not left[1].members


def test_what_stood_beside_its_rival_as_that_lost_its_place_is_not_taken_for_it(world: World) -> None:
    asked, lost = _blended(world)
    members = Search(asked.fitter).passing_over(lost).run().members
    search = Search(asked.fitter).passing_over(lost, beside=members)
    assert all(not search.stands_for(index) for index in members)
    slots = Standing(asked, search, search.run(), seed=1).slots
    assert all(slots[index].lost(lost) > 0.99 for index in members)
    assert all(slots[index].lost(search.stands_for(index)) < 0.01 for index in members)


@pytest.mark.parametrize("seed", [4, 5])
def test_of_two_that_trade_for_each_other_one_is_named_with_the_size_of_both(world: World, seed: int) -> None:
    """Both give way to their own size, so that two of half of it are nearer to what is there than one."""

    def giving_way(problem: Problem) -> Problem:
        less = problem.candidate("d@place").variants[0].columns

        def bent(candidate: Candidate) -> Candidate:
            pairs = list(zip(candidate.variants[0].columns, less, strict=True))
            return replace(candidate, contribution=lambda v, _: [v[0] * (x - v[0] * y)[:, 0] for x, y in pairs])

        candidates = [bent(one) for one in problem.candidates if one.effect in ("b", "c")]
        return replace(problem, candidates=tuple(candidates))

    made = world(seed, true={"b": 1.0, "d": -0.5}, alike={"c": "b"})
    findings = judge(giving_way(made.problem(0)), giving_way(made.problem(1)), seed=1)
    assert named(findings) == ["c"]
    assert findings.causes[0].part.values[0] > 10 * findings.causes[0].part.std[0]


def _blended(world: World) -> tuple[Asked, set[int]]:
    """A world of a cause, and another whose column is four fifths of it: much likelier than nothing, but hardly it."""

    def blended(problem: Problem) -> Problem:
        first, second, *rest = problem.candidates
        (one,), (other,) = first.variants, second.variants
        mixed = [0.6 * a + 0.8 * b for a, b in zip(one.columns, other.columns, strict=True)]
        return replace(problem, candidates=(replace(first, variants=(Variant(tuple(mixed)),)), second, *rest))

    made = world(7, true={"b": 0.5})
    asked = asked_of((blended(made.problem(0)), blended(made.problem(1))))
    return asked, {index for index, one in enumerate(asked.design.hypotheses) if one.name == "b"}
