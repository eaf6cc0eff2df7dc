"""Whether noise is what the diagnosis says: what chance tells along every name beside what is there.

    quasiomni exam seal --out cases --first-seed 993000 --source emulator --engine pybullet --effects 12 --none 12 \
        --pairs 0 --laws 0 --unknown 0 --invisible 0 --faults 0
    python examples/scatter_along_names.py cases

Of the cases of an exam that lack nothing, or the one effect that their answer says, diagnosed or not. Along every other
name, what the rows tell of it has a square of one in units of the noise, in the mean over all names and cases; above it
noise is told too small, below it too large. By how far rows scatter along a name, stretch by stretch over the noise,
evidence is tempered: squares are as large as that where it is right. How much of it is believed is what makes them the
likeliest (`BELIEVED` of `ident/diagnosis/evidence/misfit.py`). Names of a case share rows: the likelihood counts them
as if they did not. What acts mostly on rolling is told apart: its rows have a tolerance.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.exam.answer_file import open_cases, own_key
from hil.exam.cases import Case, Kind
from hil.exam.diagnosing import both_records, descriptions
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.oracle import posed
from ident.diagnosis.evidence.misfit import Scatter, scatter_along
from ident.diagnosis.evidence.state import State
from ident.diagnosis.observations.linear import orthonormal, with_known
from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Channel
from ident.diagnosis.search.asked import Asked, asked_of
from ident.errors import UserError

Array = NDArray[np.float64]

FREEDOMS = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""Believed beforehand, that are compared."""

PARTS = 5
"""Of all names, by how far rows scatter along them, that are reported apart."""

FAR = 30.0
"""Standard deviation of a coefficient beforehand, over that by the noise: rows tell all of it."""


@dataclass(frozen=True)
class Told:
    """What rows tell along a name.

    Attributes:
        square: of it, in units of the noise, over the rank.
        rank: how many coefficients it has.
        scatter: of the rows.
        rolls: whether it acts mostly on rolling.
    """

    square: float
    rank: int
    scatter: Scatter
    rolls: bool


def told_by(asked: Asked, there: Collection[str] = ()) -> Iterator[Told]:
    """Along every name that shows, and is not the same as what is there (keys), each beside that and the parameters.

    Raises:
        UserError: what is there is no candidate, or does not show.
    """
    design, fitter, regression = asked.design, asked.fitter, asked.regression
    state = fitter.among_all(_with(asked, there))
    columns, target, (known, wanted) = fitter.rows_of(state)
    width = columns.shape[1]
    white = state.evidence.noise.apply(regression.rows, np.column_stack([columns, design.columns, target]))
    columns, names, target = white[:, :width], white[:, width:-1], white[:, -1]
    kinematic = np.zeros(len(target), dtype=np.bool_)
    for (block, _), place in zip(regression.rows.blocks, regression.rows.block_slices, strict=True):
        kinematic[place] = block.channel is Channel.KINEMATIC
    for number in state.tables():
        one = design.hypotheses[number]
        shown = next((block for block in one.blocks if np.any(names[:, block.place])), None)
        if one.free or number in fitter.invisible or shown is None:
            continue
        own = names[:, shown.place]
        own = own * (FAR / np.maximum(np.linalg.norm(own, axis=0), np.finfo(float).tiny))
        place, beside = slice(width, width + own.shape[1]), np.hstack([known, np.zeros((len(known), own.shape[1]))])
        (scatter,) = scatter_along(np.hstack([columns, own]), target, (beside, wanted), regression.stretch, [place])
        square, rank = square_along(columns, own, target, (known, wanted))
        rolls = bool(np.sum(own[kinematic] ** 2) > np.sum(own[~kinematic] ** 2))
        yield Told(square, rank, scatter, rolls)


