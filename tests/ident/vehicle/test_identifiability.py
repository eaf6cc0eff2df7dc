"""Table 1 of the paper, restored: which parameters which motions tell apart, by QR on random motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.estimate.identifiability import (
    ALIGNMENT,
    LATERAL,
    ROTATION,
    STEERED,
    STRAIGHT,
    Configuration,
    independent_columns,
    independent_parameters,
    random_rows,
)
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES

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
