"""Regressions whose truth is known: what is named, how surely, and what is not."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.diagnosis import Gap, Verdict, write_diagnosis
from ident.diagnosis.observations.split import split_problem
from ident.diagnosis.problem import Nominal, Problem, Variant
from ident.effects import EffectParameter
from ident.errors import UserError


def _judged(world: Any) -> Findings:
    return judge(world.problem(0), world.problem(1), seed=1)


def _names(findings: Findings) -> list[str]:
    return [str(cause.candidate.effect) for cause in findings.causes]


def test_an_effect_is_named_with_its_size_and_closes_the_gap(world: type[Any]) -> None:
    findings = _judged(world(seed=7, true={"c": 0.3}))
    assert findings.verdict is Verdict.EFFECT
    assert _names(findings) == ["c"]
    (cause,) = findings.causes
    assert abs(cause.part.values[0] - 0.3) < 3 * cause.part.std[0]
    assert cause.part.std[0] < 0.03
    assert cause.probability > 0.95
    assert findings.gap.closed > 0.8
    assert findings.gap.floor == pytest.approx(1.0)


def test_two_effects_are_both_named(world: type[Any]) -> None:
    findings = _judged(world(seed=8, true={"b": 0.25, "e": -0.25}))
    assert sorted(_names(findings)) == ["b", "e"]


def _curved(problem: Problem, bend: float) -> Problem:
    """`c` as a curve: its column, and `bend` times that of `d` as far as a second number is not 1; it starts at 0."""
    c, d = (next(one for one in problem.candidates if one.effect == name) for name in ("c", "d"))
    pairs = [
        (first, second)
        for first, second in zip(c.variants[0].columns, d.variants[0].columns, strict=True)
        if first is not None and second is not None
    ]

    def contribution(values: Any, _baseline: Any) -> tuple[Any, ...]:
        return tuple((values[0] * first + bend * (values[1] - 1) * second)[:, 0] for first, second in pairs)

    straight = replace(c.variants[0], start=lambda found: np.append(found, 0.0))
    parameters = (*c.parameters, EffectParameter("bend", "1", ""))
    curve = replace(c, parameters=parameters, variants=(straight,), contribution=contribution)
    return replace(problem, candidates=tuple(curve if other is c else other for other in problem.candidates))


@pytest.mark.parametrize(("bend", "verdict"), [(0.0, Verdict.EFFECT), (0.9, Verdict.UNKNOWN)])
def test_an_effect_with_which_the_model_predicts_worse_than_without_is_not_named(
    world: type[Any], bend: float, verdict: Verdict
) -> None:
    """All records together show where the curve goes; those that are fitted do not, and it goes astray in the other."""
    drawn = world(seed=30, true={"c": 0.6})
    findings = judge(_curved(drawn.problem(0), 0.0), _curved(drawn.problem(1), bend), seed=1)
    assert _names(findings) == ["c"]
    assert (findings.gap.closed < 0) == (bend > 0)
    assert findings.verdict is verdict
    assert bool(findings.diagnosis().effects) == (verdict is Verdict.EFFECT)


@pytest.mark.parametrize(
    ("shift", "most", "verdict"),
    [(0.0, True, Verdict.EFFECT), (0.8, False, Verdict.EFFECT), (1.5, False, Verdict.UNKNOWN)],
)
def test_without_repeats_an_effect_must_close_most_of_the_gap_or_leave_what_would_be_called_noise(
    world: type[Any], shift: float, most: bool, verdict: Verdict
) -> None:
    """A parameter that is another one in each record leaves a gap that no function of the states predicts."""
    drawn = world(seed=31, true={"c": 0.3}, repeats=1, samples=3200)
    fit, confirm = drawn.problem(0), drawn.problem(1)
    moved = tuple(replace(block, target=block.target + shift * block.baseline[:, 0]) for block in confirm.blocks)
    findings = judge(fit, replace(confirm, blocks=moved), seed=1)
    assert _names(findings) == ["c"]
    assert (findings.gap.closed > 0.5) == most
    assert (findings.gap.after > 1.3) == (verdict is Verdict.UNKNOWN)
    assert findings.verdict is verdict


def test_noise_alone_is_no_effect(world: type[Any]) -> None:
    findings = _judged(world(seed=9))
    assert findings.verdict is Verdict.NONE
    assert findings.diagnosis().effects == ()
    assert findings.gap.before == pytest.approx(1.0, abs=0.1)


def test_a_gap_without_a_candidate_is_unknown(world: type[Any]) -> None:
    findings = _judged(world(seed=10, hidden=0.8))
    assert findings.verdict is Verdict.UNKNOWN
    assert findings.remainder.deviations > 3


def test_candidates_that_are_the_same_form_one_ambiguity_set_whose_probability_is_stated(world: type[Any]) -> None:
    findings = _judged(world(seed=11, true={"a": 0.3}, alike={"d": "a"}))
    (effect,), (cause,) = findings.diagnosis().effects, findings.causes
    assert set(effect.ambiguity_set) == {"a", "d"}
    assert effect.probability > 0.95
    assert cause.ranked.names["a"] == pytest.approx(cause.ranked.names["d"])


def test_twins_that_explain_more_rank_before_a_lone_name_that_explains_less(world: type[Any]) -> None:
    findings = _judged(world(seed=11, true={"a": 0.4, "e": 0.15}, alike={"d": "a"}))
    first, second = findings.causes
    assert first.candidate.effect in ("a", "d")
    assert second.candidate.effect == "e"
    assert first.probability >= second.probability


def _in_part(problem: Problem, shown: bool) -> Problem:
    """`a` only where it is shown: its columns are zero elsewhere, and so is what it does."""
    first, *others = problem.candidates
    (variant,) = first.variants
    blocks = tuple(
        replace(block, target=block.target + (0.6 * column[:, 0] if shown else 0.0))
        for block, column in zip(problem.blocks, variant.columns, strict=True)
        if column is not None
    )
    columns = variant.columns if shown else tuple(None for _ in variant.columns)
    once = replace(first, variants=(replace(variant, columns=columns),))
    return replace(problem, blocks=blocks, candidates=(once, *others))


@pytest.mark.parametrize("part", [0, 1])
def test_what_happened_in_one_drive_only_is_no_cause_and_hides_none(world: type[Any], part: int) -> None:
    """An event that its candidate explains to the last, in the drive fitted or in the one that confirms."""
    problems = [_in_part(world(seed=24, true={"c": 0.3}).problem(one), one == part) for one in (0, 1)]
    findings = judge(*problems, seed=1)
    assert _names(findings) == ["c"]


@pytest.mark.parametrize("weaker", [30.0, 400.0])
def test_a_cause_that_one_drive_shows_far_better_counts_where_the_other_agrees(world: type[Any], weaker: float) -> None:
    """As where a wheel slides thirty times as far in one drive, or hardly at all."""
    drawn = world(seed=26, true={"a": 10.0})
    fit, confirm = drawn.problem(0), drawn.problem(1)
    first, *others = confirm.candidates
    (variant,) = first.variants
    faint = [None if column is None else column / weaker for column in variant.columns]
    blocks = tuple(
        replace(block, target=block.target - 10.0 * (1 - 1 / weaker) * column[:, 0])
        for block, column in zip(confirm.blocks, variant.columns, strict=True)
        if column is not None
    )
    weak = replace(first, variants=(replace(variant, columns=tuple(faint)),))
    findings = judge(fit, replace(confirm, blocks=blocks, candidates=(weak, *others)), seed=1)
    assert _names(findings) == ["a"]


def test_a_candidate_that_one_record_speaks_against_is_none_in_the_other(world: type[Any]) -> None:
    problems = [world(seed=25, true={"a": 0.5}, alike={"d": "a"}).problem(part) for part in (0, 1)]
    first, *others = problems[1].candidates
    refuted = replace(problems[1], candidates=(replace(first, excluded=True), *others))
    assert _names(judge(problems[0], refuted, seed=1)) == ["d"]


def _with_play(problem: Problem) -> Problem:
    """`a` is a play that may come along with what `b` is alone."""
    play, soft, *others = problem.candidates
    both = zip(play.variants[0].columns, soft.variants[0].columns, strict=True)
    columns = tuple(np.hstack([one, other]) for one, other in both if one is not None and other is not None)
    play = replace(play, variants=(*play.variants, Variant(columns, beside=1)), least=0.0)
    return replace(problem, candidates=(play, replace(soft, least=0.0), *others))


@pytest.mark.parametrize(
    ("true", "named"),
    [({"a": 0.2, "b": 0.4}, ["a"]), ({"b": 0.4}, ["b"]), ({"a": 0.3}, ["a"]), ({"a": -0.3, "b": 0.4}, ["b"])],
)
def test_what_comes_along_with_an_effect_is_no_second_one(
    world: type[Any], true: dict[str, float], named: list[str]
) -> None:
    problems = [_with_play(world(seed=21, true=true).problem(part)) for part in (0, 1)]
    findings = judge(*problems, seed=1)
    assert _names(findings) == named
    (cause,) = findings.causes
    assert cause.ranked.names[named[0]] > 2 * max(p for name, p in cause.ranked.names.items() if name != named[0])
    assert cause.part.values == pytest.approx([true[named[0]]], abs=4 * cause.part.std[0])


def test_a_play_is_not_named_for_what_only_comes_along_with_it(world: type[Any]) -> None:
    """Nothing but the flanks' compliance is there, and no candidate stands for it alone."""
    problems = []
    for part in (0, 1):
        play, _, *others = _with_play(world(seed=21, true={"b": 0.4}).problem(part)).candidates
        problems.append(replace(world(seed=21, true={"b": 0.4}).problem(part), candidates=(play, *others)))
    assert "a" not in _names(judge(*problems, seed=1))


