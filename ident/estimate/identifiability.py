"""Which parameters a set of motions can tell apart: QR of (22) on random motion (paper, section 6.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

QR_TOLERANCE = 1e-3
"""Smallest pivot of unit-norm columns that counts as independent. The pivots found are above 10⁻² or below 10⁻⁷."""

PIVOT_ORDER = ("m_ch", "C_ch", "C_l", "d_vl", "d_cl", "C_r", "d_vr", "d_cr", "d_vw", "d_cw", "B_w")
"""Who stays when columns are dependent: Table 1 keeps the chassis before the steering units, B_w last."""


@dataclass(frozen=True)
class Configuration:
    """A motion: a mode, with the steering held straight or not."""

    mode: Mode
    straight: bool = False


ALIGNMENT = Configuration(Mode.ALIGNMENT)
STEERED = Configuration(Mode.STEERED)
LATERAL = Configuration(Mode.LATERAL)
ROTATION = Configuration(Mode.ROTATION)
STRAIGHT = Configuration(Mode.STEERED, straight=True)


def independent_parameters(
    configurations: Sequence[Configuration],
    geometry: Geometry,
    generator: np.random.Generator,
    samples: int = 2000,
    tolerance: float = QR_TOLERANCE,
) -> tuple[str, ...]:
    """Parameters linearly independent of those before them in PIVOT_ORDER, in the order of (18): Table 1."""
    rows = [random_rows(configuration, geometry, generator, samples) for configuration in configurations]
    return independent_columns(np.concatenate(rows), tolerance)


def independent_columns(regressor: Array, tolerance: float = QR_TOLERANCE) -> tuple[str, ...]:
    """Names of the columns of (M, 11) whose diagonal entry of R, at unit column norm, exceeds the tolerance."""
    order = [PARAMETER_NAMES.index(name) for name in PIVOT_ORDER]
    norms = np.linalg.norm(regressor, axis=0)
    scaled = (regressor / np.where(norms > 0, norms, 1.0))[:, order]
    pivots = np.abs(np.diag(np.linalg.qr(scaled, mode="r")))
    independent = {name for name, pivot in zip(PIVOT_ORDER, pivots, strict=True) if pivot > tolerance}
    return tuple(name for name in PARAMETER_NAMES if name in independent)


def random_rows(
    configuration: Configuration, geometry: Geometry, generator: np.random.Generator, samples: int
) -> Array:
    """H_kᵀ Θ (samples * n_k, 11) for random ṡ_k, s̈_k, and random α where it is free.

    Speeds stay outside of stiction, where the estimator drops its rows: there tanh((a/r) α̇/ε) differs from
    tanh(α̇/ε) when a ≠ r, and would let d_cw of mode 1 through with a pivot that no measurement resolves.
    """
    mode = configuration.mode
    width = len(kinematics.GENERALIZED_VELOCITIES[mode])
    alpha = _random_steering(configuration, geometry, generator, samples)
    sign = generator.choice((-1.0, 1.0), size=(samples, width))
    velocity = sign * generator.uniform(0.3, 2.0, size=(samples, width))
    acceleration = generator.normal(size=(samples, width))
    if configuration.straight:
        velocity[:, 0] = acceleration[:, 0] = 0.0
    rates, lifted = dynamics.lift_velocities(mode, alpha, velocity, acceleration, geometry)
    theta = dynamics.projected_regressor(mode, alpha, rates, lifted, geometry)
    rows = theta[:, -1:] if configuration.straight else theta
    return rows.reshape(-1, len(PARAMETER_NAMES))


def _random_steering(
    configuration: Configuration, geometry: Geometry, generator: np.random.Generator, samples: int
) -> Array:
    if configuration.mode is Mode.ALIGNMENT:
        return generator.uniform(-1.4, 1.4, size=(samples, 2))
    if configuration.mode is Mode.STEERED and not configuration.straight:
        limit = 0.8 * geometry.rotation_angle
        return kinematics.steering_from_virtual(generator.uniform(-limit, limit, size=samples), geometry)
    return np.zeros((samples, 2))
