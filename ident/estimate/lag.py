"""How late the torques of a record act, from what a fit leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.estimate.uncertainty import FittedRows, error_covariance
from ident.records.rates import nominal
from ident.vehicle.lag import Lag

Array = NDArray[np.float64]


def lag_of(parts: Sequence[FittedRows], growth: Sequence[Array]) -> Lag | None:
    """By how much all torques act later than recorded, if Θ p = τ of the moment at which they act.

    To first order the residual has lag times the growth of τ, less what the fit has taken of that. Least squares of the
    one on the other; None where samples have several intervals, nothing is left of the growth, or
    nothing that would tell how well it is known.

    Args:
        parts: the fitted rows; what is dropped has no influence.
        growth: (N,) of τ with time in every part, filtered as the rows are [Nm/s or N/s].
    """
    intervals = [part.sample_time for part in parts]
    if len({nominal(interval) for interval in intervals}) > 1:
        return None
    pairs = list(zip(parts, growth, strict=True))
    taken = np.sum([part.influence.T @ grown for part, grown in pairs], axis=0)
    left = [np.where(part.kept, grown - part.regressor @ taken, 0.0) for part, grown in pairs]
    power = float(np.sum([one @ one for one in left]))
    if power == 0:
        return None
    value = float(np.sum([one @ part.residual for part, one in zip(parts, left, strict=True)])) / power
    through = np.sum([part.regressor.T @ one for part, one in zip(parts, left, strict=True)], axis=0) / power
    fitted = [
        FittedRows(
            regressor=one[:, None],
            influence=(one / power - part.influence @ through)[:, None],
            residual=part.residual - value * one,
            kept=part.kept,
            period=part.period,
            sample_time=part.sample_time,
        )
        for part, one in zip(parts, left, strict=True)
    ]
    std = float(np.sqrt(error_covariance(fitted).matrix[0, 0]))
    return Lag(value, std, intervals[0]) if std > 0 else None
