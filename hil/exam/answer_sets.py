"""All answers of an exam: read beside their truths, or beside those of other cases, which is what chance can do."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

import numpy as np

from hil.exam.answers import Answer
from hil.exam.cases import Case, Kind
from hil.exam.folder import ExamFolder
from hil.exam.identity import Identities
from hil.exam.said import said_from
from ident.errors import UserError


def read_answers(
    folder: ExamFolder, cases: Sequence[Case], known: Sequence[Identities], *, removed: bool = False
) -> list[Answer]:
    """The answers of the diagnosing side beside the truth.

    Args:
        folder: of the exam.
        cases: from its answer.
        known: identities of every pair of campaigns.
        removed: the answers with the true candidate removed.

    Raises:
        UserError: there is no diagnosis.
    """
    said = {
        case.identifier: said_from(json.loads(path.read_text(encoding="utf-8")))
        for case in cases
        if (path := folder.diagnosis(case.identifier, removed)).is_file()
    }
    if not said:
        raise UserError(f"{folder.path} holds no diagnoses.", "Diagnose first: quasiomni exam diagnose FOLDER.")
    return [
        Answer(case, said[case.identifier], known[case.excitation].of_case(case))
        for case in cases
        if case.identifier in said
    ]


def permuted(answers: Sequence[Answer], generator: np.random.Generator) -> list[Answer]:
    """The same answers beside the truths of other cases."""
    order = generator.permutation(len(answers)).tolist()
    return [Answer(one.case, answers[other].said, one.identities) for one, other in zip(answers, order, strict=True)]


def chance(answers: Sequence[Answer]) -> float:
    """Expected share of right names over all permutations of the answers, of the cases with one effect."""
    asked = [answer for answer in answers if answer.case.kind is Kind.EFFECT]
    hits = [Answer(one.case, other.said, one.identities).right for one in asked for other in answers]
    return sum(hits) / len(hits) if hits else math.nan