def _with_drag(problem: Problem) -> Problem:
    """`a` with what comes along with it, which is what `b` does: as wheels that stand askew drag."""
    askew, drag, *others = problem.candidates
    both = zip(askew.variants[0].columns, drag.variants[0].columns, strict=True)
    columns = tuple(np.hstack([one, other]) for one, other in both if one is not None and other is not None)
    askew = replace(askew, variants=(*askew.variants, Variant(columns, beside=1, itself=False)))
    return replace(problem, candidates=(askew, *others))


@pytest.mark.parametrize(("own", "named", "verdict"), [(0.2, ["a"], Verdict.EFFECT), (0.0, [], Verdict.UNKNOWN)])
def test_what_only_comes_along_with_an_effect_of_no_size_has_another_cause(
    world: type[Any], own: float, named: list[str], verdict: Verdict
) -> None:
    problems = [_with_drag(world(seed=22, true={"a": own, "b": 0.4}).problem(part)) for part in (0, 1)]
    findings = judge(*problems, seed=1)
    assert _names(findings) == named
    assert findings.verdict is verdict


def test_where_nothing_came_along_a_small_size_is_as_good_as_its_rows(world: type[Any]) -> None:
    """Its stated deviation is larger than itself, but no other explanation is there."""
    problems = []
    for part in (0, 1):
        problem = _with_drag(world(seed=22, true={"a": 0.2}).problem(part))
        first, *others = problem.candidates
        widest = first.variants[-1]
        alone = [column * [1.0, 0.0] for column in widest.columns if column is not None]
        first = replace(first, variants=(replace(widest, columns=tuple(alone)),), spread=(0.3,))
        problems.append(replace(problem, candidates=(first, *others)))
    findings = judge(*problems, seed=1)
    assert (_names(findings), findings.verdict) == (["a"], Verdict.EFFECT)
    assert findings.causes[0].part.std[0] > 0.2


