"""The spectrum of what rows leave over an angle, or over the angles of several equals (as Lomb 1976 has it over time).

Every row n has what it leaves, r_n, and for each of J equals an angle x_nj and a lever l_nj. At an order ω a wave of
unknown size and phase, the same for all equals, explains of the sum of squares

    2 |Σ_nj l_nj r_n exp(-i ω x_nj)|² / Σ_n |Σ_j l_nj exp(i ω x_nj)|²

Equals that turn together, as wheels mostly do, add up at some orders and cancel at others: the denominator says where.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PADDED: Final = 4
"""Points of a spectrum over its resolution."""

SHARE: Final = 0.1
"""Of the rows that must be slow enough for a wave over the angle to be within their bandwidth."""

MOST: Final = 2.0**17
"""Orders that are looked at, over the resolution: beyond them nothing but rows at rest is slow enough."""

FEWEST: Final = 2.0
"""Periods over the range of the angle below which a force is no ripple."""

SEEN: Final = 0.05
"""Power of equals together, over that of all by themselves, below which they cancel: bins are not exact to less."""


@dataclass(frozen=True)
class Turned:
    """Rows of which every one has an angle for each of J equals.

    Attributes:
        angles: (n, J).
        levers: (n, J) over the noise.
        left: (n,) over the noise.
        reach: (n, J) highest orders within the bandwidth [1/unit of the angle].
    """

    angles: Array
    levers: Array
    left: Array
    reach: Array


@dataclass(frozen=True)
class Periodogram:
    """A spectrum.

    Attributes:
        orders: (m,) [1/unit of the angle].
        explained: (m,) of the sum of squares; zero where nothing shows.
        resolution: of the orders.
        independent: how many orders are independent of each other.
    """

    orders: Array
    explained: Array
    resolution: float
    independent: float


def periodogram(rows: Turned) -> Periodogram | None:
    """The spectrum of some rows; None where they show no order at all."""
    acting = rows.levers != 0
    span, extent = float(np.ptp(rows.angles, axis=0).max()), float(np.ptp(rows.angles))
    if not acting.any() or not span > 0:
        return None
    # At rest any order is within the bandwidth.
    highest = min(float(np.quantile(rows.reach[acting], 1 - SHARE)), MOST * math.pi / extent)
    resolution = 2 * math.pi / span
    if highest < FEWEST * resolution:
        return None
    # Bins of a quarter of the shortest period: of waves that short they lose a quarter of the power.
    width = math.pi / (2 * highest)
    bins = np.round((rows.angles - rows.angles.min()) / width).astype(np.int64)
    length = int(2 ** math.ceil(math.log2(PADDED * (bins.max() + 1))))
    orders = 2 * math.pi * np.asarray(np.fft.rfftfreq(length, width), dtype=np.float64)
    summed = np.bincount(bins.ravel(), (rows.left[:, None] * rows.levers).ravel(), minlength=length)
    shown, together = _shown(rows, orders), _together(bins, rows.levers, length)
    usable = (orders >= FEWEST * resolution) & (orders <= highest) & (shown > 0) & (together > SEEN)
    explained = np.where(usable, 2 * np.abs(np.fft.rfft(summed)) ** 2, 0.0) / np.where(usable, shown * together, 1.0)
    return Periodogram(orders, explained, resolution, highest * extent / (2 * math.pi))


def _shown(rows: Turned, orders: Array) -> Array:
    """(m,) power of the levers of what is slow enough for every order."""
    reach, powers = rows.reach.ravel(), rows.levers.ravel() ** 2
    slow = np.argsort(reach)
    above = np.concatenate([np.cumsum(powers[slow][::-1])[::-1], [0.0]])
    return np.asarray(above[np.searchsorted(reach[slow], orders)])


def _together(bins: NDArray[np.int64], levers: Array, length: int) -> Array:
    """(m,) power of all equals together, over the sum of what each has by itself: one of a single one."""
    between = np.zeros(length)
    for one, other in combinations(range(levers.shape[1]), 2):
        apart = (bins[:, one] - bins[:, other]) % length
        between += np.bincount(apart, levers[:, one] * levers[:, other], minlength=length)
    return np.asarray(1 + 2 * np.fft.rfft(between).real / np.sum(levers**2))
