"""Scores an exam: opens the sealed answer and compares it with the diagnoses."""

from __future__ import annotations

import json
import math
import statistics
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from hil.exam.cases import SIZES, Case, Kind
from hil.exam.folder import ExamFolder, open_answer, read_exam
from hil.exam.statistics import Z95, Bin, Rate, calibration_error, rate, reliability
from ident.errors import UserError

CONFIDENT: Final = 0.5
"""Probability from which on a single name counts as a confident one."""

_SIDES: Final = {"fl": "left", "rl": "left", "fr": "right", "rr": "right"}


@dataclass(frozen=True)
class Answer:
    """What the diagnosing side said of one case.

    Attributes:
        case: with the truth.
        verdict: `effect`, `none` or `unknown`.
        effects: as in `diagnosis.json`, most probable first.
        invisible: names that the records cannot show.
        closed: share of the removable gap closed by the whole answer.
        seconds: processor time [s].
    """

    case: Case
    verdict: str
    effects: tuple[Mapping[str, Any], ...]
    invisible: tuple[str, ...]
    closed: float
    seconds: float

    @property
    def named(self) -> str | None:
        """The name put first."""
        return str(self.effects[0]["name"]) if self.verdict == "effect" and self.effects else None

    @property
    def ambiguity_set(self) -> tuple[str, ...]:
        """Names that the answer does not tell apart."""
        return tuple(self.effects[0]["ambiguity_set"]) if self.named else ()

    @property
    def probability(self) -> float:
        """Of the name put first."""
        return float(self.effects[0]["probability"]) if self.named else 0.0

    @property
    def exact(self) -> bool:
        """The name put first is the true one."""
        return len(self.case.effects) == 1 and self.named == self.case.effects[0].name

    @property
    def covered(self) -> bool:
        """The true name is in the set."""
        return len(self.case.effects) == 1 and self.case.effects[0].name in (*self.ambiguity_set, self.named)

    @property
    def place(self) -> bool:
        """The true place."""
        return self.exact and self.effects[0]["where"] == self.case.effects[0].where

    @property
    def side(self) -> bool:
        """The true place, or the other wheel of its side, whose speed has the same size in every step on the floor."""
        return self.exact and _side(str(self.effects[0]["where"])) == _side(self.case.effects[0].where)

    @property
    def size_held(self) -> bool | None:
        """The true size is in the 95 % interval; None where the answer is of another effect or place."""
        if not self.side:
            return None
        true = self.case.effects[0]
        stated = self.effects[0]["parameters"].get(true.parameter)
        if stated is None or stated["value"] is None or stated["std"] is None:
            return False
        return bool(abs(stated["value"] - true.size) <= Z95 * stated["std"])

    @property
    def both(self) -> bool:
        """All true names of a case with several are named, themselves or in a set."""
        said = [{effect["name"], *effect["ambiguity_set"]} for effect in self.effects]
        return self.verdict == "effect" and _matched([effect.name for effect in self.case.effects], said)

    @property
    def modest(self) -> bool:
        """No confident single name."""
        return self.named is None or len(self.ambiguity_set) > 1 or self.probability < CONFIDENT


@dataclass(frozen=True)
class Score:
    """Everything that is reported.

    Attributes:
        rates: by what they are of.
        by_size: top-1 by size in noise units.
        by_name: top-1 by true name.
        set_size: mean number of names in the set.
        bins: of the reliability plot.
        calibration: expected calibration error.
        closed_right, closed_wrong: median share of the removable held-out gap closed.
        confusion: (true name, answer) -> cases.
        seconds: mean processor time of a diagnosis [s].
        cases: diagnosed.
    """

    rates: Mapping[str, Rate]
    by_size: Mapping[str, Rate]
    by_name: Mapping[str, Rate]
    set_size: float
    bins: Sequence[Bin]
    calibration: float
    closed_right: float
    closed_wrong: float
    confusion: Mapping[tuple[str, str], int]
    seconds: float
    cases: int


def read_answers(folder: ExamFolder, *, removed: bool = False) -> list[Answer]:
    """The answers of the diagnosing side beside the truth.

    Raises:
        UserError: there is no exam, no diagnosis, or the sealed answer is another one.
    """
    exam = read_exam(folder)
    cases = open_answer(folder, exam.answer_hash)
    answers = [
        _answer(case, json.loads(path.read_text(encoding="utf-8")))
        for case in cases
        if (path := folder.diagnosis(case.identifier, removed)).is_file()
    ]
    if not answers:
        raise UserError(f"{folder.path} holds no diagnoses.", "Diagnose first: quasiomni exam diagnose FOLDER.")
    return answers


