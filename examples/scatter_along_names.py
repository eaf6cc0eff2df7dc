"""Whether noise is what the diagnosis says: what chance tells along every name where nothing is lacking.

    quasiomni exam seal --out cases --first-seed 993000 --source emulator --engine pybullet --effects 0 --none 12 \
        --pairs 0 --laws 0 --unknown 0 --invisible 0 --faults 0
    python examples/scatter_along_names.py cases

Of the cases of an exam that lack nothing, diagnosed or not. Along a name, what the rows tell of it has a square of one
in units of the noise, in the mean over all names and cases; above it noise is told too small, below it too large. How
far rows scatter about it, stretch by stretch over the noise, is one in the mean, or what all other directions scatter;
beyond what few stretches do by chance the ratio of both has a spread of its own, an inverse chi-squared. The likeliest
degrees of freedom of that are to be compared with `BELIEVED` of `ident/diagnosis/evidence/misfit.py`. Names of a case
share rows: the likelihood counts them as if they did not. What acts mostly on rolling is told apart: its rows have a
tolerance.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from hil.exam.answer_file import open_cases, own_key
from hil.exam.cases import Kind
from hil.exam.diagnosing import both_records, descriptions
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.oracle import posed
from ident.diagnosis.evidence.misfit import Scatter, scatter_along
from ident.diagnosis.observations.linear import orthonormal
from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Channel
from ident.diagnosis.search.asked import Asked, asked_of
from ident.errors import UserError

Array = NDArray[np.float64]

FREEDOMS = (2, 4, 8, 16, 32, 64, 128)
"""Of the ratio beforehand, that are compared."""

CLASSES = (0.0, 4.0, 8.0, 16.0, math.inf)
"""Of degrees of freedom, that are reported apart."""

LEAST = 0.5
"""Degrees of freedom from which rows say something of their scatter."""

FAR = 30.0
"""Standard deviation of a coefficient beforehand, over that by the noise: rows tell all of it."""


@dataclass(frozen=True)
class Told:
    """What rows tell along a name.

    Attributes:
        square: of it, in units of the noise, over its number of coefficients.
        scatter: of the rows.
        rolls: whether it acts mostly on rolling.
    """

    square: float
    scatter: Scatter
    rolls: bool


def told_by(asked: Asked) -> Iterator[Told]:
    """Along every name that shows, each beside the parameters of the model alone."""
    design, fitter, regression = asked.design, asked.fitter, asked.regression
    stacked = np.column_stack([design.baseline, design.columns, design.target])
    white, width = fitter.nothing.evidence.noise.apply(regression.rows, stacked), design.baseline.shape[1]
    baseline, columns, target = white[:, :width], white[:, width:-1], white[:, -1]
    kinematic = np.zeros(len(target), dtype=np.bool_)
    for (block, _), place in zip(regression.rows.blocks, regression.rows.block_slices, strict=True):
        kinematic[place] = block.channel is Channel.KINEMATIC
    for number, one in enumerate(design.hypotheses):
        if one.free or number in fitter.invisible:
            continue
        shown = next(block for block in one.blocks if np.any(columns[:, block.place]))
        own = columns[:, shown.place]
        own = own * (FAR / np.maximum(np.linalg.norm(own, axis=0), np.finfo(float).tiny))
        rows, place = np.hstack([baseline, own]), slice(width, width + own.shape[1])
        known = np.zeros((0, rows.shape[1])), np.zeros(0)
        (scatter,) = scatter_along(rows, target, known, regression.stretch, [place])
        rolls = bool(np.sum(own[kinematic] ** 2) > np.sum(own[~kinematic] ** 2))
        yield Told(square_along(baseline, own, target), scatter, rolls)


def square_along(baseline: Array, own: Array, target: Array) -> float:
    """Of what rows tell along columns (n, k) beside others, whose coefficients have unit variance; over their rank."""
    width = baseline.shape[1]
    beside = orthonormal(np.vstack([baseline, np.eye(width)]))
    rest = np.vstack([np.column_stack([own, target]), np.zeros((width, own.shape[1] + 1))])
    left = rest - beside @ (beside.T @ rest)
    along = orthonormal(left[:, :-1]).T @ left[:, -1]
    return float(along @ along) / len(along)


def of_case(folder: ExamFolder, of_axes: bool, identifier: str) -> list[Told]:
    """What the records of a case tell."""
    fit, confirm = both_records(folder, identifier)
    texts = None if of_axes else descriptions(folder)
    return list(told_by(asked_of(with_orders(posed(fit, confirm, texts)))))


def likelihoods(scatters: Sequence[Scatter]) -> dict[int, float]:
    """Log likelihood of a ratio, in the mean over all, by degrees of freedom that are believed beforehand.

    Of ratios over those of all other directions, about their likeliest.
    """
    ratios = np.array([one.told / (one.expected * one.elsewhere) for one in scatters])
    freedom = np.array([one.freedom for one in scatters])

    def log(of: int, usual: float) -> float:
        return float(np.mean(stats.f.logpdf(ratios / np.exp(usual), freedom, of) - usual))

    found = {}
    for of in FREEDOMS:
        best = optimize.minimize_scalar(lambda usual, of=of: -log(of, usual), bounds=(-3.0, 3.0), method="bounded")
        found[of] = -float(best.fun)
    return found


def report(told: Sequence[Told]) -> Iterator[str]:
    """Squares along names, scatter about them, and the degrees of freedom that this speaks for."""
    for title, rolls in (("forces", False), ("rolling", True)):
        squares = np.array([one.square for one in told if one.rolls == rolls])
        if squares.size:
            most, least = np.quantile(squares, [0.99, 0.95])
            yield f"{title}: {len(squares)} squares, mean {squares.mean():.2f}, 95 % {least:.2f}, 99 % {most:.2f}"
    scatters = [one.scatter for one in told if not one.rolls and one.scatter.freedom > LEAST]
    for low, high in pairwise(CLASSES):
        some = [one for one in scatters if low <= one.freedom < high]
        if some:
            ratios, chance = [one.told / one.expected for one in some], np.mean([2 / one.freedom for one in some])
            yield (
                f"scatter of {low:g} to {high:g} degrees of freedom: {len(some)} ratios, mean {np.mean(ratios):.2f}, "
                f"variance {np.var(ratios):.2f} (by chance {chance:.2f})"
            )
    for of, log in likelihoods(scatters).items():
        yield f"{of} degrees of freedom beforehand: log likelihood of a ratio {log:.3f}"


def main() -> None:
    """Of all exams together."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exams", type=Path, nargs="+", help="whose answers are open, with cases that lack nothing")
    parser.add_argument("--key", type=Path, action="append", default=[], help="that an exam was sealed with")
    asked, told = parser.parse_args(), list[Told]()
    for folder in map(ExamFolder, asked.exams):
        exam = read_exam(folder)
        for case in open_cases(folder, own_key(folder, exam, asked.key)):
            if case.kind is Kind.NONE and folder.complete(case.identifier):
                try:
                    told += of_case(folder, exam.of_axes, case.identifier)
                except UserError as refused:
                    print(f"{case.identifier} is passed over: {refused}", file=sys.stderr)
    if not told:
        parser.error("none of these exams has records of a case that lacks nothing: seal one with --none 12")
    print("\n".join(report(told)))


if __name__ == "__main__":
    main()