@pytest.mark.parametrize(("own", "named"), [(0.5, ["a"]), (0.12, ["b"])])
def test_a_play_within_what_its_flanks_may_yield_is_their_compliance(
    world: type[Any], own: float, named: list[str]
) -> None:
    """The load of the flanks is known to 0.4: 0.12 of play beside 0.5 of compliance may as well be that."""
    problems = []
    for part in (0, 1):
        play, soft, *others = _with_play(world(seed=21, true={"a": own, "b": 0.5}).problem(part)).candidates
        play = replace(play, effect="a", yielding=0.4)
        problem = world(seed=21, true={"a": own, "b": 0.5}).problem(part)
        problems.append(replace(problem, candidates=(play, soft, *others)))
    findings = judge(*problems, seed=1)
    assert _names(findings) == named
    if named == ["a"]:
        (cause,) = findings.causes
        assert cause.part.std[0] == pytest.approx(0.4 * cause.part.numbers[1], rel=0.02)


def test_what_is_of_no_size_is_not_named_beside_another(world: type[Any]) -> None:
    problems = [_with_drag(world(seed=22, true={"b": 0.3, "c": 0.8}).problem(part)) for part in (0, 1)]
    assert _names(judge(*problems, seed=1)) == ["c"]


@pytest.mark.parametrize(
    ("samples", "fitted", "confirmed", "named"),
    [
        (800, 0.15, 0.3, ["a"]),
        (800, 0.15, -0.1, []),
        (800, 0.4, 0.0, []),
        (800, 0.4, 0.1, []),
        (300, 0.4, 0.0, []),
        (300, 0.4, 0.4, ["a"]),
    ],
)
def test_a_cause_that_the_confirming_drive_speaks_against_is_not_named(
    world: type[Any], samples: int, fitted: float, confirmed: float, named: list[str]
) -> None:
    """Though it is sure in both together, and the confirming rows alone have no gap to speak of."""
    made = [world(seed=30, samples=samples, true={"a": size}) for size in (fitted, confirmed)]
    fit, confirm = (one.problem(part) for part, one in enumerate(made))
    assert _names(judge(fit, confirm, seed=1)) == named


