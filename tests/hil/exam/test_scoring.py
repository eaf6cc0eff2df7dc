"""A score is perfect for perfect answers, at chance for permuted ones, and counts what is half right as what it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hil.exam.cases import Case, Kind
from hil.exam.score_report import reliability_svg, score_json, score_markdown, summary_lines
from hil.exam.scoring import Answer, modesty, permuted, score

Truthful = Callable[[Case], Answer]


@pytest.fixture
def answers(cases: list[Case], truthful: Truthful) -> list[Answer]:
    return [truthful(case) for case in cases]


def one(cases: list[Case], kind: Kind) -> Case:
    return next(case for case in cases if case.kind is kind)


def test_someone_who_knows_scores_everything(answers: list[Answer]) -> None:
    result = score(answers)
    wrong_is_good = "false alarms on none"
    for name, rate in result.rates.items():
        assert rate.value == (0.0 if name == wrong_is_good else 1.0), name
    assert result.set_size == 1.0
    assert result.calibration == pytest.approx(0.02)
    assert all(rate.value == 1.0 for rate in (*result.by_size.values(), *result.by_name.values()))


def test_permuted_answers_score_at_chance(answers: list[Answer]) -> None:
    names = len({answer.case.effects[0].name for answer in answers if answer.case.kind is Kind.EFFECT})
    hits = [score(permuted(answers, np.random.default_rng(seed))).rates["top-1"].value for seed in range(20)]
    assert np.mean(hits) == pytest.approx(240 / 388 / names, abs=0.02)


def test_saying_none_always_is_never_a_false_alarm_and_never_right(cases: list[Case]) -> None:
    lazy = [Answer(case, "none", (), (), 0.0, 1.0) for case in cases]
    result = score(lazy)
    assert result.rates["false alarms on none"].value == 0.0
    assert result.rates["top-1 or in the set"].value == 0.0
    assert result.rates["unknown rejected"].value == 0.0
    assert result.rates["unknown not named"].value == 1.0


def test_a_name_inside_the_set_counts_as_covered_and_not_as_top(cases: list[Case], truthful: Truthful) -> None:
    answer = truthful(one(cases, Kind.EFFECT))
    true = answer.case.effects[0].name
    other = {**answer.effects[0], "name": "another", "ambiguity_set": ["another", true]}
    half = replace(answer, effects=(other,))
    assert half.covered
    assert not half.exact
    assert half.modest


def test_the_other_wheel_of_a_side_is_the_right_side(cases: list[Case], truthful: Truthful) -> None:
    case = next(c for c in cases if c.kind is Kind.EFFECT and c.effects[0].where.startswith("wheel_f"))
    answer = truthful(case)
    twin = case.effects[0].where.replace("wheel_f", "wheel_r")
    moved = replace(answer, effects=({**answer.effects[0], "where": twin},))
    assert moved.side
    assert not moved.place


def test_a_size_outside_its_interval_is_not_held(cases: list[Case], truthful: Truthful) -> None:
    answer = truthful(one(cases, Kind.EFFECT))
    true = answer.case.effects[0]
    off = {true.parameter: {"value": 1.2 * true.size, "std": abs(true.size) * 0.02}}
    assert answer.size_held
    assert replace(answer, effects=({**answer.effects[0], "parameters": off},)).size_held is False


def test_both_effects_of_a_pair_need_an_entry_each(cases: list[Case], truthful: Truthful) -> None:
    answer = truthful(one(cases, Kind.PAIR))
    names = [effect.name for effect in answer.case.effects]
    in_one_set = {**answer.effects[0], "ambiguity_set": names}
    assert answer.both
    assert not replace(answer, effects=(in_one_set,)).both


def test_a_confident_wrong_name_is_immodest(answers: list[Answer]) -> None:
    singles = [answer for answer in answers if answer.case.kind is Kind.EFFECT]
    assert modesty(singles).value == 0.0
    assert modesty([replace(answer, verdict="unknown", effects=()) for answer in singles]).value == 1.0


def test_a_failed_diagnosis_is_wrong_everywhere(cases: list[Case]) -> None:
    failed = [Answer(case, "failed", (), (), float("nan"), 1.0) for case in cases]
    result = score(failed)
    assert result.rates["false alarms on none"].value == 1.0
    assert result.rates["unknown rejected"].value == 0.0


def test_the_score_is_written_for_people_and_programs(answers: list[Answer]) -> None:
    result = score(answers)
    assert "asked at least 0.90" in "\n".join(summary_lines(result))
    assert "| top-1 | 1.00 [0.98, 1.00] (240/240) |" in score_markdown(result, "Exam", {})
    assert '"calibration_error"' in score_json(result, {})
    assert reliability_svg(result.bins).count("<circle") == 5