def removable(folder: ExamFolder) -> dict[str, str]:
    """True name by case, of the cases with one effect of the library; opens the sealed answer."""
    cases = open_answer(folder, read_exam(folder).answer_hash)
    return {case.identifier: case.effects[0].name for case in cases if case.kind is Kind.EFFECT}


def permuted(answers: Sequence[Answer], generator: np.random.Generator) -> list[Answer]:
    """The same answers beside the truths of other cases."""
    order = generator.permutation(len(answers))
    return [
        Answer(answers[other].case, mine.verdict, mine.effects, mine.invisible, mine.closed, mine.seconds)
        for mine, other in zip(answers, order.tolist(), strict=True)
    ]


def score(answers: Sequence[Answer]) -> Score:
    """All numbers of a set of answers."""
    single = _of(answers, Kind.EFFECT)
    large = [answer for answer in single if answer.case.noise_units >= SIZES[1]]
    named = [answer for answer in answers if answer.named and answer.case.kind is not Kind.PAIR]
    right = [answer for answer in single if answer.exact]
    held = [answer.size_held for answer in single if answer.size_held is not None]
    rates = {
        "top-1": rate([answer.exact for answer in single]),
        "top-1 or in the set": rate([answer.covered for answer in single]),
        "top-1 or in the set, size 0.5 and above": rate([answer.covered for answer in large]),
        "top-1, size 0.5 and above": rate([answer.exact for answer in large]),
        "set covers the truth where a name is given": rate([answer.covered for answer in single if answer.named]),
        "place, of right names": rate([answer.place for answer in right]),
        "place or its side, of right names": rate([answer.side for answer in right]),
        "size within its 95 % interval": rate([bool(one) for one in held]),
        "false alarms on none": rate([answer.verdict != "none" for answer in _of(answers, Kind.NONE)]),
        "unknown rejected": rate([answer.verdict == "unknown" for answer in _of(answers, Kind.UNKNOWN)]),
        "unknown not named": rate([answer.named is None for answer in _of(answers, Kind.UNKNOWN)]),
        "invisible said to be invisible": rate([_unseen(answer) for answer in _of(answers, Kind.INVISIBLE)]),
        "both of two named": rate([answer.both for answer in _of(answers, Kind.PAIR)]),
    }
    bins = reliability([answer.probability for answer in named], [answer.covered for answer in named])
    return Score(
        rates=rates,
        by_size=_grouped(single, lambda answer: f"{answer.case.noise_units:g}"),
        by_name=_grouped(single, lambda answer: answer.case.effects[0].name),
        set_size=_mean([len(answer.ambiguity_set) for answer in single if answer.named]),
        bins=bins,
        calibration=calibration_error(bins),
        closed_right=_median([answer.closed for answer in right]),
        closed_wrong=_median([answer.closed for answer in single if answer.named and not answer.covered]),
        confusion=Counter((_truth(answer), answer.named or answer.verdict) for answer in answers),
        seconds=_mean([answer.seconds for answer in answers]),
        cases=len(answers),
    )


def modesty(answers: Sequence[Answer]) -> Rate:
    """How often no confident wrong name is given, of answers without the true candidate."""
    return rate([answer.modest for answer in answers])


def _answer(case: Case, content: Mapping[str, Any]) -> Answer:
    closed = content["gap"]["closed"]
    return Answer(
        case=case,
        verdict=str(content["verdict"]),
        effects=tuple(content["effects"]),
        invisible=tuple(content["invisible"]),
        closed=math.nan if closed is None else float(closed),
        seconds=float(content.get("seconds", math.nan)),
    )


def _of(answers: Sequence[Answer], kind: Kind) -> list[Answer]:
    return [answer for answer in answers if answer.case.kind is kind]


def _grouped(answers: Sequence[Answer], key: Callable[[Answer], str]) -> dict[str, Rate]:
    keys = sorted({key(answer) for answer in answers})
    return {each: rate([answer.covered for answer in answers if key(answer) == each]) for each in keys}


def _unseen(answer: Answer) -> bool:
    name = answer.case.effects[0].name
    return name in answer.invisible and name not in {effect["name"] for effect in answer.effects}


def _truth(answer: Answer) -> str:
    return " + ".join(sorted(effect.name for effect in answer.case.effects)) or str(answer.case.kind)


def _side(place: str) -> str:
    part, _, end = place.rpartition("_")
    return f"{part}_{_SIDES.get(end, end)}"


def _matched(names: Sequence[str], said: Sequence[set[str]]) -> bool:
    """Whether every name can be given a set of its own that holds it."""
    if not names:
        return True
    first, *others = names
    return any(
        first in each and _matched(others, [*said[:index], *said[index + 1 :]]) for index, each in enumerate(said)
    )


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return statistics.fmean(known) if known else math.nan


def _median(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return statistics.median(known) if known else math.nan
