"""What rows say of a cause alone: partial residuals over the variable that the cause is a function of.

A cause that adds L[g f(x)] to a row, L the filter of the rows and g what the function f stands with there (a lever, the
direction), is asked for f by (target - all else)/L[g], at the x = L[g x]/L[g] at which its part of the row lies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.axis.functions import function_of
from ident.diagnosis.check.remainder import noise_floors
from ident.diagnosis.dependence import Basis, Dependence
from ident.diagnosis.observations.rows import Rows, make_rows
from ident.diagnosis.problem import Block, Problem
from ident.report.sketch import joint_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPREAD: Final = 0.04
"""Of the variable within what the cause adds to one row, over its whole range, up to which the row is at one value."""

NOISIEST: Final = 3.0
"""Times the noise of the better points (their lowest fifth) up to which a point is drawn."""

SEEN: Final = 1e-9
"""Of what a function stands with, over the largest, below which a row says nothing."""

BINS: Final = 60
"""Groups of neighbours over the variable in which what a cause adds is averaged."""

GAP: Final = 0.06
"""Of the range of the variable, without points, over which no curve is drawn."""

SCATTERED: Final = 0.03
"""Share of the power of what a cause adds, up to which it may be no function of the variable."""

FEWEST: Final = 30
"""Points that a curve needs."""


@dataclass(frozen=True)
class Points:
    """Partial residuals of n rows.

    Attributes:
        dependence: of which function the cause is one.
        x, y: (n,) variable, and what is left without the cause over what it stands with, in the units of `dependence`.
        added: (n,) the same of what the cause adds.
        noise: (n,) standard deviation of y.
        confirming: (n,) rows of the records that confirm.
    """

    dependence: Dependence
    x: Array
    y: Array
    added: Array
    noise: Array
    confirming: Mask

    def only(self, chosen: Mask) -> Points:
        """Some of them."""
        x, y, added, noise = (series[chosen] for series in (self.x, self.y, self.added, self.noise))
        return Points(self.dependence, x, y, added, noise, self.confirming[chosen])


def law_points(findings: Findings, cause: Cause) -> Points | None:
    """Of a law without a name; None where too few rows are at one value of its variable."""
    if cause.law is None:
        return None
    fitted, confirming = (one.dependences[cause.law.index] for one in (findings.problem, findings.held_out.problem))
    return _points(findings, cause, (fitted, confirming))


def effect_points(findings: Findings, cause: Cause) -> Points | None:
    """Of a named effect that is a function of one variable in these rows; None where it is none."""
    over = function_of(str(cause.candidate.effect))
    if over is None or cause.law is not None:
        return None
    places = _joints(cause.candidate.where)
    tried = [
        _points(findings, cause, pair)
        for pair in zip(findings.problem.dependences, findings.held_out.problem.dependences, strict=True)
        if (pair[0].variable, pair[0].partner) == over and pair[0].where in places
    ]
    made = [(scattered(points), points) for points in tried if points is not None]
    share, best = min(made, key=lambda one: one[0], default=(1.0, None))
    return best if share < SCATTERED else None


def averaged(x: Array, y: Array) -> tuple[Array, Array]:
    """Means (m,) of as many neighbours over the variable as make BINS groups, a NaN wherever nothing is known of it."""
    order = np.argsort(x)
    far = np.diff(x[order], prepend=x[order[0]]) > GAP * float(np.ptp(x))
    group = _groups(far)
    centres, means = _means(x[order], group), _means(y[order], group)
    breaks = np.flatnonzero(far[np.flatnonzero(np.diff(group, prepend=-1))])
    return np.insert(centres, breaks, np.nan), np.insert(means, breaks, np.nan)


def scattered(points: Points) -> float:
    """Share of the power of what a cause adds that is no function of the variable."""
    added = points.added[np.argsort(points.x)]
    group = _groups(np.zeros(len(added), dtype=bool))
    power = float(np.mean(added**2))
    return float(np.mean((added - _means(added, group)[group]) ** 2)) / power if power > 0 else 1.0


def _groups(far: Mask) -> NDArray[np.int64]:
    """Number (n,) of the group of each of n points in order; a new one begins at every gap too."""
    count = len(far)
    begins = np.diff(np.arange(count) * BINS // count, prepend=-1) > 0
    return np.asarray(np.cumsum(begins | far) - 1)


def _means(values: Array, group: NDArray[np.int64]) -> Array:
    return np.asarray(np.bincount(group, weights=values) / np.bincount(group))


def _joints(where: str) -> tuple[str, ...]:
    """Where the function of an effect stands: a drive turns its wheel."""
    joint = joint_of(where)
    return joint, joint.replace("drive", "wheel")


def _rows(*problems: Problem) -> Rows:
    """All samples that rows are taken from, not only every n-th: here they are looked at, not counted."""
    return make_rows(*(replace(one, candidates=(), blocks=tuple(map(_whole, one.blocks))) for one in problems))


def _whole(block: Block) -> Block:
    return replace(block, bandwidth=np.inf)


def _points(findings: Findings, cause: Cause, pair: tuple[Dependence, Dependence]) -> Points | None:
    """Of all rows, repeats averaged."""
    rows = _rows(findings.problem, findings.held_out.problem)
    models, period = findings.after.blocks, pair[0].period
    moments = rows.stack([one for part in pair for one in part.design(_moments(period))], 3)
    added = rows.stack(cause.part.added)
    left = rows.target - rows.stack(list(models))
    lever = np.abs(moments[:, 0])
    used = lever > SEEN * float(lever.max(initial=0.0))
    if not used.any():
        return None
    moments = moments[used]
    without, alone = (one[used] / moments[:, 0] for one in (left + added, added))
    x, spread = _places(moments, period)
    noise = _noise(rows, noise_floors(rows, models, left))[used] / np.abs(moments[:, 0])
    single = spread <= SPREAD * (period or float(np.ptp(x)))
    return _clear(Points(pair[0], x, without, alone, noise, rows.confirming[used]), single)


def _noise(rows: Rows, floors: Array) -> Array:
    """Standard deviation (n,) of every row, from that of every block."""
    found = np.zeros(len(rows))
    for floor, (_, kept), place in zip(floors.tolist(), rows.blocks, rows.block_slices, strict=True):
        found[place] = floor / np.sqrt(len(kept.samples))
    return found


def _clear(points: Points, single: Mask) -> Points | None:
    """Those at one value of the variable that noise does not hide."""
    if single.sum() < FEWEST:
        return None
    limit = NOISIEST * float(np.quantile(points.noise[single], 0.2))
    chosen = points.only(single & (points.noise <= limit))
    return chosen if len(chosen.x) >= FEWEST else None


def _moments(period: float) -> Basis:
    """One, the variable and its square; of one that comes around cosine and sine of its turns."""

    def powers(x: Array) -> Array:
        return np.stack([np.ones_like(x), x, x**2], axis=-1)

    def turns(x: Array) -> Array:
        angle = 2 * np.pi * x / period
        return np.stack([np.ones_like(x), np.cos(angle), np.sin(angle)], axis=-1)

    return turns if period else powers


def _places(moments: Array, period: float) -> tuple[Array, Array]:
    """Where what a cause adds to a row lies over its variable (n,), and how far it is spread (n,)."""
    first, second = moments[:, 1] / moments[:, 0], moments[:, 2] / moments[:, 0]
    if not period:
        return first, np.sqrt(np.abs(second - first**2))
    angle = np.mod(np.arctan2(second, first), 2 * np.pi)
    return period * angle / (2 * np.pi), period / (2 * np.pi) * np.sqrt(2 * np.abs(1 - np.hypot(first, second)))
