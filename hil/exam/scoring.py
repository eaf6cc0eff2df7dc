"""Scores an exam: every number that is reported of the answers."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from hil.exam import score_names as names
from hil.exam.answers import Answer
from hil.exam.cases import SIZES, Case, Kind
from hil.exam.folder import ExamFolder
from hil.exam.said import FAILED
from hil.exam.statistics import Bin, Rate, calibration_error, rate, reliability


@dataclass(frozen=True)
class Group:
    """Cases with one effect that have something in common.

    Attributes:
        right, covered: first name or exact set, and true name in the set.
        silent: no effect found.
        set_size: mean, where a name is given.
        closed_right, closed_wrong: median shares of the held-out gap.
    """

    right: Rate
    covered: Rate
    silent: Rate
    set_size: float
    closed_right: float
    closed_wrong: float


@dataclass(frozen=True)
class Score:
    """Everything that is reported.

    Attributes:
        rates: by what they are of (`score_names`).
        numbers: the same for medians, means and errors.
        by_size: by size in noise units.
        by_name: by true name.
        bins: of the reliability plot.
        confusion: (truth, answer) -> cases with at most one effect.
        wished: truth -> answer that a perfect diagnosis would give.
        pairs: (truth, answer) -> cases with two.
        cases: diagnosed.
        missing: kind and name of cases that were not driven or not diagnosed -> how many.
    """

    rates: Mapping[str, Rate]
    numbers: Mapping[str, float]
    by_size: Mapping[str, Group]
    by_name: Mapping[str, Group]
    bins: Sequence[Bin]
    confusion: Mapping[tuple[str, str], int]
    wished: Mapping[str, str]
    pairs: Mapping[tuple[str, str], int]
    cases: int
    missing: Mapping[str, int]


def removable(cases: Sequence[Case]) -> dict[str, str]:
    """True name by case, of the cases with one effect of the library."""
    return {case.identifier: case.effects[0].name for case in cases if case.kind is Kind.EFFECT}


def missing_cases(folder: ExamFolder, cases: Sequence[Case]) -> dict[str, int]:
    """Cases that count nowhere, by what they are and why."""

    def what(case: Case) -> str:
        truth = " + ".join(sorted(f"{effect.name}@{effect.where}" for effect in case.effects)) or str(case.kind)
        driven = "not driven" if folder.undriven(case.identifier).is_file() else "not diagnosed"
        return f"{truth}, size {case.noise_units:g}: {driven}"

    return dict(Counter(what(case) for case in cases if not folder.diagnosis(case.identifier).is_file()))


def score(answers: Sequence[Answer], missing: Mapping[str, int] | None = None) -> Score:
    """All numbers of a set of answers."""
    single = _of(answers, Kind.EFFECT)
    plain = [answer for answer in answers if answer.case.kind is not Kind.PAIR]
    statements = [answer.statements for answer in answers]
    first = [stated[0] for stated in statements if stated]
    bins = _bins(first)
    return Score(
        rates=_single_rates(single) | _other_rates(answers),
        numbers=_numbers(answers, single)
        | {
            names.ECE: calibration_error(bins),
            names.ECE_ALL: calibration_error(_bins([one for stated in statements for one in stated])),
        },
        by_size=_grouped(single, lambda answer: f"{answer.case.noise_units:g}"),
        by_name=_grouped(single, lambda answer: answer.single.name),
        bins=bins,
        confusion=Counter((answer.truth, answer.named or answer.said.verdict) for answer in plain),
        wished={answer.truth: answer.wished for answer in plain},
        pairs=Counter((answer.truth, _all_names(answer)) for answer in _of(answers, Kind.PAIR)),
        cases=len(answers),
        missing=missing or {},
    )


def removal_rates(answers: Sequence[Answer], whole: Sequence[Answer] = ()) -> dict[str, Rate]:
    """What is said of cases whose true candidate is not in the library.

    Args:
        answers: without the true candidate.
        whole: with all of them. Of a small gap noise is a part, and the true cause does not close all of it: where it
            was found, a name in its place is asked for as much.
    """
    alone = [answer for answer in answers if answer.splits_name]
    closed = {a.case.identifier: a.said.closed for a in whole if a.case.kind is Kind.EFFECT and a.right}

    def near(answer: Answer) -> bool:
        return answer.near(closed.get(answer.case.identifier, 1.0))

    return {
        names.WITHOUT_OPEN: rate([answer.open for answer in alone]),
        names.WITHOUT_OPEN_LARGE: rate([answer.open for answer in _large(alone)]),
        names.WITHOUT_NEAR: rate([answer.open or near(answer) for answer in _large(alone)]),
        names.WITHOUT_FAR: rate([not answer.modest and not near(answer) for answer in _large(alone)]),
        names.WITHOUT_MODEST: rate([answer.modest for answer in alone]),
        names.WITHOUT_MODEST_ALL: rate([answer.modest for answer in answers]),
        names.WITHOUT_UNKNOWN: rate([answer.rejected for answer in alone]),
        names.WITHOUT_NONE: rate([answer.said.verdict == "none" for answer in alone]),
    }


def _single_rates(single: Sequence[Answer]) -> dict[str, Rate]:
    large, small = _large(single), [answer for answer in single if answer.case.noise_units == SIZES[0]]
    apart, alike = [answer for answer in large if answer.splits_name], [a for a in large if not a.splits_name]
    exact = [answer for answer in single if answer.exact]
    held = [answer.size_held for answer in single if answer.size_held is not None]
    closing = [answer for answer in _true(single) if math.isfinite(answer.closed)]
    wrong = [max(answer.closed_wrong.values()) for answer in single if answer.closed_wrong]
    return {
        names.RIGHT_LARGE: rate([answer.right for answer in large]),
        names.RIGHT_APART: rate([answer.right for answer in apart]),
        names.RIGHT_SET: rate([answer.right for answer in alike]),
        names.COVERED_LARGE: rate([answer.covered for answer in large]),
        names.COVERED_NAMED: rate([answer.covered for answer in large if answer.named]),
        names.RIGHT_SMALL: rate([answer.right for answer in small]),
        names.RIGHT: rate([answer.right for answer in single]),
        names.EXACT: rate([answer.exact for answer in single]),
        names.NO_MORE: rate([answer.alone_right for answer in single if answer.right]),
        names.PLACE: rate([answer.place for answer in exact if answer.splits_place]),
        names.LIKE_PLACE: rate([answer.like_place for answer in exact]),
        names.SIZE: rate([bool(one) for one in held]),
        names.CLOSED_RIGHT_RATE: rate([answer.closed >= names.CLOSES for answer in closing]),
        names.CLOSED_WRONG_RATE: rate([value < names.CLOSES_NOT for value in wrong]),
    }


def _other_rates(answers: Sequence[Answer]) -> dict[str, Rate]:
    unknown, pairs = _of(answers, Kind.UNKNOWN), _of(answers, Kind.PAIR)
    return {
        names.FALSE_ALARMS: rate([answer.said.verdict != "none" for answer in _of(answers, Kind.NONE)]),
        names.REJECTED: rate([answer.rejected for answer in unknown]),
        names.NOT_NAMED: rate(
            [answer.rejected or (answer.named is None and answer.said.verdict != FAILED) for answer in unknown]
        ),
        names.INVISIBLE: rate([answer.unseen for answer in _of(answers, Kind.INVISIBLE)]),
        names.BOTH: rate([answer.both for answer in pairs]),
        names.BOTH_COVERED: rate([answer.both_covered for answer in pairs]),
        names.LAW_PLACE: rate([answer.law_place for answer in _of(answers, Kind.LAW)]),
        names.LAW_VARIABLE: rate([answer.law_variable for answer in _of(answers, Kind.LAW)]),
        names.FAULTS: rate([answer.fault_named for answer in _of(answers, Kind.FAULT)]),
        names.FAULTS_FALSE: rate([bool(a.said.faults) for a in answers if a.case.kind is not Kind.FAULT]),
        names.FAILURES: rate([answer.said.verdict == FAILED for answer in answers]),
    }


def _numbers(answers: Sequence[Answer], single: Sequence[Answer]) -> dict[str, float]:
    large = _large(single)
    wrong = [answer.closed_wrong for answer in single]
    return {
        names.SET_SIZE: _mean([len(answer.ambiguity_set) for answer in large if answer.named]),
        names.CLOSED_RIGHT: _median([answer.closed for answer in _true(single)]),
        names.CLOSED_RIGHT_LARGE: _median([answer.closed for answer in _true(large)]),
        names.CLOSED_WRONG: _median([value for values in wrong for value in values.values()]),
        names.CLOSED_WORST: _median([max(values.values()) for values in wrong if values]),
        names.LAW_CLOSED: _median([max(answer.said.closed, 0.0) for answer in _of(answers, Kind.LAW)]),
        names.CLOSED_MISTAKEN: _median([answer.closed for answer in single if answer.named and not answer.covered]),
        names.SECONDS: _mean([answer.said.seconds for answer in answers]),
        names.SECONDS_MOST: max((answer.said.seconds for answer in answers), default=math.nan),
    }


def _large(single: Sequence[Answer]) -> list[Answer]:
    return [answer for answer in single if answer.case.noise_units >= SIZES[1]]


def _true(single: Sequence[Answer]) -> list[Answer]:
    """Cases in which the effect put first is the true one, or one that no record tells from it."""
    return [answer for answer in single if answer.named in answer.identity.names]


def _bins(statements: Sequence[tuple[float, bool]]) -> list[Bin]:
    return reliability([stated for stated, _ in statements], [right for _, right in statements])


def _of(answers: Sequence[Answer], kind: Kind) -> list[Answer]:
    return [answer for answer in answers if answer.case.kind is kind]


def _grouped(answers: Sequence[Answer], key: Callable[[Answer], str]) -> dict[str, Group]:
    keys = sorted({key(answer) for answer in answers})
    return {each: _group([answer for answer in answers if key(answer) == each]) for each in keys}


def _group(answers: Sequence[Answer]) -> Group:
    return Group(
        right=rate([answer.right for answer in answers]),
        covered=rate([answer.covered for answer in answers]),
        silent=rate([answer.said.verdict == "none" for answer in answers]),
        set_size=_mean([len(answer.ambiguity_set) for answer in answers if answer.named]),
        closed_right=_median([answer.closed for answer in _true(answers)]),
        closed_wrong=_median([value for answer in answers for value in answer.closed_wrong.values()]),
    )


def _all_names(answer: Answer) -> str:
    return " + ".join(sorted(str(effect["name"]) for effect in answer.said.effects)) or answer.said.verdict


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return statistics.fmean(known) if known else math.nan


def _median(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return statistics.median(known) if known else math.nan
