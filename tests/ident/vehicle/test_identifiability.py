"""Table 1 of the paper, restored: which parameters which motions tell apart, by QR on random motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
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


STEERING = ("C_l", "d_vl", "d_cl", "C_r", "d_vr", "d_cr")
ALL_BUT_B_W = tuple(name for name in PARAMETER_NAMES if name != "B_w")
TABLE_1 = {
    "mode 1": ((ALIGNMENT,), STEERING),
    "mode 2": ((STEERED,), PARAMETER_NAMES),
    "mode 3": ((LATERAL,), ("m_ch", "d_vw", "d_cw")),
    "mode 4": ((ROTATION,), ("C_ch", "d_vw", "d_cw")),
    "straight": ((STRAIGHT,), ("m_ch", "d_vw", "d_cw")),
    "modes 1, straight, 4": ((ALIGNMENT, STRAIGHT, ROTATION), ALL_BUT_B_W),
}


@pytest.fixture(scope="module", params=["as measured", "offset equals radius"])
def shape(request: pytest.FixtureRequest, geometry: Geometry) -> Geometry:
    """The shipped geometries, and the same with a/r = 1, where a/r, r/a and their squares look alike."""
    return replace(geometry, wheel_offset=geometry.wheel_radius) if "equals" in request.param else geometry


@pytest.mark.parametrize("row", TABLE_1)
def test_table_1_is_what_random_motion_can_tell_apart(row: str, shape: Geometry) -> None:
    configurations, expected = TABLE_1[row]
    assert independent_parameters(configurations, shape, np.random.default_rng(0)) == expected


def ranks(configurations: tuple[Configuration, ...], geometry: Geometry) -> NDArray[np.float64]:
    rows = np.concatenate([random_rows(c, geometry, np.random.default_rng(3), 1000) for c in configurations])
    norms = np.linalg.norm(rows, axis=0)
    return np.linalg.svd(rows / np.where(norms > 0, norms, 1.0), compute_uv=False)


@pytest.mark.parametrize("row", TABLE_1)
def test_the_number_of_independent_parameters_is_the_rank_with_a_clear_gap(row: str, shape: Geometry) -> None:
    """Singular values know nothing of the order in which columns are taken."""
    configurations, expected = TABLE_1[row]
    values = ranks(configurations, shape)
    count = len(expected)
    assert values[count - 1] > 1e-3 * values[0]
    assert np.all(values[count:] < 1e-7 * values[0])


def test_on_the_floor_wheel_inertia_hides_in_the_inertias_it_is_geared_to(geometry: Geometry) -> None:
    """The column of B_w is 4/r^2 m_ch driving straight, 2 (a/r)^2 C_l steering, 4 (lever/r)^2 C_ch turning."""
    column = PARAMETER_NAMES.index
    r, ratio = geometry.wheel_radius, geometry.wheel_offset / geometry.wheel_radius
    turning = 4 * (np.hypot(geometry.wheelbase, geometry.track_width) / 2 + geometry.wheel_offset) ** 2 / r**2
    for configuration, name, factor in (
        (STRAIGHT, "m_ch", 4 / r**2),
        (ROTATION, "C_ch", turning),
    ):
        rows = random_rows(configuration, geometry, np.random.default_rng(0), 50)
        np.testing.assert_allclose(rows[:, column("B_w")], factor * rows[:, column(name)], rtol=1e-9)
    rows = random_rows(ALIGNMENT, geometry, np.random.default_rng(0), 50)
    both = rows[:, column("C_l")] + rows[:, column("C_r")]
    np.testing.assert_allclose(rows[:, column("B_w")], 2 * ratio**2 * both, rtol=1e-9)


def test_a_column_that_is_zero_or_a_sum_of_others_is_dependent() -> None:
    rows = np.random.default_rng(0).normal(size=(100, len(PARAMETER_NAMES)))
    rows[:, PARAMETER_NAMES.index("d_vl")] = 0.0
    rows[:, PARAMETER_NAMES.index("B_w")] = rows[:, PARAMETER_NAMES.index("m_ch")] + rows[:, 0]
    expected = tuple(name for name in PARAMETER_NAMES if name not in ("d_vl", "B_w"))
    assert independent_columns(rows) == expected
