"""Products of columns of which some are replaced, and others integrated, without a copy of those of all.

They are large, and most of them are looked at by one hypothesis alone, or by none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Gram:
    """Products of columns and, last, of a target.

    Attributes:
        whole: (K + 1, K + 1) before anything is replaced.
        replaced: (m,) numbers of those that are, each once, in any order.
        rows: (m, K + 1) products of these with all, and with each other.
    """

    whole: Array
    replaced: Numbers
    rows: Array

    @staticmethod
    def of_all(whole: Array) -> Gram:
        """Nothing is replaced."""
        return Gram(whole, np.zeros(0, dtype=np.int64), np.zeros((0, len(whole))))

    def __len__(self) -> int:
        """Number of the columns, and the target."""
        return len(self.whole)

    def of(self, place: slice, other: slice) -> Array:
        """Products of the columns of one place with those of another; not to be written to."""
        found, rows, columns = self.whole[place, other], self._within(place), self._within(other)
        if rows.any() or columns.any():
            found = found.copy()
            found[self.replaced[rows] - place.start] = self.rows[rows, other]
            found[:, self.replaced[columns] - other.start] = self.rows[columns, place].T
        return found

    def columns(self, numbers: Numbers) -> Array:
        """(K + 1, r) products of all with some, rising."""
        found = self.whole[:, numbers]
        found[self.replaced] = self.rows[:, numbers]
        places, own = self._among(numbers)
        found[:, places] = self.rows[own].T
        return found

    def among(self, numbers: Numbers) -> Array:
        """(r, r) products of some, rising, with each other."""
        found = self.whole[np.ix_(numbers, numbers)]
        places, own = self._among(numbers)
        found[places] = self.rows[np.ix_(own, numbers)]
        found[:, places] = found[places].T
        return found

    @cached_property
    def target(self) -> Array:
        """(K + 1,) products with the target."""
        return self.columns(np.array([len(self) - 1]))[:, 0]

    @cached_property
    def diagonal(self) -> Array:
        """(K + 1,) powers."""
        found = np.array(np.diag(self.whole))
        found[self.replaced] = self.rows[np.arange(len(self.replaced)), self.replaced]
        return found

    def _within(self, place: slice) -> NDArray[np.bool_]:
        return np.asarray((self.replaced >= place.start) & (self.replaced < place.stop))

    def _among(self, numbers: Numbers) -> tuple[Numbers, Numbers]:
        """Where replaced ones stand among some, and which they are."""
        _, places, own = np.intersect1d(numbers, self.replaced, assume_unique=True, return_indices=True)
        return places, own


@dataclass(frozen=True)
class Beside:
    """Products of columns and of a target, without what independent directions of some members have of them.

    Attributes:
        gram: with the members.
        across: (K + 1, R) products with those directions, of unit variance.
        powers: (R,) of those.
    """

    gram: Gram
    across: Array
    powers: Array

    @staticmethod
    def beside_nothing(gram: Gram) -> Beside:
        """No members."""
        return Beside(gram, np.zeros((len(gram), 0)), np.zeros(0))

    def of(self, place: slice, other: slice) -> Array:
        """Products of the columns of one place with those of another."""
        return np.asarray(self.gram.of(place, other) - (self.across[place] / (1 + self.powers)) @ self.across[other].T)

    @cached_property
    def along(self) -> Array:
        """(K + 1,) products of all columns with the target."""
        return np.asarray(self.gram.target - (self.across / (1 + self.powers)) @ self.across[-1])

    @cached_property
    def untouched(self) -> NDArray[np.bool_]:
        """(K + 1,) columns of which the directions have nothing, neither replaced nor of another target."""
        found = ~self.across.any(axis=1) & (self.gram.target == self.gram.whole[:, -1])
        found[self.gram.replaced] = False
        return np.asarray(found)

    @cached_property
    def diagonal(self) -> Array:
        """(K + 1,) powers."""
        return np.asarray(self.gram.diagonal - np.sum(self.across**2 / (1 + self.powers), axis=1))
