from __future__ import annotations

import numpy as np
import pytest

from ident.estimate.equations import Equations
from ident.estimate.noise import noise_floor
from ident.vehicle.parameters import PARAMETER_NAMES

PERIOD = 3000
SIZE = len(PARAMETER_NAMES)


def equations(periods: int, noise: float, repeated: float, moving: float = 0.8) -> Equations:
    """One column, m_ch = 2, a known model error that repeats, and white noise."""
    generator = np.random.default_rng(1)
    count = periods * PERIOD
    phase = 2 * np.pi * np.arange(count) / PERIOD
    theta = np.zeros((count, SIZE))
    theta[:, PARAMETER_NAMES.index("m_ch")] = np.sin(phase)
    error = repeated * np.sqrt(2) * np.sin(17 * phase) + noise * generator.normal(size=count)
    return Equations(
        step="straight",
        coordinate="x",
        sample_time=0.002,
        time=0.002 * np.arange(count),
        regressor=theta,
        torque=2 * np.sin(phase) + error,
        growth=np.zeros(count),
        moving=np.arange(count) % PERIOD < moving * PERIOD,
        period=np.repeat(np.arange(periods), PERIOD),
    )


def values() -> np.ndarray:
    return np.where(np.array(PARAMETER_NAMES) == "m_ch", 2.0, 0.0)


@pytest.mark.parametrize(("noise", "repeated"), [(0.3, 0.1), (0.1, 0.3), (0.2, 0.0), (0.0, 0.2)])
def test_what_differs_between_periods_is_noise_and_what_repeats_is_model_error(noise: float, repeated: float) -> None:
    floor = noise_floor(equations(4, noise, repeated), values())
    assert floor.noise == pytest.approx(noise, rel=0.05, abs=1e-9)
    assert floor.model_error == pytest.approx(repeated, rel=0.1, abs=0.1 * noise)
    assert floor.residual == pytest.approx(np.hypot(noise, repeated), rel=0.05)
    assert (floor.step, floor.coordinate) == ("straight", "x")


def test_more_periods_do_not_change_what_is_called_noise() -> None:
    few, many = (noise_floor(equations(periods, 0.2, 0.1), values()) for periods in (2, 12))
    assert few.noise == pytest.approx(many.noise, rel=0.05)
    assert few.model_error == pytest.approx(many.model_error, rel=0.15)


def test_the_error_is_set_against_the_signal_over_moving_rows_only() -> None:
    found = noise_floor(equations(4, 0.0, 0.2, moving=0.5), values())
    assert found.nrmse == pytest.approx(0.2 / np.sqrt(2), rel=0.02)


def test_a_single_period_tells_noise_from_model_error_by_nothing() -> None:
    floor = noise_floor(equations(1, 0.2, 0.1), values())
    assert np.isnan(floor.noise)
    assert np.isnan(floor.model_error)
    assert floor.residual > 0


def test_a_step_that_never_moves_has_no_floor() -> None:
    floor = noise_floor(equations(4, 0.2, 0.1, moving=0.0), values())
    assert np.isnan([floor.noise, floor.model_error, floor.residual, floor.signal]).all()
