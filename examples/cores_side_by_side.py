"""Both cores on the same sealed records: one table, over the cases that both have answered.

quasiomni exam diagnose exam
quasiomni exam diagnose exam --core one
python examples/cores_side_by_side.py exam --key exam.key
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from hil.exam import score_names as names
from hil.exam.answer_file import open_cases
from hil.exam.answer_sets import read_answers
from hil.exam.answers import Answer
from hil.exam.cases import Case
from hil.exam.folder import Core, ExamFolder
from hil.exam.identity import exam_identities
from hil.exam.recalibration import log_score
from hil.exam.scoring import removal_rates, score

SHOWN: Final = (
    names.RIGHT_LARGE, names.COVERED_LARGE, names.RIGHT_SMALL, names.NO_MORE, names.SIZE, names.FALSE_ALARMS,
    names.BOTH, names.BOTH_COVERED, names.LAW_PLACE, names.LAW_VARIABLE, names.LAW_CLOSED, names.SET_SIZE,
    names.ECE, names.ECE_ALL,
    names.WITHOUT_NEAR, names.WITHOUT_FAR, names.WITHOUT_NONE, names.FAILURES, names.SECONDS, names.SECONDS_MOST,
)  # fmt: skip
"""Numbers of a score that are compared."""


def table(exam: ExamFolder, key: Path | None) -> str:
    """Markdown: what every core has of the cases that all have answered.

    Args:
        exam: folder of it.
        key: that it was sealed with.

    Raises:
        UserError: a core has answered nothing, or the key is another one.
    """
    folders = {core: replace(exam, core=core) for core in Core}
    cases, known = open_cases(exam, key), exam_identities(exam)
    columns: dict[Core, Mapping[str, str]] = {}
    counted = {}
    whole: dict[Core, Sequence[Answer]] = {}
    for removed in (False, True):
        shared = [case for case in cases if all(_answered(folder, case, removed) for folder in folders.values())]
        counted[removed] = len(shared)
        for core, folder in folders.items():
            answers = read_answers(folder, shared, known, removed=removed) if shared else []
            own = _without(answers, whole[core]) if removed else _with_all(answers)
            whole.setdefault(core, answers)
            columns[core] = {**columns.get(core, {}), **own}
    head = f"{counted[False]} cases, {counted[True]} of them with the true candidate left out as well"
    lines = [f"| {head} | {' | '.join(folders)} |", "|---|" + "---|" * len(folders)]
    rows = [*(name for name in SHOWN if name in columns[Core.ONE]), *(n for n in columns[Core.ONE] if n not in SHOWN)]
    lines += [f"| {name} | {' | '.join(columns[core].get(name, '') for core in folders)} |" for name in rows]
    return "\n".join(lines)


def _answered(folder: ExamFolder, case: Case, removed: bool) -> bool:
    return folder.diagnosis(case.identifier, removed).is_file()


def _with_all(answers: Sequence[Answer]) -> dict[str, str]:
    """Numbers of a score, its log score and its reliability over bins of equal mass."""
    found = score(answers)
    texts = {name: str(rate) for name, rate in found.rates.items() if name in SHOWN and rate.cases}
    texts |= {name: f"{value:.2f}" for name, value in found.numbers.items() if name in SHOWN}
    stated = [each for answer in answers for each in answer.statements]
    if not stated:
        return texts
    probabilities, right = (np.array(column) for column in zip(*stated, strict=True))
    texts["log score of every name [nat]"] = f"{log_score(probabilities.astype(float), right.astype(bool)):.3f}"
    base = np.full(len(right), right.mean())
    texts["- of the share that is right, whatever is stated"] = f"{log_score(base, right.astype(bool)):.3f}"
    for number, one in enumerate(found.bins, 1):
        texts[f"first names, bin {number}: stated, right"] = f"{one.stated:.2f}, {one.right}"
    return texts


def _without(answers: Sequence[Answer], whole: Sequence[Answer]) -> dict[str, str]:
    rates = removal_rates(answers, whole) if answers else {}
    return {name: str(rate) for name, rate in rates.items() if name in SHOWN}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("exam", type=Path, help="folder of the exam")
    parser.add_argument("--key", type=Path, help="that it was sealed with; none where it is not sealed")
    arguments = parser.parse_args()
    print(table(ExamFolder(arguments.exam), arguments.key))


if __name__ == "__main__":
    main()