def _with(asked: Asked, there: Collection[str]) -> State:
    """What is there, fitted with the noise that it leaves."""
    state, keys = asked.fitter.nothing, {one.key: number for number, one in enumerate(asked.design.hypotheses)}
    for key in there:
        table = asked.fitter.among_all(state).tables().get(keys.get(key, -1))
        if table is None or not table.is_there:
            raise UserError(f"{key} does not show in these records", "Such a case says nothing of noise: leave it out.")
        state = asked.fitter.state({**state.members, keys[key]: table.best}, state)
    return state


def square_along(columns: Array, own: Array, target: Array, known: tuple[Array, Array]) -> tuple[float, int]:
    """Of what rows tell along some columns (n, k) over their rank, and this; arguments as for `scatter_along`.

    Beside others, which have coefficients of unit variance.
    """
    rows, wanted = with_known(columns, target, known)
    beside, padded = orthonormal(rows), np.zeros((len(rows), own.shape[1]))
    padded[: len(own)] = own
    rest = np.column_stack([padded, wanted])
    left = rest - beside @ (beside.T @ rest)
    along = orthonormal(left[:, :-1]).T @ left[:, -1]
    return float(along @ along) / len(along), len(along)


def of_case(folder: ExamFolder, of_axes: bool, case: Case) -> list[Told]:
    """What the records of a case tell, beside what is there."""
    fit, confirm = both_records(folder, case.identifier)
    texts = None if of_axes else descriptions(folder)
    there = {f"{one.name}@{one.where}" for one in case.effects}
    return list(told_by(asked_of(with_orders(posed(fit, confirm, texts))), there))


def likelihood(told: Sequence[Told], freedom: float) -> float:
    """Log likelihood of a square, in the mean over all, by degrees of freedom that are believed beforehand."""
    variance = np.array([one.scatter.variance(freedom) for one in told])
    squares, ranks = np.array([one.square for one in told]), np.array([one.rank for one in told])
    return -0.5 * float(np.average(squares / variance + np.log(2 * np.pi * variance), weights=ranks))


def report(told: Sequence[Told]) -> Iterator[str]:
    """Squares along names, how far rows scatter about them, and the degrees of freedom that this speaks for."""
    for title, rolls in (("forces", False), ("rolling", True)):
        squares = np.array([one.square for one in told if one.rolls == rolls])
        if squares.size:
            most, least = np.quantile(squares, [0.99, 0.95])
            yield f"{title}: {len(squares)} squares, mean {squares.mean():.2f}, 95 % {least:.2f}, 99 % {most:.2f}"
    forces = sorted((one for one in told if not one.rolls), key=lambda one: one.scatter.excess)
    for part in filter(len, np.array_split(np.arange(len(forces)), PARTS)):
        scatter = np.mean([forces[number].scatter.excess for number in part])
        square = np.mean([forces[number].square for number in part])
        yield f"forces believed to scatter {scatter:.2f} times as their noise says: mean {square:.2f}"
    for freedom in FREEDOMS if forces else ():
        yield f"{freedom:g} degrees of freedom beforehand: log likelihood of a square {likelihood(forces, freedom):.3f}"


def main() -> None:
    """Of all exams together."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exams", type=Path, nargs="+", help="whose answers are open")
    parser.add_argument("--key", type=Path, action="append", default=[], help="that an exam was sealed with")
    asked, told = parser.parse_args(), list[Told]()
    for folder in map(ExamFolder, asked.exams):
        exam = read_exam(folder)
        for case in open_cases(folder, own_key(folder, exam, asked.key)):
            if case.kind in (Kind.NONE, Kind.EFFECT) and folder.complete(case.identifier):
                try:
                    told += of_case(folder, exam.of_axes, case)
                except UserError as refused:
                    print(f"{case.identifier} is passed over: {refused}", file=sys.stderr)
    if not told:
        parser.error("none of these exams has records of a case with one effect or none: seal one with --none 12")
    print("\n".join(report(told)))


if __name__ == "__main__":
    main()