def _in_two_steps(problem: Problem, more: float) -> Problem:
    """Its second coordinate in a step of its own, in which `a` is larger by `more`."""
    first, second = problem.blocks
    column = problem.candidates[0].variants[0].columns[1]
    assert column is not None
    other = replace(second, step="other", target=second.target + more * column[:, 0])
    return replace(problem, blocks=(first, other))


@pytest.mark.parametrize("more", [0.0, 0.4])
def test_a_cause_that_has_another_size_in_another_step_is_less_sure_and_leaves_a_gap(
    world: type[Any], more: float
) -> None:
    problems = [_in_two_steps(world(seed=27, true={"a": 0.3}).problem(part), more) for part in (0, 1)]
    findings = judge(*problems, seed=1)
    (cause,) = findings.causes
    assert cause.candidate.effect == "a"
    assert cause.part.values[0] == pytest.approx(0.3 + more / 2, abs=3 * cause.part.std[0])
    assert (findings.gap.after > 1.02) == (more > 0)
    assert (cause.part.std[0] > 0.025) == (more > 0)


def test_what_is_known_of_a_parameter_holds_without_a_model_too(world: type[Any]) -> None:
    """The third parameter is 0.5, and was expected to be 0 within 0.01."""
    problems = [world(seed=29).problem(part) for part in (0, 1)]
    free = judge(*problems, seed=1).after
    held = judge(*(replace(problem, spreads={"r": (0.0, 1e-2)}) for problem in problems), seed=1).after
    assert free.baseline == pytest.approx([1.0, -2.0, 0.5], abs=0.1)
    assert abs(held.baseline[2]) < 0.5 * free.baseline[2]
    elsewhere = judge(*(replace(problem, spreads={"r": (2.0, 1e-3)}) for problem in problems), seed=1).after
    assert elsewhere.baseline[2] == pytest.approx(2.0, abs=0.1)


def test_what_the_parameters_absorb_is_invisible(world: type[Any]) -> None:
    problems = []
    for part in (0, 1):
        problem = world(seed=12).problem(part)
        first = problem.candidates[0]
        columns = tuple(block.baseline[:, :1].copy() for block in problem.blocks)
        hidden = replace(first, effect="hidden", variants=(replace(first.variants[0], columns=columns),))
        problems.append(replace(problem, candidates=(*problem.candidates, hidden)))
    assert judge(*problems, seed=1).invisible == ("hidden",)


def _with_drift(world: Any) -> list[Problem]:
    """With a candidate for a change of the first parameter, relative to 0.9."""
    problems = []
    for part in (0, 1):
        problem = world.problem(part)
        first = problem.candidates[0]
        columns = tuple(0.9 * block.baseline[:, :1] for block in problem.blocks)
        drift = replace(first, effect="parameter_change", where="p", drift=True)
        drift = replace(drift, variants=(replace(first.variants[0], columns=columns),))
        problems.append(replace(problem, candidates=(*problem.candidates, drift)))
    return problems


