"""What the candidates of an axis are scaled by, and by how much sampling makes its motion late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.records.rates import nominal

Array = NDArray[np.float64]

LARGEST_HOLD: Final = 1.0
"""Sample intervals up to which a first estimate of the lag may be what sampling does; other effects shift it."""


@dataclass(frozen=True)
class Scale:
    """What the candidates of one axis are scaled by, found from the records of the fit.

    Attributes:
        values: own baseline parameters of the axis, a first estimate.
        speed: of which the axis is seldom faster [m/s or rad/s].
        slowest: than which it is seldom slower in a row [m/s or rad/s].
        nearest: path since a reversal within which few rows are: what is over by then, none can bound [m or rad].
        reach: range of its position [m or rad].
        hold: sample intervals by which its motion follows its effort as recorded, if sampling can be why: an effort
            that is held over the interval acts half of one late. None: longer, and a cause of its own.
        holds: by how many their motion follows in records that confirm at another rate, by nominal sample time [s]: a
            position may be read at another part of those intervals.
        lag: the same as a time, a first estimate [s].
        noise: power density of what the first estimate leaves of the rows, one-sided [N² or (Nm)², per Hz].
    """

    values: Array
    speed: float
    slowest: float
    nearest: float
    reach: float
    hold: float | None
    lag: float
    noise: float
    holds: Mapping[float, float] = field(default_factory=dict)

    def hold_at(self, sample_time: float) -> float | None:
        """The hold of records of a sample time [s], in such intervals.

        Where the motion is later than sampling can explain, that is left to a cause, and what differs at another rate
        is sampling, if it can be.
        """
        own = self.holds.get(nominal(sample_time))
        if self.hold is not None or own is None:
            return self.hold if own is None else own
        beyond = own - self.lag / sample_time
        return beyond if abs(beyond) <= LARGEST_HOLD else None
