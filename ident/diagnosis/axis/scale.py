"""What the candidates of an axis are scaled by, and by how much sampling makes its motion late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.delays import HELD
from ident.records.rates import nominal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """What the candidates of one axis are scaled by, found from the records of the fit.

    Attributes:
        values: own baseline parameters of the axis, a first estimate.
        speed: of which the axis is seldom faster [m/s or rad/s].
        slowest: than which it is seldom slower in a row [m/s or rad/s].
        nearest: path since a reversal within which few rows are: what is over by then, none can bound [m or rad].
        reach: range of its position [m or rad].
        hold: sample intervals by which its efforts are moved: by which its motion follows them, a first estimate, if
            sampling can be why. An effort that is held over the interval acts half of one late.
        late: by how much longer its motion follows [s].
        noise: power density of what the first estimate leaves of the rows, one-sided [N² or (Nm)², per Hz].
        holds: by how many intervals it follows in records that confirm at another rate, by nominal sample time [s]: a
            position may be read at another part of those.
        delayed: whether that is a cause of its own; else how late sampling makes it is a parameter of the baseline.
    """

    values: Array
    speed: float
    slowest: float
    nearest: float
    reach: float
    hold: float
    late: float
    noise: float
    holds: Mapping[float, float] = field(default_factory=dict)
    delayed: bool = False

    def hold_at(self, sample_time: float) -> float:
        """The hold of records of a sample time [s], in such intervals: what differs at another rate may be sampling."""
        own = self.holds.get(nominal(sample_time))
        if own is None:
            return self.hold
        beyond = own - self.late / sample_time
        return beyond if abs(beyond) <= HELD else 0.0
