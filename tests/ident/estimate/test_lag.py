"""How late all torques act is found beside the parameters, with a standard deviation that can be believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from ident.estimate.identify import identify
from ident.estimate.least_squares import ORDINARY, Estimator, LeastSquares, WeightedLeastSquares
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import Parameters

RecordOf = Callable[..., Record]
SMOOTHED = 2e-6
"""What filters leave of a record without noise [s]."""


@pytest.fixture(scope="module")
def record(record_of: RecordOf, vehicle: VehicleDescription, truth: Parameters) -> Record:
    return record_of(vehicle, truth)


def acting_later(record: Record, lag: float, noise: float = 0.0, seed: int = 0) -> Record:
    """The record of a vehicle whose torques act later by `lag` [s] than they are written down."""
    generator = np.random.default_rng(seed)

    def early(segment: Segment) -> Segment:
        torques = CubicSpline(segment.time, segment.motor_torques)(segment.time + lag)
        return replace(segment, motor_torques=torques + noise * generator.normal(size=torques.shape))

    return Record([early(segment) for segment in record.segments], "late")


def found_of(record: Record, vehicle: VehicleDescription, estimator: Estimator = ORDINARY) -> Lag:
    lag = identify(record, vehicle.geometry, estimator=estimator).lag
    assert lag is not None
    return lag


def test_torques_of_a_perfect_record_act_when_they_are_recorded(record: Record, vehicle: VehicleDescription) -> None:
    assert found_of(record, vehicle).value == pytest.approx(0.0, abs=SMOOTHED)


@settings(max_examples=6, deadline=None)
@given(lag=st.floats(-1e-3, 1e-3))
def test_a_lag_of_either_sign_is_found(record: Record, vehicle: VehicleDescription, lag: float) -> None:
    """To first order: of a millisecond at 2 Hz the second order is 1e-4 of the torque."""
    found = found_of(acting_later(record, lag), vehicle)
    assert found.value == pytest.approx(lag, rel=0.01, abs=SMOOTHED)
    assert found.interval == pytest.approx(record.segments[0].sample_time)


@pytest.mark.parametrize("estimator", [LeastSquares(), WeightedLeastSquares()], ids=lambda one: one.name)
def test_every_estimator_finds_it(record: Record, vehicle: VehicleDescription, estimator: Estimator) -> None:
    found = found_of(acting_later(record, 5e-4, noise=0.02), vehicle, estimator)
    assert abs(found.value - 5e-4) < 4 * found.std


def test_it_scatters_as_its_standard_deviation_says(record: Record, vehicle: VehicleDescription) -> None:
    found = [found_of(acting_later(record, 3e-4, 0.02, seed), vehicle) for seed in range(16)]
    pulls = np.array([(one.value - 3e-4) / one.std for one in found])
    assert 0.5 < np.sqrt(np.mean(pulls**2)) < 1.6  # 16 squares: 0.66 to 1.35 in 19 of 20 cases.


def test_of_steps_at_several_rates_nothing_is_said(record: Record, vehicle: VehicleDescription) -> None:
    first, *others = record.segments
    halved = replace(
        others[-1],
        sample_time=2 * others[-1].sample_time,
        time=others[-1].time[::2],
        motor_torques=others[-1].motor_torques[::2],
        wheel_angles=others[-1].wheel_angles[::2],
        steering_angles=others[-1].steering_angles[::2],
        period=others[-1].period[::2],
    )
    mixed = Record([first, *others[:-1], halved], "two rates")
    assert identify(mixed, vehicle.geometry).lag is None
