"""Rows of many columns that change slowly: means over a few samples, and then the filter at the rows alone.

A free function of the motion has dozens of columns, each of which would pass the filter sample by sample for the sake
of one row in ten or more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.sources import Source
from ident.estimate.filters import FILTER_ORDER, filter_weights

Array = NDArray[np.float64]

MEANS: Final = 2.0
"""Means in the time of the filter, 1/cutoff: of a wave that would pass for one of the cutoff they leave a tenth."""

FORGOTTEN: Final = 14.0
"""Time constants of the filter after which e^-10 is left of a sample."""


@dataclass(frozen=True)
class Coarse:
    """The filter of a source for columns that are made here alone.

    Attributes:
        source: whose rows.
        cutoff: of the filter [rad/s].
    """

    source: Source
    cutoff: float

    @cached_property
    def _block(self) -> int:
        """Samples of a mean."""
        return max(1, math.floor(1 / (MEANS * self.cutoff * self.source.sample_time)))

    @cached_property
    def _weights(self) -> Any:
        """(n, B) of the means in the rows."""
        dt, length = self.source.sample_time, len(self.source.inputs)
        moments = np.asarray((np.arange(0, length, self.source.factor) + 0.5) * dt, dtype=np.float64)

        def gain(frequency: Array) -> Array:
            # A mean over an interval has weakened a wave by this much already.
            weakened = np.sinc(frequency * self._block * dt / (2 * np.pi))
            return np.asarray(1 / (1 + (frequency / self.cutoff) ** (2 * FILTER_ORDER)) / weakened)

        memory = FORGOTTEN / self.cutoff
        return filter_weights(gain, memory, moments, length // self._block, self._block * dt)

    def rows(self, parts: Sequence[tuple[Array, Array]]) -> Array:
        """(n, K) of the sum of factors (M,) times columns (M, K)."""
        block, whole = self._block, len(self.source.inputs) // self._block * self._block
        means = sum(
            np.einsum(
                "mb,mbk->mk", factor[:whole].reshape(-1, block), columns[:whole].reshape(-1, block, columns.shape[1])
            )
            for factor, columns in parts
        )
        return np.asarray(self._weights @ means) / block
