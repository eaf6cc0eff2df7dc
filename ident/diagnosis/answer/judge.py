"""The judgement of records: of every piece that has nothing in common with the others, and of all together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ident.diagnosis.answer.answered import answer_of
from ident.diagnosis.answer.findings import Cause, Findings, by_need
from ident.diagnosis.check.fitted import HeldOut
from ident.diagnosis.check.refit import Part, Refit
from ident.diagnosis.check.remainder import shares_of
from ident.diagnosis.diagnosis import Gap, Verdict
from ident.diagnosis.observations.pieces import Piece, pieces_of
from ident.diagnosis.problem import Problem, Series
from ident.stages import Stage, untold

Array = NDArray[np.float64]

_STRONGEST: Final = (Verdict.LAW, Verdict.EFFECT, Verdict.UNKNOWN, Verdict.NONE)
"""Verdicts, of which that of all pieces is the first that any has."""


Names = tuple[str, ...]
"""Of the parameters of a piece, which no other piece has."""


def judge(fit: Problem, confirm: Problem, *, seed: int, stage: Stage = untold) -> Findings:
    """Find the causes of a gap.

    Args:
        fit: records that effects are looked for in.
        confirm: independent records.
        seed: of the smooth function of what is left.
        stage: told what begins.
    """
    return answers_of(fit, confirm, seed=seed, stage=stage).findings()


def answers_of(
    fit: Problem, confirm: Problem, *, seed: int, known: Mapping[Names, Findings] | None = None, stage: Stage = untold
) -> Answers:
    """The answer of every piece.

    Args:
        fit, confirm, seed, stage: as of `judge`.
        known: answers of pieces that are as they were.
    """
    problems, known = (fit, confirm), known or {}
    pieces = pieces_of(problems)
    # What is one piece is asked as it is.
    asked = [piece.problems for piece in pieces] if len(pieces) > 1 else [problems]
    found = [known.get(own.names) or answer_of(own, other, seed=seed, stage=stage) for own, other in asked]
    return Answers(problems, pieces, found)


@dataclass(frozen=True)
class Answers:
    """What was found of the pieces of problems.

    Attributes:
        problems: to fit and to confirm.
        pieces: of them.
        found: of every piece.
    """

    problems: tuple[Problem, Problem]
    pieces: Sequence[Piece]
    found: Sequence[Findings]

    @property
    def by_names(self) -> dict[Names, Findings]:
        """Of every piece, by its parameters."""
        return {piece.problems[0].names: one for piece, one in zip(self.pieces, self.found, strict=True)}

    def of(self, parameter: str) -> Findings:
        """Of the piece that has this parameter."""
        return next(one for names, one in self.by_names.items() if parameter in names)

    def findings(self) -> Findings:
        """Of the whole."""
        if len(self.pieces) == 1:
            return self.found[0]
        return _Together(self.problems, self.pieces, self.found).findings()


class _Together:
    """What was found of the pieces of problems, as it is of the whole; arguments are the attributes of `Answers`."""

    def __init__(self, problems: Sequence[Problem], pieces: Sequence[Piece], found: Sequence[Findings]) -> None:
        self._problems, self._pieces, self._found = problems, pieces, [_as_answered(one) for one in found]

    def findings(self) -> Findings:
        """Of the whole: a piece whose gap nothing explains has no causes, and its gap stays."""
        explained = [one for one in self._found if one.verdict.explains]
        verdicts = {one.verdict for one in self._found}
        doubtful = {key: value for one in self._found for key, value in one.doubtful.items()}
        return Findings(
            verdict=next(one for one in _STRONGEST if one in verdicts),
            causes=tuple(by_need(list(self._causes()))),
            doubtful=dict(sorted(doubtful.items(), key=lambda entry: -entry[1])),
            gap=_pooled([one.gap for one in self._found]),
            where=shares_of([share for one in self._found for share in one.where]),
            invisible=self._invisible(),
            before=self._refit([one.before for one in self._found]),
            after=self._refit([one.after for one in self._found]),
            nothing=max((one.nothing for one in explained if one.nothing is not None), default=None),
            remainder=max((one.remainder for one in self._found), key=lambda rest: rest.deviations),
            lacking=any(one.lacking for one in self._found),
            repeated_before={label: value for one in self._found for label, value in one.repeated_before.items()},
            repeated_after={label: value for one in self._found for label, value in one.repeated_after.items()},
            problem=self._problems[0],
            held_out=self._held_out(),
            log_posterior=sum(one.log_posterior for one in self._found),
        )

    def _causes(self) -> Iterator[Cause]:
        """Of the pieces that have some; how much each is needed is a share of the gap of the whole.

        What it closes is one of the gap where it acts, as of any cause.
        """
        removable = [one.gap.samples * max(one.gap.before**2 - one.gap.floor**2, 0.0) for one in self._found]
        whole = sum(removable)
        for piece, one, part in zip(self._pieces, self._found, removable, strict=True):
            share = part / whole if whole > 0 else 0.0
            for cause in one.causes if one.verdict.explains else ():
                yield replace(self._cause(piece, cause), needed=share * cause.needed)

    def _invisible(self) -> tuple[str, ...]:
        """Names of candidates that no piece shows."""
        names = [{str(one.effect) for one in piece.problems[0].candidates} for piece in self._pieces]
        shown = set().union(*(own - set(one.invisible) for own, one in zip(names, self._found, strict=True)))
        every = dict.fromkeys(str(one.effect) for one in self._problems[0].candidates)
        return tuple(name for name in every if name not in shown)

    def _cause(self, piece: Piece, cause: Cause) -> Cause:
        """Among the dependences, and in the blocks, of the whole."""
        law = cause.law
        if law is not None:
            number = piece.dependences[law.index]
            law = replace(law, index=number, dependence=self._problems[0].dependences[number])
        return replace(cause, law=law, part=self._part(piece, cause.part))

    def _part(self, piece: Piece, part: Part) -> Part:
        return replace(part, added=self._placed(piece, part.added))

    def _placed(self, piece: Piece, series: Series) -> list[Array | None]:
        """Series of the blocks of a piece, those of the problem to fit first, in the blocks of the whole."""
        found: list[Array | None] = [None] * sum(len(problem.blocks) for problem in self._problems)
        for place, one in zip(self._blocks(piece), series, strict=True):
            found[place] = one
        return found

    def _blocks(self, piece: Piece) -> list[int]:
        first = len(self._problems[0].blocks)
        return [*piece.blocks[0], *(first + number for number in piece.blocks[1])]

    def _refit(self, refits: Sequence[Refit]) -> Refit:
        order = np.argsort(np.concatenate([piece.parameters for piece in self._pieces]))
        covariance = block_diag(*(one.covariance for one in refits))
        pairs = list(zip(self._pieces, refits, strict=True))
        return Refit(
            baseline=np.concatenate([one.baseline for one in refits])[order],
            covariance=covariance[np.ix_(order, order)],
            parts=tuple(self._part(piece, part) for piece, one in pairs for part in one.parts),
            blocks=self._models([(self._blocks(piece), one.blocks) for piece, one in pairs]),
        )

    @staticmethod
    def _models(placed: Sequence[tuple[Sequence[int], Sequence[Array]]]) -> tuple[Array, ...]:
        found = {number: model for numbers, models in placed for number, model in zip(numbers, models, strict=True)}
        return tuple(found[number] for number in sorted(found))

    def _held_out(self) -> HeldOut:
        held = [one.held_out for one in self._found]
        places = [piece.blocks[1] for piece in self._pieces]
        return HeldOut(
            problem=self._problems[1],
            plain=self._refit([one.plain for one in held]),
            extended=self._refit([one.extended for one in held]),
            before=self._models([(place, one.before) for place, one in zip(places, held, strict=True)]),
            after=self._models([(place, one.after) for place, one in zip(places, held, strict=True)]),
        )


def _as_answered(found: Findings) -> Findings:
    """What nothing explains is left as it was without its causes, which are not believed."""
    if found.verdict.explains:
        return found
    held = found.held_out
    return replace(
        found,
        gap=replace(found.gap, after=found.gap.before),
        after=found.before,
        held_out=replace(held, extended=held.plain, after=held.before),
    )


def _pooled(gaps: Sequence[Gap]) -> Gap:
    """Of all samples together."""
    samples = np.array([gap.samples for gap in gaps], dtype=float)
    powers = np.array([(gap.before**2, gap.after**2, gap.floor**2) for gap in gaps])
    before, after, floor = np.sqrt(samples @ powers / max(float(samples.sum()), 1.0)).tolist()
    return Gap(before, after, floor, sum(gap.samples for gap in gaps))
