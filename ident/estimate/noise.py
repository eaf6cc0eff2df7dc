"""What differs between repeated periods is noise; what repeats is model error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import Equations
from ident.records.repeats import repeats_of

Array = NDArray[np.float64]


_FORCES: Final = ("x", "y")


def torque_unit(coordinate: str) -> str:
    """Unit of the generalized torque of a coordinate."""
    return "N" if coordinate in _FORCES else "Nm"


@dataclass(frozen=True)
class NoiseFloor:
    """Rms values of one coordinate of one step over its moving rows, in the unit of its generalized torque.

    Attributes:
        step, coordinate: where.
        signal: rms of the measured generalized torque.
        residual: rms of measured minus modelled.
        noise: rms of what differs between periods, corrected for the degrees of freedom; NaN without repeats.
        model_error: rms of what repeats, the noise left in the period mean taken off; NaN without repeats.
    """

    step: str
    coordinate: str
    signal: float
    residual: float
    noise: float
    model_error: float

    @property
    def unit(self) -> str:
        """Of the generalized torque."""
        return torque_unit(self.coordinate)

    @property
    def nrmse(self) -> float:
        """Rms error over rms signal [-]."""
        return self.residual / self.signal


def noise_floor(equations: Equations, values: Array) -> NoiseFloor:
    """Split the residual of one coordinate; `values` are the parameters (11,)."""
    residual = equations.torque - equations.regressor @ values
    moving = equations.moving
    noise, model_error = _split(residual, equations)
    return NoiseFloor(
        equations.step,
        equations.coordinate,
        _rms(equations.torque[moving]),
        _rms(residual[moving]),
        noise,
        model_error,
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _split(residual: Array, equations: Equations) -> tuple[float, float]:
    samples = repeats_of(equations.period)
    folded = residual[samples[:, equations.moving[samples].all(axis=0)]]
    if len(folded) < 2 or not folded.size:
        return float("nan"), float("nan")
    variance = float(np.mean(folded.var(axis=0, ddof=1)))
    repeated = float(np.mean(folded.mean(axis=0) ** 2)) - variance / len(folded)
    return float(np.sqrt(variance)), float(np.sqrt(max(repeated, 0.0)))
