"""A score for people, as Markdown with tables, and for programs, as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.exam.answer_file import open_cases
from hil.exam.answers import chance, permuted, read_answers
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.identity import exam_identities
from hil.exam.score_names import ASKED, PERMUTED, RIGHT
from hil.exam.scoring import Group, Score, missing_cases, removal_rates, score
from hil.exam.statistics import Rate


@dataclass(frozen=True)
class ScoreReport:
    """A score and what stands beside it.

    Attributes:
        score: of the exam.
        permuted: of the same answers beside other truths.
        chance: share that is expected of them, over all permutations.
        without: rates of the run without the true candidate; empty where there was none.
        world: vehicle and engine that the cases were driven with, in words.
        first_seed: that the cases follow from, of an exam that is not sealed; None: it is.
    """

    score: Score
    permuted: Rate
    chance: float
    without: Mapping[str, Rate]
    world: str
    first_seed: int | None

    @property
    def origin(self) -> str:
        """What was driven, and whether whoever diagnosed could know the cases."""
        if self.first_seed is None:
            return f"Driven by {self.world}. Sealed: the cases were drawn from a secret."
        known = f"the cases follow from seed {self.first_seed}, whoever diagnosed could know them"
        return f"Driven by {self.world}. Not sealed: {known}."

    @property
    def rates(self) -> dict[str, Rate]:
        """All of them, by name."""
        return {**self.score.rates, **self.without, PERMUTED: self.permuted}

    def asked(self, name: str) -> str:
        """What is asked of a number, empty where nothing is."""
        return f"chance, {self.chance:.3f}" if name == PERMUTED else ASKED.get(name, "")


def score_exam(folder: ExamFolder, generator: np.random.Generator, key: Path | None) -> ScoreReport:
    """Open the answer and score all that was diagnosed.

    Args:
        folder: of the exam.
        generator: draws one permutation of the answers.
        key: file that the exam was sealed with; None for one that is not sealed.

    Raises:
        UserError: there is no exam, no diagnosis, the answer is another one, or the key is.
    """
    exam, cases = read_exam(folder), open_cases(folder, key)
    known = exam_identities(folder)
    answers = read_answers(folder, cases, known)
    without = folder.diagnosed(removed=True)
    return ScoreReport(
        score=score(answers, missing_cases(folder, cases)),
        permuted=score(permuted(answers, generator)).rates[RIGHT],
        chance=chance(answers),
        without=removal_rates(read_answers(folder, cases, known, removed=True)) if without else {},
        world=exam.world,
        first_seed=exam.first_seed,
    )


def summary_lines(report: ScoreReport) -> list[str]:
    """One line a number, for a terminal."""
    texts = {name: str(rate) for name, rate in report.rates.items()}
    texts |= {name: _text(value) for name, value in report.score.numbers.items()}
    width = max(len(name) for name in texts)
    lines = [f"{name:<{width}}  {text:<32}{_wish(report.asked(name))}".rstrip() for name, text in texts.items()]
    counted = f"{report.score.cases} cases scored, {sum(report.score.missing.values())} without an answer."
    return [counted, report.origin, *lines]


def score_markdown(report: ScoreReport, title: str) -> str:
    """The whole score."""
    score = report.score
    counted = f"{score.cases} cases. {report.origin} Rates with Wilson's 95 % interval and counts."
    parts = [f"# {title}", "", counted, ""]
    parts += ["| what | measured | asked |", "|---|---|---|"]
    parts += [f"| {name} | {rate} | {report.asked(name)} |" for name, rate in report.rates.items()]
    parts += [f"| {name} | {_text(value)} | {report.asked(name)} |" for name, value in score.numbers.items()]
    parts += ["", *_groups("size in noise units", score.by_size), *_groups("true effect", score.by_name)]
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
        "world": report.world,
        "sealed": report.first_seed is None,
        "first_seed": report.first_seed,
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
