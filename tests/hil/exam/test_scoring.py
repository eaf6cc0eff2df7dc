"""A score is perfect for perfect answers, at chance for permuted ones, and counts what is half right as what it is."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from hil.exam import score_names as names
from hil.exam.answer_sets import chance, permuted, read_answers
from hil.exam.answers import Answer
from hil.exam.cases import Case, Injected, Kind
from hil.exam.folder import ExamFolder
from hil.exam.identity import Identities, Identity
from hil.exam.said import Alone, Said, said_from
from hil.exam.score_figures import confusion_svg, reliability_svg
from hil.exam.score_report import ScoreReport, score_json, score_markdown, summary_lines
from hil.exam.scoring import removal_rates, score
from ident.writing import write_whole

Truthful = Callable[[Case], Answer]

TWINS = Identity(frozenset({"torque_bias", "asymmetric_coulomb"}), frozenset({"drive_fl"}))
"""What no record on the floor tells apart."""

WORLD = "prototype in pybullet"


@pytest.fixture
def answers(cases: list[Case], truthful: Truthful) -> list[Answer]:
    return [truthful(case) for case in cases]


def one(cases: list[Case], kind: Kind) -> Case:
    return next(case for case in cases if case.kind is kind)


def entry(name: str, where: str = "drive_fl", *, among: tuple[str, ...] = (), **other: Any) -> dict[str, Any]:
    parameters = {"bias": {"value": 0.1, "std": 0.01}}
    default = {"probability": 0.9, "gap_closed_held_out": 0.4, "parameters": parameters}
    return {"name": name, "where": where, "ambiguity_set": [name, *among], **default, **other}


def answer(
    *effects: dict[str, Any],
    identity: Identity = TWINS,
    size: float = 0.1,
    noise_units: float = 1.0,
    name: str = "torque_bias",
    where: str = "drive_fl",
    **said: Any,
) -> Answer:
    """An answer to a case with a torque bias of the front left drive, or another effect."""
    case = Case("id", Kind.EFFECT, (Injected(name, where, "bias", size),), noise_units, 1, 0)
    content = {"verdict": "effect" if effects else "none", "closed": 0.9, **said}
    return Answer(case, Said(effects=effects, **content), (identity,))


def apart(name: str = "torque_bias") -> Identity:
    return Identity(frozenset({name}), frozenset({"drive_fl"}))


def test_someone_who_knows_scores_everything(answers: list[Answer]) -> None:
    result = score(answers)
    none_is_good = (names.FALSE_ALARMS, names.FAILURES, names.FAULTS_FALSE)
    for name, rate in result.rates.items():
        if name != names.RIGHT_SET:
            assert rate.value == (0.0 if name in none_is_good else 1.0), name
    assert result.rates[names.RIGHT_SET].cases == 0
    assert result.numbers[names.SET_SIZE] == 1.0
    assert result.numbers[names.ECE] == pytest.approx(0.02)
    assert result.numbers[names.CLOSED_WRONG] < 0.2 < 0.8 < result.numbers[names.CLOSED_RIGHT]
    assert all(group.right.value == 1.0 for group in (*result.by_size.values(), *result.by_name.values()))
    assert all(result.wished[truth] == said for truth, said in result.confusion)
    assert all(truth == said for truth, said in result.pairs)


def test_permuted_answers_score_at_the_chance_that_is_stated(answers: list[Answer]) -> None:
    hits = [score(permuted(answers, np.random.default_rng(seed))).rates[names.RIGHT].value for seed in range(20)]
    counts = Counter(each.named for each in answers)
    asked = [each for each in answers if each.case.kind is Kind.EFFECT]
    expected = np.mean([counts[each.single.name] / len(answers) for each in asked])
    assert chance(answers) == pytest.approx(expected)
    assert np.mean(hits) == pytest.approx(expected, abs=0.02)


def test_saying_none_always_is_never_a_false_alarm_and_never_right(answers: list[Answer]) -> None:
    result = score([replace(each, said=Said("none")) for each in answers])
    assert result.rates[names.FALSE_ALARMS].value == 0.0
    assert result.rates[names.RIGHT].value == 0.0
    assert result.rates[names.COVERED_LARGE].value == 0.0
    assert result.rates[names.REJECTED].value == 0.0
    assert result.rates[names.NOT_NAMED].value == 1.0
    assert math.isnan(result.numbers[names.ECE])


def test_unknown_where_nothing_is_wrong_is_a_false_alarm(answers: list[Answer]) -> None:
    result = score([replace(each, said=Said("unknown")) for each in answers])
    assert result.rates[names.FALSE_ALARMS].value == 1.0
    assert result.rates[names.REJECTED].value == 1.0


def test_where_a_name_can_be_split_the_first_one_counts() -> None:
    second = answer(entry("slope", among=("torque_bias",)), identity=apart())
    assert not second.right
    assert second.covered
    assert answer(entry("torque_bias", among=("slope",)), identity=apart()).right


@pytest.mark.parametrize(
    ("effect", "right"),
    [
        (entry("torque_bias", among=("asymmetric_coulomb",)), True),
        (entry("asymmetric_coulomb", among=("torque_bias",)), True),
        (entry("torque_bias"), False),
        (entry("asymmetric_coulomb"), False),
        (entry("torque_bias", among=("asymmetric_coulomb", "slope")), False),
        (entry("slope", among=("torque_bias",)), False),
    ],
)
def test_where_no_record_splits_it_the_set_must_be_exactly_what_looks_the_same(
    effect: dict[str, Any], right: bool
) -> None:
    assert answer(effect).right is right
    result = score([answer(effect)])
    assert result.rates[names.RIGHT_SET].hits == right
    assert result.rates[names.RIGHT_APART].cases == 0


def test_small_effects_count_apart_from_large_ones() -> None:
    result = score([answer(noise_units=0.2), answer(entry("torque_bias"), noise_units=0.5, identity=apart())])
    assert (result.rates[names.RIGHT_SMALL].value, result.rates[names.RIGHT_SMALL].cases) == (0.0, 1)
    assert (result.rates[names.RIGHT_LARGE].value, result.rates[names.RIGHT_LARGE].cases) == (1.0, 1)
    assert result.by_size["0.2"].silent.value == 1.0


def test_no_answer_is_a_miss_of_coverage_and_has_no_set() -> None:
    silent, named = answer(), answer(entry("torque_bias", among=("asymmetric_coulomb",)))
    result = score([silent, named])
    assert result.rates[names.COVERED_LARGE].value == 0.5
    assert result.rates[names.COVERED_NAMED].value == 1.0
    assert result.numbers[names.SET_SIZE] == 2.0


def test_a_place_counts_where_it_can_be_split() -> None:
    either = Identity(frozenset({"torque_bias"}), frozenset({"drive_fl", "drive_rl"}))
    twin, other = entry("torque_bias", "drive_rl"), entry("torque_bias", "drive_fr")
    assert score([answer(twin, identity=either)]).rates[names.PLACE].cases == 0
    assert score([answer(twin, identity=either)]).rates[names.LIKE_PLACE].value == 1.0
    assert score([answer(other, identity=either)]).rates[names.LIKE_PLACE].value == 0.0
    assert score([answer(twin, identity=apart())]).rates[names.PLACE].value == 0.0


def test_a_size_is_held_within_1_96_standard_deviations() -> None:
    def stated(value: float) -> dict[str, Any]:
        return entry("torque_bias", parameters={"bias": {"value": value, "std": 0.01}})

    assert answer(stated(0.1 + 0.0195)).size_held is True
    assert answer(stated(0.1 + 0.0197)).size_held is False
    assert answer(stated(-0.1)).size_held is False
    assert answer(entry("torque_bias", parameters={"bias": {"value": 0.1, "std": None}})).size_held is False
    assert answer(entry("torque_bias", "drive_fr")).size_held is None


def test_half_a_turn_of_a_direction_is_the_other_sign_of_a_size() -> None:
    downhill = Case("id", Kind.EFFECT, (Injected("slope", "chassis", "angle", -0.005),), 1.0, 1, 0)
    parameters = {"angle": {"value": 0.005, "std": 1e-4}, "direction": {"value": math.pi, "std": 0.1}}
    said = Said("effect", (entry("slope", "chassis", parameters=parameters),))
    assert Answer(downhill, said, (Identity(frozenset({"slope"}), frozenset({"chassis"})),)).size_held is True


def test_every_effect_of_a_pair_needs_an_entry_of_its_own(cases: list[Case], truthful: Truthful) -> None:
    known = truthful(one(cases, Kind.PAIR))
    both = [effect.name for effect in known.case.effects]
    in_one_set = {**known.said.effects[0], "ambiguity_set": both}
    assert known.both
    assert known.both_covered
    assert not replace(known, said=replace(known.said, effects=(in_one_set,))).both_covered


def test_an_effect_of_a_pair_that_is_only_in_a_set_is_covered_not_named() -> None:
    effects = (Injected("torque_bias", "drive_fl", "bias", 0.1), Injected("slope", "chassis", "angle", 0.01))
    case = Case("id", Kind.PAIR, effects, 1.0, 1, 0)
    said = Said("effect", (entry("torque_bias"), entry("scrub", among=("slope",))))
    pair = Answer(case, said, (apart(), apart("slope")))
    assert not pair.both
    assert pair.both_covered


def test_every_stated_probability_is_a_statement_about_its_name() -> None:
    two = answer(entry("torque_bias", probability=0.8), entry("scrub", probability=0.6))
    assert two.statements == [(0.8, True), (0.6, False)]
    result = score([two])
    assert result.numbers[names.ECE] == pytest.approx(0.2)
    assert result.numbers[names.ECE_ALL] == pytest.approx(0.5 * 0.2 + 0.5 * 0.6)


def test_a_probability_is_that_of_the_name_or_of_one_that_no_record_tells_from_it() -> None:
    assert answer(entry("asymmetric_coulomb", probability=0.9)).statements == [(0.9, True)]
    assert answer(entry("asymmetric_coulomb", probability=0.9), identity=apart()).statements == [(0.9, False)]


def test_the_right_effect_closes_what_it_closes_and_not_what_others_do() -> None:
    assert answer(entry("torque_bias")).closed == 0.9
    assert answer(entry("torque_bias"), entry("scrub")).closed == 0.4


def test_a_wrong_effect_is_one_that_is_neither_true_nor_identical() -> None:
    alone = (
        Alone("torque_bias", 0.9, 0.8),
        Alone("asymmetric_coulomb", 0.9, 0.8),
        Alone("slope", 0.3, 0.2),
        Alone("scrub", 0.1, 0.5),
        Alone("parameter_change", math.nan, 0.7),
    )
    assert answer(alone=alone).closed_wrong == {"slope": 0.3, "scrub": 0.1}
    result = score([answer(alone=alone)])
    assert result.numbers[names.CLOSED_WRONG] == pytest.approx(0.2)
    assert result.numbers[names.CLOSED_WORST] == pytest.approx(0.3)
    assert result.rates[names.CLOSED_WRONG_RATE].value == 0.0


def test_where_a_value_has_changed_wrong_effects_are_fitted_with_the_values_held() -> None:
    alone = (Alone("slope", 0.3, 0.05), Alone("parameter_change", math.nan, 0.9))
    assert answer(name="parameter_change", identity=apart("parameter_change"), alone=alone).closed_wrong == {
        "slope": 0.05
    }


@pytest.mark.parametrize(
    ("effects", "is_open", "modest"),
    [
        ((entry("slope", probability=0.9),), False, False),
        ((entry("slope", probability=0.4),), False, True),
        ((entry("law", probability=0.95),), True, True),
        ((entry("slope", probability=0.9, among=("scrub",)),), True, True),
        ((entry("slope", among=("scrub",)), entry("stribeck", probability=0.9)), False, False),
        ((), False, True),
    ],
)
def test_a_removed_cause_asks_for_unknown_or_a_set(
    effects: tuple[dict[str, Any], ...], is_open: bool, modest: bool
) -> None:
    rates = removal_rates([answer(*effects, identity=apart())])
    assert rates[names.WITHOUT_OPEN].value == is_open
    assert rates[names.WITHOUT_MODEST].value == modest


def test_small_removed_causes_are_counted_apart() -> None:
    small, large = (
        answer(identity=apart(), verdict=said, noise_units=size) for said, size in (("none", 0.2), ("unknown", 0.5))
    )
    rates = removal_rates([small, large])
    assert rates[names.WITHOUT_OPEN].value == 0.5
    assert (rates[names.WITHOUT_OPEN_LARGE].value, rates[names.WITHOUT_OPEN_LARGE].cases) == (1.0, 1)


@pytest.mark.parametrize(
    ("true_closes", "closes", "there", "near"),
    [
        (0.99, 0.97, "drive_fl", True),
        (0.99, 0.90, "drive_fl", False),
        (0.75, 0.73, "drive_fl", True),
        (0.75, 0.60, "drive_fl", False),
        (0.75, 0.73, "drive_rr", False),
        (1.3, 0.97, "drive_fl", True),
    ],
)
def test_a_name_in_the_place_of_a_removed_cause_is_near_where_it_closes_as_much_as_that_did(
    true_closes: float, closes: float, there: str, near: bool
) -> None:
    """Of a small gap noise is a part, and not even the true cause closes all of it."""
    whole = answer(entry("torque_bias"), identity=apart(), closed=true_closes)
    without = answer(entry("scrub", there), identity=apart(), closed=closes)
    rates = removal_rates([without], [whole])
    assert rates[names.WITHOUT_NEAR].value == near
    assert rates[names.WITHOUT_FAR].value == (not near)


def test_a_law_beside_a_set_of_names_leaves_the_cause_open() -> None:
    law, several, single = entry("law"), entry("scrub", among=("stribeck",)), entry("scrub")
    assert answer(law, several, identity=apart()).open
    assert not answer(law, single, identity=apart()).open


@pytest.mark.parametrize(("parameter", "near"), [("d_vw", True), ("d_cl", False)])
def test_a_changed_value_of_the_model_is_at_the_joint_whose_it_is(parameter: str, near: bool) -> None:
    whole = answer(entry("stribeck", "wheels"), where="wheels", identity=apart(), closed=0.99)
    without = answer(entry("parameter_change", parameter), where="wheels", identity=apart(), closed=0.98)
    assert removal_rates([without], [whole])[names.WITHOUT_NEAR].value == near


def test_unknown_is_the_answer_to_a_removed_cause() -> None:
    rates = removal_rates([answer(identity=apart(), verdict="unknown")])
    assert rates[names.WITHOUT_OPEN].value == 1.0
    assert rates[names.WITHOUT_UNKNOWN].value == 1.0


def test_an_identical_candidate_that_is_left_is_no_wrong_name() -> None:
    rates = removal_rates([answer(entry("asymmetric_coulomb"))])
    assert rates[names.WITHOUT_OPEN].cases == 0
    assert rates[names.WITHOUT_MODEST_ALL].cases == 1


def test_a_failed_diagnosis_is_wrong_everywhere(answers: list[Answer]) -> None:
    result = score([replace(each, said=Said("failed")) for each in answers])
    good = (names.FALSE_ALARMS, names.FAILURES)
    for name, rate in result.rates.items():
        if rate.cases and name not in (names.CLOSED_WRONG_RATE, *good):
            assert rate.value == 0.0, name
    assert all(result.rates[name].value == 1.0 for name in good)


def test_an_answer_is_read_as_it_was_written() -> None:
    content = {
        "verdict": "effect",
        "effects": [entry("slope")],
        "invisible": ["com_offset"],
        "gap": {"closed": None},
        "seconds": 4.0,
        "alone": [{"name": "scrub", "where": "chassis", "refitted": None, "held": 0.1}],
    }
    said = said_from(json.loads(json.dumps(content)))
    assert (said.verdict, said.invisible, said.seconds) == ("effect", ("com_offset",), 4.0)
    assert math.isnan(said.closed)
    assert math.isnan(said.alone[0].refitted)
    assert said.alone[0].held == 0.1


def test_the_score_is_written_for_people_and_programs(answers: list[Answer]) -> None:
    result = score(answers, {"slip@chassis, size 1: not driven": 2})
    report = ScoreReport(result, result.rates[names.RIGHT], chance(answers), removal_rates(answers[:0]), (WORLD,))
    assert "asked at least 0.90" in "\n".join(summary_lines(report))
    assert "2 without an answer" in summary_lines(report)[0]
    page = score_markdown(report, "Exam")
    assert f"| {names.RIGHT} | 1.00 [0.98, 1.00] (240/240) |" in page
    assert f"chance, {chance(answers):.3f}" in page
    assert "- slip@chassis, size 1: not driven: 2" in page
    assert json.loads(score_json(report))["rates"][names.RIGHT][:2] == [240, 240]


@pytest.mark.parametrize(("first_seed", "words"), [(None, "Sealed: "), (7, "Not sealed: the cases follow from seed 7")])
def test_the_score_says_whether_the_cases_could_be_known(
    answers: list[Answer], first_seed: int | None, words: str
) -> None:
    result = score(answers)
    seeds = () if first_seed is None else (first_seed,)
    report = ScoreReport(result, result.rates[names.RIGHT], chance(answers), {}, (WORLD,), seeds)
    assert words in summary_lines(report)[1]
    assert words in score_markdown(report, "Exam")
    assert WORLD in summary_lines(report)[1]
    assert json.loads(score_json(report))["worlds"] == [WORLD]
    assert json.loads(score_json(report))["sealed"] is (first_seed is None)


def test_the_pictures_are_well_formed_and_hold_every_case(answers: list[Answer]) -> None:
    result = score(answers)
    assert reliability_svg(result.bins).count("<circle") == 5
    picture = ElementTree.fromstring(confusion_svg(result.confusion, result.wished))
    texts = [element.text or "" for element in picture.iter("{http://www.w3.org/2000/svg}text")]
    shown = sum(int(text) for text in texts if text.isdigit())
    assert shown == sum(each.case.kind is not Kind.PAIR for each in answers)


def test_an_answer_is_judged_by_the_excitation_that_its_case_drove(tmp_path: Path) -> None:
    folder = ExamFolder(tmp_path)
    case = Case("a", Kind.EFFECT, (Injected("torque_bias", "drive_fl", "bias", 0.01),), 1.0, 1, 1)
    said = {"verdict": "none", "effects": [], "invisible": [], "gap": {"closed": None}}
    write_whole(json.dumps(said), folder.diagnosis("a"))
    alike = {("torque_bias@drive_fl", True): ["asymmetric_coulomb@wheel_fl"]}
    (answer,) = read_answers(folder, [case], [Identities({}), Identities(alike)])
    assert answer.identity.names == {"torque_bias", "asymmetric_coulomb"}


def law_case(name: str, where: str, entry: dict[str, Any], closed: float = 0.9) -> Answer:
    case = Case("id", Kind.LAW, (Injected(name, where, "scale", 1.5),), 1.5, 1, 0)
    return Answer(case, Said("law", (entry,), closed=closed), (Identity(frozenset({name}), frozenset({where})),))


def law_said(where: str, variable: str, **others: Any) -> dict[str, Any]:
    entry = {"name": "law", "where": where, "probability": 0.9, "ambiguity_set": ["law"], "gap_closed_held_out": 0.9}
    return {**entry, "alternatives": [], "law": {"variable": variable}, **others}


def test_a_law_is_right_by_place_and_by_variable_or_by_what_no_record_tells_from_them() -> None:
    right = law_case("law_angle", "wheel_fl", law_said("wheel_fl", "angle"))
    assert right.law_place
    assert right.law_variable
    elsewhere = law_case("law_angle", "wheel_fl", law_said("wheel_rl", "angle"))
    assert not elsewhere.law_place
    assert not elsewhere.law_variable
    other = law_case("law_angle", "steering_left", law_said("steering_left", "rate"))
    assert other.law_place
    assert not other.law_variable
    alternative = {"variable": "angle", "where": "steering_left"}
    assert law_case(
        "law_angle", "steering_left", law_said("steering_left", "rate", alternatives=[alternative])
    ).law_variable


def test_a_name_does_for_a_law_where_it_closes_as_much_and_stands_at_its_joint() -> None:
    name = {"name": "torque_ripple", "where": "drive_fl", "probability": 0.9, "ambiguity_set": ["torque_ripple"]}
    assert law_case("law_angle", "wheel_fl", {**name, "gap_closed_held_out": 0.97, "law": None}).law_variable
    assert not law_case("law_angle", "wheel_fl", {**name, "gap_closed_held_out": 0.8, "law": None}).law_variable
    assert not law_case("law_angle", "wheel_rr", {**name, "gap_closed_held_out": 0.97, "law": None}).law_variable


def test_a_fault_is_named_first_or_by_what_the_record_bears_as_well() -> None:
    case = Case("id", Kind.FAULT, (Injected("scaled", "torque_fl", "", 3.0),), 0.0, 1, 0)
    known = (Identity(frozenset({"scaled"}), frozenset({"torque_fl"})),)
    named = Said("fault", faults=(frozenset({"torque_gain@drive_fl", "scaled@torque_fl"}), frozenset({"frozen@beta"})))
    second = Said("fault", faults=(frozenset({"frozen@beta"}), frozenset({"scaled@torque_fl"})))
    assert Answer(case, named, known).fault_named
    assert not Answer(case, second, known).fault_named
    assert not Answer(case, Said("none"), known).fault_named
    assert score([Answer(case, second, known)]).rates[names.FAULTS_FALSE].cases == 0


def test_exams_of_several_worlds_are_counted_together_and_each_by_itself(answers: list[Answer]) -> None:
    wrong = [replace(each, said=Said("none")) for each in answers]
    sources = {"one": score(answers), "other": score(wrong)}
    whole = score([*answers, *wrong])
    report = ScoreReport(whole, whole.rates[names.RIGHT], 0.1, {}, ("one", "other"), (1, 2), sources)
    page, content = score_markdown(report, "Exam"), json.loads(score_json(report))
    assert "Driven by one, other. Not sealed: the cases follow from seed 1, 2" in page
    assert f"| {names.RIGHT} | 1.00 [0.98, 1.00] (240/240) | 0.00 [0.00, 0.02] (0/240) |" in page
    assert content["rates"][names.RIGHT][:2] == [240, 480]
    assert content["sources"]["other"][names.RIGHT][:2] == [0, 240]
