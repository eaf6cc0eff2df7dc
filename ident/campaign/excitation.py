"""Periodic excitation as Fourier series that start and end at rest (paper, section 6.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FourierSeries:
    """ṡ(t) = Σ aₖ cos kωt + bₖ sin kωt with s(0) = 0.

    Attributes:
        cosine, sine: (K,) coefficients of the velocity.
        period: 2π/ω [s].
    """

    cosine: Array
    sine: Array
    period: float

    def evaluate(self, time: Array) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration at `time` (N,)."""
        position, velocity, acceleration = motion_basis(time, self.period, len(self.cosine))
        coefficients = np.concatenate([self.cosine, self.sine])
        return position @ coefficients, velocity @ coefficients, acceleration @ coefficients

    def scaled(self, factor: float) -> FourierSeries:
        """The same shape at another size."""
        return FourierSeries(self.cosine * factor, self.sine * factor, self.period)


def series_of(coefficients: Array, period: float) -> FourierSeries:
    """The series of (2K,) coefficients, cosines first."""
    cosine, sine = np.split(np.asarray(coefficients, dtype=float), 2)
    return FourierSeries(cosine, sine, period)


def motion_basis(time: Array, period: float, harmonics: int) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (N, 2K) per coefficient (cosines, then sines) at `time` (N,)."""
    omega = 2 * math.pi / period * np.arange(1, harmonics + 1)
    phase = np.outer(time, omega)
    cos, sin = np.cos(phase), np.sin(phase)
    return (
        np.hstack([sin / omega, (1 - cos) / omega]),
        np.hstack([cos, sin]),
        np.hstack([-sin * omega, cos * omega]),
    )


def resting_projection(harmonics: int) -> Array:
    """Projector (2K, 2K) onto coefficients with ṡ(0) = s̈(0) = 0."""
    order = np.arange(1, harmonics + 1)
    cosine = np.eye(harmonics) - 1 / harmonics
    sine = np.eye(harmonics) - np.outer(order, order) / (order @ order)
    zero = np.zeros((harmonics, harmonics))
    return np.block([[cosine, zero], [zero, sine]])
