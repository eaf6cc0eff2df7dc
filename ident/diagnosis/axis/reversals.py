"""What an axis does while it may stick, which no model says, weighed out of the rows before and behind it.

Where an axis reverses, dry friction turns within a sample, or holds it for a while and is then whatever is needed. Rows
there are left out. But rows are filtered, and of a filter of fourth order a fifth of a step is still there after four
of its time constants: a friction that turns half a millisecond early, between two samples, is seen from there and looks
like a spring. How early or late it may turn is known: as long as the axis may stick. So an impulse when that begins,
and one when it ends, are random effects of a known size, and what rows have of them is weighed down accordingly.

So is an impulse at either end of the record: beyond it the terms of the equation go on as in a mirror, in which the
motion turns round, and not every term of it turns in the same way: the inertia's part is not there at all, and that of
a load behind a spring has a slope that breaks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

UNKNOWN: Final = 1e6
"""Deviation of an impulse over the noise from which it is unknown altogether; rounding counts beyond."""

MEMORY: Final = 25.0
"""Time constants of the rows' filter after which nothing is left of an impulse."""


@dataclass(frozen=True)
class Untold:
    """Random impulses, and the weighing that takes them out.

    Attributes:
        impulses: (N, k) filtered, in units of their deviation over that of the noise, zero in rows that are not used;
            None: there are none.
        solve: (k, ...) -> (k, ...) by the matrix of their products, and one.
    """

    impulses: Any = None
    solve: Callable[[Array], Array] | None = None

    def without(self, values: Array) -> Array:
        """Values (N,) or (N, m) without what such impulses are likely to be of them, where rows are used."""
        if self.solve is None:
            return values
        return np.asarray(values - self.impulses @ self.solve(self.impulses.T @ values))


@dataclass(frozen=True)
class Sticking:
    """Where and how an axis may stick.

    Attributes:
        where: (N,) samples.
        friction: that turns there [N or Nm].
        noise: of the effort, of a sample [N or Nm].
        blur: samples over which the velocity that says where has been smoothed.
        ends: deviation of an impulse at either end of the record [N or Nm, times samples].
    """

    where: Mask
    friction: float
    noise: float
    blur: float
    ends: float


def untold_while_sticking(
    sticking: Sticking, moving: Mask, filtered: Callable[[Array], Array], memory: float
) -> Untold:
    """The impulses of one axis of one record.

    Args:
        sticking: where it may stick.
        moving: (N,) rows that are used.
        filtered: passes (N,) through the filter of the rows.
        memory: time constant of that, in samples.
    """
    reach = round(MEMORY * memory)
    unit = np.zeros(2 * reach + 1)
    unit[reach] = 1.0
    response = filtered(unit)
    # Uniform over the time that it may turn in, half of it at either end.
    turns = [
        (at, 2 * abs(sticking.friction) * (samples + sticking.blur) / math.sqrt(24))
        for at, samples in _ends(sticking.where)
    ]
    found = []
    for at, deviation in [*turns, (0, sticking.ends), (len(moving) - 1, sticking.ends)]:
        first, last = max(at - reach, 0), min(at + reach + 1, len(moving))
        seen = np.where(moving[first:last], response[first - at + reach : last - at + reach], 0.0)
        found.append((np.arange(first, last), seen * min(deviation / sticking.noise, UNKNOWN)))
    rows = np.concatenate([places for places, _ in found])
    columns = np.repeat(np.arange(len(found)), [len(places) for places, _ in found])
    values = np.concatenate([seen for _, seen in found])
    impulses = sparse.csr_matrix((values, (rows, columns)), shape=(len(moving), len(found)))
    return Untold(impulses, linalg.factorized((impulses.T @ impulses + sparse.identity(len(found))).tocsc()))


def turned_round(speed: float, inertia: float, sample_time: float) -> float:
    """Deviation of the impulse at an end of a record, where the motion turns round: twice its momentum.

    Args:
        speed: of the motion that turns, or of what is not known of it [m/s or rad/s].
        inertia: [kg or kg m²].
        sample_time: [s].

    Returns:
        Force or torque times samples [N or Nm].
    """
    return 2 * abs(inertia) * speed / sample_time


def _ends(where: Mask) -> Iterator[tuple[int, int]]:
    """First and last sample of every stretch, and the samples within which it may turn."""
    change = np.diff(where.astype(np.int8), prepend=0, append=0)
    for start, stop in zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0), strict=True):
        for at in (start, stop - 1):
            yield int(at), int(stop - start) + 1
