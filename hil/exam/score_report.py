"""A score for people, as Markdown with tables, and for programs, as JSON."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from hil.exam.answer_file import open_cases, own_key
from hil.exam.answer_sets import chance, permuted, read_answers
from hil.exam.answers import Answer
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.identity import exam_identities
from hil.exam.oracle import oracle_rates
from hil.exam.recalibration import LeftOut, each_left_out
from hil.exam.score_names import ASKED, FALSE_ALARMS, ORACLE, PERMUTED, RIGHT
from hil.exam.scoring import Group, Score, missing_cases, removal_rates, score
from hil.exam.statistics import Rate

ALLOWED: Final = 0.05
"""Rate of false alarms that is asked of a diagnosis, and granted to an oracle that would do with fewer."""


@dataclass(frozen=True)
class ScoreReport:
    """A score and what stands beside it.

    Attributes:
        score: of the exam.
        permuted: of the same answers beside other truths.
        chance: share that is expected of them, over all permutations.
        without: rates of the run without the true candidate; empty where there was none.
        worlds: vehicle and engine that the cases were driven with, in words, of every exam.
        first_seeds: that the cases follow from, of exams that are not sealed.
        sources: score of each world by itself, where there are several.
        left_out: each of them with probabilities calibrated on the others.
        oracle: what somebody finds who knows the candidate, by size; empty where nobody was asked.
    """

    score: Score
    permuted: Rate
    chance: float
    without: Mapping[str, Rate]
    worlds: tuple[str, ...]
    first_seeds: tuple[int, ...] = ()
    sources: Mapping[str, Score] = field(default_factory=dict)
    left_out: Mapping[str, LeftOut] = field(default_factory=dict)
    oracle: Mapping[str, Rate] = field(default_factory=dict)

    @property
    def origin(self) -> str:
        """What was driven, and whether whoever diagnosed could know the cases."""
        driven = f"Driven by {', '.join(self.worlds)}."
        if not self.first_seeds:
            return f"{driven} Sealed: the cases were drawn from a secret."
        seeds = ", ".join(map(str, self.first_seeds))
        return f"{driven} Not sealed: the cases follow from seed {seeds}, whoever diagnosed could know them."

    @property
    def rates(self) -> dict[str, Rate]:
        """All of them, by name."""
        return {**self.score.rates, **self.without, **self.oracle, PERMUTED: self.permuted}

    def asked(self, name: str) -> str:
        """What is asked of a number, empty where nothing is."""
        return f"chance, {self.chance:.3f}" if name == PERMUTED else ASKED.get(name, "")


def score_exams(folders: Sequence[ExamFolder], generator: np.random.Generator, keys: Sequence[Path]) -> ScoreReport:
    """Open the answers and score all that was diagnosed; several exams count as one, and by their worlds.

    Args:
        folders: of the exams.
        generator: draws one permutation of the answers.
        keys: files that they were sealed with; none for those that are not sealed.

    Raises:
        UserError: there is no exam, no diagnosis, an answer is another one, or the key is.
    """
    opened = [_opened(folder, keys) for folder in folders]
    answers = [answer for one in opened for answer in one.answers]
    missing: Counter[str] = Counter()
    for one in opened:
        missing.update(one.missing)
    worlds = tuple(dict.fromkeys(one.world for one in opened))
    by_world = {world: [a for one in opened if one.world == world for a in one.answers] for world in worlds}
    without = [answer for one in opened for answer in one.without]
    return ScoreReport(
        score=score(answers, missing),
        permuted=score(permuted(answers, generator)).rates[RIGHT],
        chance=chance(answers),
        without=removal_rates(without, answers) if without else {},
        oracle=_summed([one.oracle for one in opened]),
        worlds=worlds,
        first_seeds=tuple(one.first_seed for one in opened if one.first_seed is not None),
        sources={world: score(own) for world, own in by_world.items()} if len(opened) > 1 else {},
        left_out=each_left_out(
            {world: [one for answer in own for one in answer.statements] for world, own in by_world.items()}
        ),
    )


@dataclass(frozen=True)
class _Opened:
    """One exam with its answers, those without the true candidate, what an oracle finds, and what has no answer."""

    world: str
    first_seed: int | None
    answers: Sequence[Answer]
    without: Sequence[Answer]
    oracle: Mapping[float, Rate]
    missing: Mapping[str, int]


def _opened(folder: ExamFolder, keys: Sequence[Path]) -> _Opened:
    exam = read_exam(folder)
    cases = open_cases(folder, own_key(folder, exam, keys))
    known = exam_identities(folder)
    without = read_answers(folder, cases, known, removed=True) if folder.diagnosed(removed=True) else []
    answers = read_answers(folder, cases, known)
    alarms = score(answers).rates[FALSE_ALARMS]
    allowed = max(alarms.value, ALLOWED) if alarms.cases else ALLOWED
    oracle = oracle_rates(folder, cases, allowed)
    return _Opened(exam.world, exam.first_seed, answers, without, oracle, missing_cases(folder, cases))


def _summed(rates: Sequence[Mapping[float, Rate]]) -> dict[str, Rate]:
    sizes = sorted({size for one in rates for size in one})
    found = {size: [one[size] for one in rates if size in one] for size in sizes}
    return {
        f"{ORACLE} {size:g}": Rate(sum(one.hits for one in each), sum(one.cases for one in each))
        for size, each in found.items()
    }


def summary_lines(report: ScoreReport) -> list[str]:
    """One line a number, for a terminal."""
    texts = {name: str(rate) for name, rate in report.rates.items()}
    texts |= {name: _text(value) for name, value in report.score.numbers.items()}
    width = max(len(name) for name in texts)
    lines = [f"{name:<{width}}  {text:<32}{_wish(report.asked(name))}".rstrip() for name, text in texts.items()]
    counted = f"{report.score.cases} cases scored, {sum(report.score.missing.values())} without an answer."
    calibrated = [
        f"{world}, calibrated on the others: error {one.error:.2f} (as stated {one.stated_error:.2f}), log score "
        f"{one.log_score:.3f} (as stated {one.stated_log_score:.3f}, base rate {one.base_log_score:.3f})"
        for world, one in report.left_out.items()
    ]
    return [counted, report.origin, *lines, *calibrated]


def score_markdown(report: ScoreReport, title: str) -> str:
    """The whole score."""
    score = report.score
    counted = f"{score.cases} cases. {report.origin} Rates with Wilson's 95 % interval and counts."
    parts = [f"# {title}", "", counted, ""]
    parts += ["| what | measured | asked |", "|---|---|---|"]
    parts += [f"| {name} | {rate} | {report.asked(name)} |" for name, rate in report.rates.items()]
    parts += [f"| {name} | {_text(value)} | {report.asked(name)} |" for name, value in score.numbers.items()]
    parts += ["", *_sources(report.sources), *_left_out(report.left_out)]
    parts += [*_groups("size in noise units", score.by_size), *_groups("true effect", score.by_name)]
    parts += ["## Confusion", "", *_confusion(score.confusion), ""]
    parts += ["## Two effects", "", *_pairs(score.pairs), ""]
    parts += ["## Reliability", "", "| stated probability | right |", "|---|---|"]
    parts += [f"| {each.stated:.2f} | {each.right} |" for each in score.bins]
    parts += ["", "## Cases without an answer", "", *_missing(score.missing)]
    return "\n".join(parts) + "\n"


def score_json(report: ScoreReport) -> str:
    """All numbers; a rate is hits, cases, value and the ends of its interval."""
    score = report.score
    content = {
        "worlds": list(report.worlds),
        "sealed": not report.first_seeds,
        "first_seeds": list(report.first_seeds),
        "sources": {
            world: {name: _plain(rate) for name, rate in own.rates.items() if rate.cases}
            for world, own in report.sources.items()
        },
        "left_out": {world: {**vars(one), "scaling": vars(one.scaling)} for world, one in report.left_out.items()},
        "cases": score.cases,
        "rates": {name: _plain(rate) for name, rate in report.rates.items() if rate.cases},
        "numbers": {name: _finite(value) for name, value in score.numbers.items()},
        "chance": _finite(report.chance),
        "asked": {name: report.asked(name) for name in (*report.rates, *score.numbers) if report.asked(name)},
        "by_size": {size: _plain_group(group) for size, group in score.by_size.items()},
        "by_name": {name: _plain_group(group) for name, group in score.by_name.items()},
        "confusion": [[true, said, count] for (true, said), count in sorted(score.confusion.items())],
        "pairs": [[true, said, count] for (true, said), count in sorted(score.pairs.items())],
        "bins": [[each.stated, *_plain(each.right)] for each in score.bins],
        "missing": dict(score.missing),
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _plain(rate: Rate) -> list[float]:
    return [rate.hits, rate.cases, rate.value, *rate.interval]


def _plain_group(group: Group) -> dict[str, list[float] | float | None]:
    return {
        name: _plain(value) if isinstance(value, Rate) else _finite(float(value)) for name, value in vars(group).items()
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _text(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}" if math.isfinite(value) else "–"


def _wish(asked: str) -> str:
    return f"  asked {asked}" if asked else ""


def _groups(what: str, groups: Mapping[str, Group]) -> list[str]:
    titles = ("right", "in the set", "`none`", "set", "right closes", "wrong closes")
    lines = [f"## By {what}", "", f"| {what} | {' | '.join(titles)} |", "|---" * (1 + len(titles)) + "|"]
    for name, group in groups.items():
        numbers = (_text(value) for value in (group.set_size, group.closed_right, group.closed_wrong))
        lines.append(f"| {name} | {group.right} | {group.covered} | {group.silent} | {' | '.join(numbers)} |")
    return [*lines, ""]


def _sources(sources: Mapping[str, Score]) -> list[str]:
    """Every rate by the world that its cases were driven in."""
    if not sources:
        return []
    names = list(dict.fromkeys(name for own in sources.values() for name, rate in own.rates.items() if rate.cases))
    lines = ["## By world", "", f"| | {' | '.join(sources)} |", "|---" * (1 + len(sources)) + "|"]
    for name in names:
        lines.append(f"| {name} | {' | '.join(str(own.rates[name]) for own in sources.values())} |")
    return [*lines, ""]


def _left_out(sources: Mapping[str, LeftOut]) -> list[str]:
    """Calibration of every world by the others."""
    if not sources:
        return []
    titles = ("statements", "error", "as stated", "log score", "as stated", "base rate", "a", "b")
    lines = ["## Calibrated on the other worlds", "", f"| | {' | '.join(titles)} |", "|---" * (1 + len(titles)) + "|"]
    for world, one in sources.items():
        errors, scores = (one.error, one.stated_error), (one.log_score, one.stated_log_score, one.base_log_score)
        cells = [*(f"{error:.2f}" for error in errors), *(f"{each:.3f}" for each in scores)]
        numbers = (f"{number:.2f}" for number in (one.scaling.shift, one.scaling.slope))
        lines.append(f"| {world} | {one.statements} | {' | '.join([*cells, *numbers])} |")
    return [*lines, ""]


def _confusion(counts: Mapping[tuple[str, str], int]) -> list[str]:
    said = sorted({answer for _, answer in counts})
    lines = [f"| truth | {' | '.join(said)} |", "|---" * (len(said) + 1) + "|"]
    for true in sorted({true for true, _ in counts}):
        cells = (str(counts.get((true, answer), "")) for answer in said)
        lines.append(f"| {true} | {' | '.join(cells)} |")
    return lines


def _pairs(counts: Mapping[tuple[str, str], int]) -> list[str]:
    rows = [f"| {true} | {said} | {count} |" for (true, said), count in sorted(counts.items())]
    return ["| truth | named | cases |", "|---|---|---|", *rows] if rows else ["None."]


def _missing(missing: Mapping[str, int]) -> Sequence[str]:
    return [f"- {what}: {count}" for what, count in sorted(missing.items())] or ["None."]