def test_with_a_model_a_changed_parameter_is_a_cause_and_without_one_it_is_not(world: type[Any]) -> None:
    """The truth is (1, -2, 0.5); the model says that the first is 0.9 and is sure of it."""
    problems = _with_drift(world(seed=13))
    nominal = Nominal(np.array([0.9, -2.0, 0.5]), np.full(3, 0.005))
    judged = judge(*(replace(problem, nominal=nominal) for problem in problems), seed=1)
    assert _names(judged) == ["parameter_change"]
    assert judged.causes[0].part.values[0] == pytest.approx(1 / 0.9 - 1, abs=0.03)
    assert _names(judge(*problems, seed=1)) == []


@pytest.mark.parametrize(("trade", "named"), [(-1.0, []), (1.0, ["parameter_change"])])
def test_a_change_of_what_a_model_is_sure_of_is_found_though_each_of_its_parameters_may_be_so_far_off(
    world: type[Any], trade: float, named: list[str]
) -> None:
    """Two columns that are nearly one: what the first lacks the second has, and their sum is known."""
    errors = np.array([0.15, trade * 0.15, 0.0])
    correlation = np.array([[1.0, -0.98, 0.0], [-0.98, 1.0, 0.0], [0.0, 0.0, 1.0]])
    nominal = Nominal(np.array([0.9, -2.0, 0.5]), np.full(3, 0.15), correlation)

    def moved(problem: Problem) -> Problem:
        blocks, columns = [], []
        for block in problem.blocks:
            baseline = block.baseline.copy()
            baseline[:, 1] = baseline[:, 0] + 0.2 * baseline[:, 1]
            columns.append(baseline[:, :1])
            target = block.target - block.baseline @ [1.0, -2.0, 0.5] + baseline @ (nominal.values + errors)
            blocks.append(replace(block, baseline=baseline, target=target))
        *others, drift = problem.candidates
        drift = replace(drift, variants=(replace(drift.variants[0], columns=tuple(columns)),))
        return replace(problem, blocks=tuple(blocks), candidates=(*others, drift), nominal=nominal)

    judged = judge(*(moved(problem) for problem in _with_drift(world(seed=13))), seed=1)
    assert _names(judged) == named


def test_with_a_model_each_of_two_causes_closes_what_the_models_values_lack_without_it(world: type[Any]) -> None:
    """Both are as large; what the model knows of its values is so little that a refit could stand in for the first."""
    problems = _with_drift(world(seed=13, true={"c": 0.3}, samples=1600))
    nominal = Nominal(np.array([0.7, -2.0, 0.5]), np.full(3, 0.03))
    judged = judge(*(replace(problem, nominal=nominal) for problem in problems), seed=1)
    assert sorted(_names(judged)) == ["c", "parameter_change"]
    for cause in judged.causes:
        assert cause.closed == pytest.approx(0.5, abs=0.12)


def test_an_effect_left_out_is_said_to_bias_the_parameter_it_hides_in(world: type[Any]) -> None:
    problems = []
    for part in (0, 1):
        problem = world(seed=14, true={}).problem(part)
        first = problem.candidates[0]
        columns = tuple(block.baseline[:, :1] + first.variants[0].columns[i] for i, block in enumerate(problem.blocks))
        blocks = tuple(
            replace(block, target=block.target + 0.4 * columns[i][:, 0]) for i, block in enumerate(problem.blocks)
        )
        mixed = replace(first, effect="mixed", variants=(replace(first.variants[0], columns=columns),))
        problems.append(replace(problem, blocks=blocks, candidates=(mixed, *problem.candidates[1:])))
    (cause,) = judge(*problems, seed=1).causes
    assert cause.candidate.effect == "mixed"
    assert cause.biased["p"] > 5
    assert abs(cause.biased["q"]) < abs(cause.biased["p"]) / 3


def test_one_record_confirms_itself_by_its_later_repeats(world: type[Any]) -> None:
    fit, confirm = split_problem(world(seed=15, true={"f": 0.3}).problem(0))
    assert np.unique(fit.blocks[0].period[fit.blocks[0].period >= 0]).tolist() == [0, 1]
    assert np.unique(confirm.blocks[0].period[confirm.blocks[0].period >= 0]).tolist() == [2, 3]
    assert _names(judge(fit, confirm, seed=1)) == ["f"]


