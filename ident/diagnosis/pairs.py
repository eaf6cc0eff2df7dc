"""Pairs of causes: a delay and a shape at low speed can each be useless alone, and large together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.directions import VISIBLE
from ident.diagnosis.evidence import Evidence, significance

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

AT_ONCE: Final = 400
"""Pairs whose directions are turned together."""


@dataclass(frozen=True)
class PairEvidence:
    """The best pair of variants, and how probable so good a pair is by chance."""

    first: int
    second: int
    log_evidence: float
    significance: float


@dataclass(frozen=True)
class _Pairs:
    """Pairs of the same number of directions each.

    Attributes:
        variants: (P, 2).
        picked: (P, d) their directions.
        turns: (P, d, d) orthonormal directions of the two together; zeros for those that depend on the others.
        scale, price: (P,) of their evidence.
    """

    variants: Indices
    picked: Indices
    turns: Array
    scale: Array
    price: Array

    def log_evidence(self, evidence: Evidence) -> Array:
        """Of each pair (P,), -inf where one of the two would be smaller than it can be."""
        found = evidence.directions
        turned = np.einsum("pd,pde->pe", evidence.amplitudes[self.picked], self.turns)
        sizes = np.zeros((len(self.picked), len(found.least)))
        np.put_along_axis(sizes, self.picked, np.einsum("pde,pe->pd", self.turns, turned), axis=1)
        possible = np.take_along_axis(found.possible(sizes), self.picked, axis=1).all(axis=1)
        return np.where(possible, self._from(turned), -np.inf)

    def by_chance(self, evidence: Evidence) -> Array:
        """Largest log evidence of any of them in each surrogate (M,)."""
        largest = np.full(len(evidence.surrogates), -np.inf)
        for start in range(0, len(self.picked), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            turned = np.einsum("mpd,pde->mpe", evidence.surrogates[:, self.picked[part]], self.turns[part])
            found = 0.5 * np.sum(turned**2, axis=-1) / self.scale[part] - self.price[part]
            largest = np.maximum(largest, found.max(axis=1))
        return largest

    def _from(self, turned: Array) -> Array:
        return np.asarray(0.5 * np.sum(turned**2, axis=-1) / self.scale - self.price)


def best_pair(evidence: Evidence, owners: Sequence[int], rows: int) -> PairEvidence | None:
    """The pair of variants of two candidates with the largest joint evidence; None where no two are visible."""
    groups = list(_pairs(evidence, owners, rows))
    if not groups:
        return None
    found = [pairs.log_evidence(evidence) for pairs in groups]
    best, place = max((float(values.max()), -group) for group, values in enumerate(found))
    if best == -np.inf:
        return None
    group = -place
    first, second = groups[group].variants[int(np.argmax(found[group]))].tolist()
    by_chance = np.max([pairs.by_chance(evidence) for pairs in groups], axis=0)
    return PairEvidence(first, second, best, significance(best, by_chance))


def _pairs(evidence: Evidence, owners: Sequence[int], rows: int) -> Iterator[_Pairs]:
    """All visible pairs of two candidates, by number of directions."""
    visible = np.flatnonzero(np.isfinite(evidence.log_evidence)).tolist()
    own = [list(range(place.start, place.stop)) for place in evidence.directions.places]
    pairs = [pair for pair in combinations(visible, 2) if owners[pair[0]] != owners[pair[1]]]
    gram = evidence.directions.basis.T @ evidence.directions.basis

    def directions_of(pair: tuple[int, int]) -> int:
        return len(own[pair[0]]) + len(own[pair[1]])

    for _, group in groupby(sorted(pairs, key=directions_of), key=directions_of):
        variants = np.array(list(group), dtype=np.int64)
        picked = np.array([own[first] + own[second] for first, second in variants.tolist()], dtype=np.int64)
        values, vectors = np.linalg.eigh(gram[picked[:, :, None], picked[:, None, :]])
        kept = values > VISIBLE
        turns = vectors * np.where(kept, 1 / np.sqrt(np.where(kept, values, 1.0)), 0.0)[:, None, :]
        price = 0.5 * kept.sum(axis=1) * math.log(rows)
        yield _Pairs(variants, picked, turns, evidence.scale[variants].max(axis=1), price)
