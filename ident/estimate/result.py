"""The result of an identification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import Equations
from ident.estimate.filters import Processing
from ident.estimate.noise import NoiseFloor
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

POOR_RELATIVE_HALF_WIDTH = 0.5
"""A parameter whose 95 % half-width exceeds this fraction of its value is said to be poorly excited."""


@dataclass(frozen=True)
class KnownInertia:
    """B_w from elsewhere: data sheet or earlier identification [kg m²]."""

    value: float
    std: float
    source: str


@dataclass(frozen=True)
class Estimate:
    """One identified parameter.

    Attributes:
        name, unit: by the paper's symbol.
        value, std: SI.
        ci95: two-sided interval.
        naive_std: what white residuals of one size would give, as the paper's Table 2.
        b_w_std: the part of `std` that comes from the uncertainty of B_w.
        independence: norm of the parameter's column after projection on the others, over its norm: 1 is
            excitation that nothing else imitates, 0 is none.
        method: how it was found.
    """

    name: str
    unit: str
    value: float
    std: float
    ci95: tuple[float, float]
    naive_std: float
    b_w_std: float
    independence: float
    method: str

    @property
    def poor(self) -> bool:
        """Whether the interval is too wide to build on, or the value negative, which none of these can be."""
        half_width = (self.ci95[1] - self.ci95[0]) / 2
        return not half_width < POOR_RELATIVE_HALF_WIDTH * self.value

    @property
    def quality(self) -> str:
        """In a word: `impossible` for a value that is not positive, which no lack of excitation explains."""
        if not self.value > 0:
            return "impossible"
        return "poor" if self.poor else "good"


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes:
        estimates: eleven, in the order of (18).
        correlation: (11, 11).
        condition: cond(Θ₁ᵀΘ₁), unit-norm columns, unweighted, on measured, filtered and masked rows.
        floors: signal, residual, noise and model error of every step that was used or validated.
        lag: of all torques; None where the samples of the fitted steps have several intervals.
        equations: all rows, fitted ones first, for plots.
        processing: the filters and thresholds used.
    """

    estimates: tuple[Estimate, ...]
    correlation: Array
    condition: float
    floors: tuple[NoiseFloor, ...]
    lag: Lag | None
    equations: tuple[Equations, ...]
    processing: Processing

    @property
    def values(self) -> Array:
        """p (11,)."""
        return np.array([estimate.value for estimate in self.estimates])

    @property
    def parameters(self) -> Parameters:
        """Values of p (18), their standard deviations and correlation."""
        return Parameters(self.values, np.array([estimate.std for estimate in self.estimates]), self.correlation)

    def __getitem__(self, name: str) -> Estimate:
        """One estimate by its symbol."""
        return self.estimates[PARAMETER_NAMES.index(name)]