def test_the_answer_is_the_same_every_time(world: type[Any]) -> None:
    first, second = (_judged(world(seed=16, true={"a": 0.15})).diagnosis().as_json() for _ in range(2))
    assert first == second


@pytest.mark.slow
def test_false_alarms_are_rare_and_intervals_hold(world: type[Any]) -> None:
    alarms, inside = 0, []
    names = tuple("abcdefghijklmnopqrstuvwxyz")
    for seed in range(60):
        alarms += _judged(world(seed=1000 + seed, names=names)).verdict is not Verdict.NONE
        found = _judged(world(seed=2000 + seed, names=names, true={"c": 0.2}))
        part = next(cause.part for cause in found.causes if cause.candidate.effect == "c")
        inside.append(abs(part.values[0] - 0.2) < 1.96 * part.std[0])
    assert alarms <= 3
    assert np.mean(inside) > 0.86


@given(
    before=st.floats(1.05, 50),
    share=st.floats(0, 1),
)
def test_the_share_closed_is_that_of_the_power_above_the_floor(before: float, share: float) -> None:
    after = np.sqrt(before**2 - share * (before**2 - 1))
    assert Gap(before, float(after), 1.0).closed == pytest.approx(share, abs=1e-9)


def test_the_json_holds_what_was_agreed_and_nothing_else(world: type[Any], tmp_path: Path) -> None:
    path = tmp_path / "deep" / "diagnosis.json"
    write_diagnosis(_judged(world(seed=7, true={"c": 0.3})).diagnosis("drive more"), path)
    content = json.loads(path.read_text())
    assert list(content) == [
        "verdict",
        "effects",
        "where",
        "gap",
        "invisible",
        "next_experiment",
        "faults",
        "unseen",
    ]
    assert list(content["effects"][0]) == [
        "name",
        "where",
        "parameters",
        "probability",
        "ambiguity_set",
        "gap_closed_held_out",
        "alternatives",
        "law",
    ]
    assert set(content["effects"][0]["parameters"]["size"]) == {"value", "std", "unit"}
    assert set(content["where"][0]) == {"channel", "step", "coordinate", "region", "share"}
    assert set(content["gap"]) == {"before", "after", "floor", "closed"}
    whole = [entry["share"] for entry in content["where"] if entry["region"] == "all"]
    assert sum(whole) == pytest.approx(1.0)
    assert not list(path.parent.glob(".*"))


def test_a_place_that_cannot_be_written_is_named(world: type[Any], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        write_diagnosis(_judged(world(seed=7)).diagnosis(), tmp_path / "file" / "diagnosis.json")


def _with_rows_of_its_own(problem: Problem, size: float) -> Problem:
    """With a third coordinate, of which neither model nor candidates say anything, and in which something repeats."""
    motion = np.sin(np.linspace(0, 20, int(np.sum(problem.blocks[0].period == 0))))
    first = problem.blocks[0]
    noise = np.random.default_rng(len(problem.blocks[0].target)).normal(size=len(first.target))
    own = replace(
        first,
        coordinate="own",
        target=noise + size * np.sqrt(2) * np.tile(motion, len(first.target) // len(motion)),
        baseline=np.zeros_like(first.baseline),
        features=None,
    )
    candidates = tuple(
        replace(one, variants=tuple(replace(v, columns=(*v.columns, None)) for v in one.variants))
        for one in problem.candidates
    )
    return replace(problem, blocks=(*problem.blocks, own), candidates=candidates)


@pytest.mark.parametrize("size", [4.0, 0.3])
def test_what_lasts_in_rows_of_their_own_is_left_beside_a_cause_that_closes_all_of_its_own(
    world: type[Any], size: float
) -> None:
    problems = (_with_rows_of_its_own(world(seed=21, true={"c": size}).problem(part), 1.2) for part in (0, 1))
    findings = judge(*problems, seed=1)
    assert _names(findings) == ["c"]
    assert findings.verdict is Verdict.EFFECT
    assert findings.causes[0].closed > 0.98
    assert findings.gap.after > 1.15
