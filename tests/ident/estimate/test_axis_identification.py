"""The servo axis: the published estimate of the EMPS benchmark, and axes made here."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.errors import EstimationError, RecordError
from ident.estimate.axis import AxisIdentification, AxisProcessing, identify_axes, identify_axis
from ident.estimate.axis.processing import decimated, kept_rows, smoothed
from ident.estimate.least_squares import LinearSystem, solve
from ident.records.axis_record import AxisKind, AxisRecord, AxisSignals, read_axis_record

Array = NDArray[np.float64]
DT = 0.001
TRUTH = np.array([95.0, 200.0, 20.0, -3.0])


@pytest.fixture(scope="module")
def emps() -> AxisIdentification:
    path = os.environ.get("QUASIOMNI_EMPS")
    if not path:
        pytest.skip("QUASIOMNI_EMPS does not name DATA_EMPS.mat of the EMPS benchmark; it is not ours to redistribute")
    return identify_axis(read_axis_record(Path(path)), AxisProcessing())


@pytest.mark.parametrize(
    ("name", "published"), [("M", 95.1089), ("Fv", 203.5034), ("Fc", 20.3935), ("offset", -3.1648)]
)
def test_the_published_parameters_of_emps_come_out_to_the_last_digit(
    emps: AxisIdentification, name: str, published: float
) -> None:
    assert round(emps[name].value, 4) == published


def test_the_published_fit_of_emps_comes_out_to_the_last_digit(emps: AxisIdentification) -> None:
    assert round(100 * emps.relative_error, 4) == 4.0834
    assert round(emps.residual_std, 4) == 2.1843
    assert round(emps.regressor_condition, 3) == 25.988


def test_naive_standard_deviations_of_emps_are_two_to_seven_times_too_small(emps: AxisIdentification) -> None:
    ratios = [estimate.std / estimate.naive_std for estimate in emps.estimates]
    assert min(ratios) > 1.8
    assert max(ratios) < 6.6


def test_units_of_a_linear_axis_are_those_of_force_and_mass(emps: AxisIdentification) -> None:
    assert [estimate.unit for estimate in emps.estimates] == ["kg", "N s/m", "N", "N"]


def axis(name: str, truth: Array, seed: int, *, noise: float = 0.0, kind: AxisKind = AxisKind.LINEAR) -> AxisSignals:
    """Several sines, so that the axis turns round often at varied accelerations; effort by the exact model."""
    generator = np.random.default_rng(seed)
    time = DT * np.arange(20000)
    omega = 2 * np.pi * np.array([0.2, 0.45, 0.9, 1.7])
    phase = generator.uniform(0, 2 * np.pi, 4)[:, None] + np.outer(omega, time)
    amplitude = 0.1 / omega[:, None]
    position = np.sum(amplitude * np.sin(phase), axis=0)
    velocity = np.sum(amplitude * omega[:, None] * np.cos(phase), axis=0)
    acceleration = -np.sum(amplitude * omega[:, None] ** 2 * np.sin(phase), axis=0)
    columns = np.stack([acceleration, velocity, np.sign(velocity), np.ones_like(velocity)], axis=1)
    return AxisSignals(name, kind, position, columns @ truth + noise * generator.normal(size=len(time)))


def record_of(*axes: AxisSignals, samples: int = 20000) -> AxisRecord:
    cut = tuple(AxisSignals(a.name, a.kind, a.position[:samples], a.effort[:samples]) for a in axes)
    return AxisRecord(cut, DT, DT * np.arange(samples), np.full(samples, -1), "made here")


def assert_recovered(found: AxisIdentification, truth: Array) -> None:
    """To a thousandth; a reversal between two samples is dated to one of them, which costs the Coulomb force a bit."""
    np.testing.assert_allclose(found.values, truth, rtol=1e-3, atol=2.5e-3 * truth[2])


def test_parameters_of_a_perfect_axis_are_recovered() -> None:
    found = identify_axis(record_of(axis("", TRUTH, 0)), AxisProcessing())
    assert_recovered(found, TRUTH)
    assert found.relative_error < 0.02


@pytest.mark.parametrize("decimation", [1, 4, 10])
def test_decimation_changes_the_rows_and_not_the_result(decimation: int) -> None:
    found = identify_axis(record_of(axis("", TRUTH, 0)), AxisProcessing(decimation=decimation))
    assert_recovered(found, TRUTH)
    assert len(found.equations.effort) == len(found.residual) == -(-(20000 - 49) // decimation)
    np.testing.assert_allclose(np.diff(found.equations.time), DT * decimation)
    assert found.equations.sample_time == pytest.approx(DT * decimation)


def test_every_axis_of_a_record_is_identified_by_itself() -> None:
    other = np.array([0.4, 2.0, 0.5, 0.1])
    two = record_of(axis("1", TRUTH, 0), axis("2", other, 1, kind=AxisKind.ROTARY))
    first, second = identify_axes(two, AxisProcessing())
    assert_recovered(first, TRUTH)
    assert_recovered(second, other)
    assert (first.axis, second.axis) == ("1", "2")
    assert [estimate.unit for estimate in second.estimates] == ["kg m^2", "Nm s/rad", "Nm", "Nm"]
    alone = identify_axis(record_of(axis("2", other, 1, kind=AxisKind.ROTARY)), AxisProcessing())
    np.testing.assert_array_equal(alone.values, second.values)
    with pytest.raises(RecordError, match="several axes"):
        identify_axis(two, AxisProcessing())


def test_an_axis_is_estimated_by_the_least_squares_of_the_vehicle() -> None:
    found = identify_axis(record_of(axis("", TRUTH, 0, noise=5.0)), AxisProcessing())
    rows = found.equations
    solution = solve(LinearSystem(("a", "b", "c", "d"), rows.regressor, rows.effort))
    np.testing.assert_array_equal(found.values, solution.values)
    assert found.condition == solution.condition
    white = np.sum(found.residual**2) / (len(found.residual) - 4) * np.linalg.inv(rows.regressor.T @ rows.regressor)
    np.testing.assert_allclose([e.naive_std for e in found.estimates], np.sqrt(np.diag(white)))


def test_intervals_hold_the_truth_over_many_noises() -> None:
    """Noise of the effort is white, but what decimation leaves of it is not quite; 4 x 40 intervals at 95 %."""
    inside = 0
    for seed in range(40):
        noisy = identify_axis(record_of(axis("", TRUTH, seed, noise=20.0)), AxisProcessing())
        quiet = identify_axis(record_of(axis("", TRUTH, seed)), AxisProcessing())
        inside += sum(
            low <= true <= high
            for (low, high), true in zip((e.ci95 for e in noisy.estimates), quiet.values, strict=True)
        )
    assert 0.88 <= inside / 160 <= 0.995


def test_an_axis_that_moves_one_way_at_one_speed_excites_nothing() -> None:
    time = DT * np.arange(4000)
    still = AxisSignals("", AxisKind.LINEAR, 0.2 * time, 20.0 + 200 * 0.2 * np.ones(4000))
    with pytest.raises(EstimationError) as caught:
        identify_axis(record_of(still, samples=4000), AxisProcessing())
    assert caught.value.what.startswith("made here, axis: ")
    assert "Fc from offset" in caught.value.what
    assert "both ways" in caught.value.remedy


def test_a_short_record_is_refused_with_the_length_needed() -> None:
    with pytest.raises(EstimationError, match="holds 200 samples") as caught:
        identify_axis(record_of(axis("", TRUTH, 0), samples=200), AxisProcessing())
    assert "need" in caught.value.remedy


def test_a_cutoff_above_the_nyquist_frequency_is_refused() -> None:
    with pytest.raises(EstimationError, match="too slowly"):
        identify_axis(record_of(axis("", TRUTH, 0)), AxisProcessing(cutoff=3200.0))


def test_the_filters_are_the_classic_ones_with_the_edges_reflected_over_three_orders() -> None:
    """Written out once more in transfer-function form; that form loses some digits at order 8."""
    values = np.random.default_rng(0).normal(size=3000).cumsum()
    b, a = signal.butter(4, 100.0, fs=1 / DT)
    np.testing.assert_allclose(
        smoothed(values, 2 * np.pi * 100, DT), signal.filtfilt(b, a, values, padtype="odd", padlen=12), rtol=1e-9
    )
    b, a = signal.cheby1(8, 0.05, 0.8 / 10)
    expected = signal.filtfilt(b, a, values, padtype="odd", padlen=24)[9::10]
    np.testing.assert_allclose(decimated(values, 10), expected, rtol=1e-4, atol=1e-4 * np.abs(values).max())


@pytest.mark.parametrize("samples", [100, 101, 105, 109])
def test_decimation_keeps_the_last_sample(samples: int) -> None:
    kept = np.arange(samples)[kept_rows(samples, 10)]
    assert kept[-1] == samples - 1
    assert len(kept) == -(-samples // 10)
    assert np.all(np.diff(kept) == 10)
