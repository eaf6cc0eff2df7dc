"""Products of white columns: the evidence with every noise is algebra of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.hypotheses.hypotheses import Design
from ident.diagnosis.noise.colours import Colours, Sizes

Array = NDArray[np.float64]


class Products:
    """Products of white columns: every noise is made of those of its labels.

    Args:
        design: of the rows.
        colours: of their noise.
        columns: (k,) of the design, rising; all of them, or those of a few hypotheses.
    """

    def __init__(self, design: Design, colours: Colours, columns: NDArray[np.int64]) -> None:
        self.design, self.colours, self.columns = design, colours, columns
        self._stacked = np.column_stack([design.baseline, design.columns[:, columns], design.target])
        self._acting = tuple(np.flatnonzero(self._stacked[rows].any(axis=0)) for rows in colours.rows_of_labels)
        # One for each label: those of all columns are large, and the next noise differs in a few labels.
        self._of = lru_cache(maxsize=len(colours.labels))(self._made)

    def at(self, place: slice) -> slice:
        """Where columns of the design stand among these, which must have them."""
        found = among(self.columns, place)
        assert self.columns[found.start] == place.start
        return found

    def summed(self, sizes: Sizes) -> tuple[Array, float]:
        """(p + k + 1, p + k + 1), the target last, and half the log of the determinant of the noise."""
        width = self._stacked.shape[1]
        whole, volume = np.zeros((width, width)), 0.0
        for label, size in enumerate(sizes):
            part, more = self._of(label, size)
            whole[np.ix_(self._acting[label], self._acting[label])] += part
            volume += more
        return whole, volume

    def with_others(self, sizes: Sizes, others: Array) -> tuple[Array, Array]:
        """(p + k + 1, r) products of all columns and the target with others (n, r), and (r, r) of these."""
        weighted = self.colours.weighted(sizes, others)
        return self._stacked.T @ weighted, others.T @ weighted

    def _made(self, label: int, size: int) -> tuple[Array, float]:
        """The same of one label, of the columns that act in its rows: a cause is at one place, and in some steps."""
        white, volume = self.colours.of_label(label, size, self._stacked[:, self._acting[label]])
        return white.T @ white, volume


def numbers_of(place: slice) -> NDArray[np.int64]:
    """Numbers of the columns of a place."""
    return np.arange(place.start, place.stop)


def among(columns: NDArray[np.int64], place: slice) -> slice:
    """Where columns stand among some, that hold them side by side."""
    first = int(np.searchsorted(columns, place.start))
    return slice(first, first + place.stop - place.start)
