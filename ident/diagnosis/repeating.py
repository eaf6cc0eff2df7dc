"""What a model leaves and repeats in every record: how much of it there is, and whether noise could do that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.chance import chances
from ident.diagnosis.limits import Limits
from ident.diagnosis.remainder import lasting, mostly_tolerated
from ident.diagnosis.rows import Rows

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Repeating:
    """What repeats of the difference of rows and a model.

    Attributes:
        rows: of the records.
        floors: rms of the noise of every block.
        models: of every block's target, (N,).
        limits: thresholds.
        stricter: whether that beside effects counts, not that of the model alone.
    """

    rows: Rows
    floors: Array
    models: Sequence[Array]
    limits: Limits
    stricter: bool

    @cached_property
    def sizes(self) -> Mapping[str, float]:
        """Rms over the noise, by coordinate."""
        return lasting(self.rows, self.floors, self.models)

    @property
    def most(self) -> float:
        """The largest, in units of what may repeat."""
        return max(self._excesses.values(), default=0.0)

    @property
    def above(self) -> Mapping[str, float]:
        """Sizes by coordinate, where more repeats than may, and that is no accident of the noise."""
        large = {label for label, excess in self._excesses.items() if excess > 1}
        return {label: self.sizes[label] for label in large & self._no_accidents} if large else {}

    @property
    def surely(self) -> bool:
        """Whether more repeats than may, in a coordinate in which it is no accident of the noise."""
        return bool(self.above)

    @property
    def by_no_accident(self) -> bool:
        """Whether something repeats in some coordinate, however little, that noise does not explain."""
        return any(self.sizes.get(label, 0.0) > 0 for label in self._no_accidents)

    @cached_property
    def _no_accidents(self) -> frozenset[str]:
        found = chances(self.rows, self.floors, self.models)
        return frozenset(label for label, chance in found.items() if chance * len(found) < self.limits.chance)

    @cached_property
    def _excesses(self) -> Mapping[str, float]:
        """What repeats, by coordinate, in units of what may."""
        blocks = zip(self.rows.blocks, self.floors, strict=True)
        creeping = {block.label for (block, _), floor in blocks if mostly_tolerated(block, floor)}
        usual = self.limits.beside if self.stricter else self.limits.repeating
        return {
            label: size / (self.limits.creeping if label in creeping else usual) for label, size in self.sizes.items()
        }
