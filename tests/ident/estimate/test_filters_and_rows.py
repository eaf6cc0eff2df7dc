from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.estimate.equations import equations_of, motion_of, usable_equations
from ident.estimate.filters import (
    FILTER_ORDER,
    SEVEN,
    THREE,
    Processing,
    differentiate,
    mirrored,
    moving_rows,
    rate_noise,
    second_derivative,
    sliding_samples,
    smooth,
    zero_phase,
)
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters

DT = 0.002
CUTOFF = 40.0
property_of = settings(max_examples=20, deadline=None, derandomize=True)


@property_of
@given(frequency=st.floats(2.0, 200.0), phase=st.floats(0.0, 6.28))
def test_a_zero_phase_filter_shrinks_a_sine_and_does_not_shift_it(frequency: float, phase: float) -> None:
    """Butterworth of order 2, forwards and backwards: gain 1 / (1 + (tan wT/2 / tan w_g T/2)^4), phase 0."""
    time = DT * np.arange(20000)
    found = zero_phase(np.sin(frequency * time + phase), CUTOFF, DT)[4000:-4000]
    inner = time[4000:-4000]
    basis = np.stack([np.sin(frequency * inner + phase), np.cos(frequency * inner + phase)], axis=1)
    in_phase, quadrature = np.linalg.lstsq(basis, found, rcond=None)[0]
    gain = 1 / (1 + (np.tan(frequency * DT / 2) / np.tan(CUTOFF * DT / 2)) ** 4)
    assert in_phase == pytest.approx(gain, abs=1e-6)
    assert quadrature == pytest.approx(0.0, abs=1e-6)


def test_constants_pass_a_filter_unchanged() -> None:
    np.testing.assert_allclose(zero_phase(np.full((500, 2), 3.0), CUTOFF, DT), 3.0, rtol=1e-9)


def test_a_filter_treats_time_reversal_alike() -> None:
    values = np.random.default_rng(0).normal(size=3000)
    there, back = zero_phase(values, CUTOFF, DT), zero_phase(values[::-1], CUTOFF, DT)[::-1]
    np.testing.assert_allclose(there[800:-800], back[800:-800], atol=1e-9)


def test_no_end_sample_alone_moves_what_lies_beyond_it() -> None:
    """What lies beyond an end is told by samples that their neighbours have judged; the last three are not."""
    line = 0.3 * np.arange(400.0)
    damaged = line.copy()
    damaged[[0, 1, 2, -1]] += [50.0, -3.0, 7.0, -80.0]
    np.testing.assert_array_equal(zero_phase(damaged, CUTOFF, DT, 3), zero_phase(line, CUTOFF, DT, 3))


@property_of
@given(frequency=st.floats(2.0, 200.0), order=st.integers(1, 4))
def test_a_mirrored_filter_shrinks_a_sine_as_its_order_says(frequency: float, order: int) -> None:
    """Butterworth of order n, forwards and backwards: gain 1 / (1 + (tan wT/2 / tan w_g T/2)^2n), phase 0."""
    time = DT * np.arange(20000)
    inner = slice(4000, -4000)
    found = mirrored(np.sin(frequency * time), [(order, CUTOFF)], DT)[inner]
    basis = np.stack([np.sin(frequency * time), np.cos(frequency * time)], axis=1)[inner]
    in_phase, quadrature = np.linalg.lstsq(basis, found, rcond=None)[0]
    gain = 1 / (1 + (np.tan(frequency * DT / 2) / np.tan(CUTOFF * DT / 2)) ** (2 * order))
    assert in_phase == pytest.approx(gain, abs=1e-6)
    assert quadrature == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_what_noise_makes_of_the_end_of_an_acceleration_is_one_impulse_behind_a_mirror(seed: int) -> None:
    """Of an acceleration from noisy positions; a reflection in the end sample makes it last, and larger."""
    positions = np.random.default_rng(seed).normal(size=20000)
    rough = differentiate(differentiate(positions, DT, SEVEN), DT, SEVEN)
    mirror, point = mirrored(rough, [(FILTER_ORDER, CUTOFF)], DT), zero_phase(rough, CUTOFF, DT)
    start, middle = slice(0, 500), slice(5000, 15000)
    impulse = mirrored(np.eye(1, len(rough))[0], [(FILTER_ORDER, CUTOFF)], DT)[start]
    left = mirror[start] - impulse * (impulse @ mirror[start]) / (impulse @ impulse)
    assert np.abs(left).max() < 4 * np.std(mirror[middle])
    assert np.abs(point[start]).max() > 100 * np.std(point[middle])


@property_of
@given(length=st.integers(2, 200), seed=st.integers(0, 100))
def test_terms_of_an_equation_that_holds_in_every_sample_keep_it_behind_a_mirror(length: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    terms, parameters = generator.normal(size=(length, 3)), generator.normal(size=3)
    left = mirrored(terms @ parameters, [(FILTER_ORDER, CUTOFF)], DT)
    np.testing.assert_allclose(left, mirrored(terms, [(FILTER_ORDER, CUTOFF)], DT) @ parameters, atol=1e-9)


def test_derivatives_of_a_parabola_are_exact() -> None:
    time = DT * np.arange(100)
    values = np.stack([3 * time**2 - time, 5 - time**2], axis=1)
    rate, curvature = differentiate(values, DT), second_derivative(values, DT)
    np.testing.assert_allclose(rate[1:-1], np.stack([6 * time - 1, -2 * time], axis=1)[1:-1], atol=1e-9)
    np.testing.assert_allclose(curvature, np.tile([6.0, -2.0], (100, 1)), atol=1e-7)


def test_a_joint_that_turns_round_between_two_samples_sticks_there() -> None:
    """Slow in neither of them; left out are both, with the memory of the filter of positions."""
    processing = Processing(moving=0.05, guard=0.1, cutoff=40.0, signal_cutoff=500.0)
    rates = np.where(np.arange(100) < 50, -3.0, 3.0)[:, None]
    reach = round(0.1 * 40 / 500 / DT)
    left_out = np.flatnonzero(~sliding_samples(rates, processing, DT, processing.moving)[reach:-reach]) + reach
    np.testing.assert_array_equal(left_out, np.arange(49 - reach, 51 + reach))


@pytest.mark.parametrize("samples", [THREE, SEVEN])
def test_the_noise_of_rates_is_told_from_angles_that_move(samples: int) -> None:
    """By what noise alone makes of rates; a swing of half a radian beside it changes nothing."""
    noise = 3e-5 * np.random.default_rng(4).standard_normal((20_000, 2)) * [1.0, 2.0]
    swing = 0.5 * np.sin(2 * np.pi * np.arange(20_000) * DT / 0.7)[:, None]
    expected = smooth(noise, Processing(), DT, samples).rates.std(axis=0)
    np.testing.assert_allclose(rate_noise(noise + swing, Processing(), DT, samples), expected, rtol=0.03)


def test_stiction_and_the_memory_of_the_filter_around_it_are_dropped() -> None:
    """One joint of two stops for a moment: those samples go, and 0.1 s on either side of them."""
    processing = Processing(moving=0.05, guard=0.1)
    rates = np.full((1000, 2), 0.5)
    rates[:, 1] *= -1
    rates[400:410, 1] = -0.04
    found = moving_rows(rates, processing, DT)
    expected = np.ones(1000, dtype=bool)
    expected[350:460] = False
    expected[:50] = expected[-50:] = False  # what came before the record is unknown
    np.testing.assert_array_equal(found, expected)


def test_sign_changes_are_stiction_however_fast() -> None:
    rates = np.concatenate([np.full(300, 1.0), [0.0], np.full(300, -1.0)])[:, None]
    found = moving_rows(rates, Processing(), DT)
    assert not found[250:351].any()
    assert found[100:240].all()


@pytest.fixture(scope="module")
def record(record_of: Callable[..., Record], vehicle: VehicleDescription, truth: Parameters) -> Record:
    return record_of(vehicle, truth)


def test_filtered_columns_still_balance_the_filtered_torque(
    record: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    """A regressor of filtered velocities would not: tanh of a mean is no mean of tanh."""
    for rows in usable_equations(list(record.segments), vehicle.geometry, Processing()):
        error = (rows.torque - rows.regressor @ truth.values)[rows.moving]
        assert np.sqrt(np.mean(error**2)) < 1e-3 * np.sqrt(np.mean(rows.torque[rows.moving] ** 2)), rows.step


def test_what_a_known_load_takes_is_no_mass_of_the_vehicle(
    record_of: Callable[..., Record], vehicle: VehicleDescription, truth: Parameters
) -> None:
    driven = record_of(vehicle, truth.replaced(m_ch=truth["m_ch"] + 80.0))
    for segment in driven.segments:
        loaded = replace(segment, extra={"payload": np.full(len(segment), 80.0)})
        for rows in equations_of(loaded, vehicle.geometry, Processing()):
            error = (rows.torque - rows.regressor @ truth.values)[rows.moving]
            assert np.sqrt(np.mean(error**2)) < 1e-3 * np.sqrt(np.mean(rows.torque[rows.moving] ** 2)), rows.step


def test_every_step_gives_the_rows_of_the_coordinate_it_drives(record: Record, vehicle: VehicleDescription) -> None:
    found = {
        segment.step: [rows.coordinate for rows in equations_of(segment, vehicle.geometry, Processing())]
        for segment in record.segments
    }
    assert found == {
        "wheel_lifted": ["beta_fl", "beta_rl", "beta_fr", "beta_rr"],
        "steering_left": ["alpha_l"],
        "steering_right": ["alpha_r"],
        "straight": ["x"],
        "rotation": ["gamma"],
        "lateral": ["y"],
    }


def test_a_lane_change_gives_rows_of_force_and_of_steering(record: Record, vehicle: VehicleDescription) -> None:
    straight = next(record.of(Step.STRAIGHT))
    rows = equations_of(replace(straight, step="lane_change"), vehicle.geometry, Processing())
    assert [row.coordinate for row in rows] == ["alpha_v", "x"]
    assert rows[1].moving.any()
    assert not rows[0].moving.any(), "steering that stands still is stiction"


def test_odometry_of_a_step_is_the_motion_that_was_driven(record: Record, vehicle: VehicleDescription) -> None:
    """The wheels of mode 4 stand on a circle: yaw is rolling over its radius."""
    rotation = next(record.of(Step.ROTATION))
    motion = motion_of(rotation, vehicle.geometry, Processing())
    geometry = vehicle.geometry
    circle = np.hypot(geometry.wheelbase, geometry.track_width) / 2 + geometry.wheel_offset
    rolling = np.gradient(rotation.wheel_angles[:, 2], rotation.sample_time)
    np.testing.assert_allclose(motion.rates[:, 2], rolling * geometry.wheel_radius / circle, atol=2e-3)
    np.testing.assert_allclose(motion.rates[:, :2], 0.0, atol=1e-9)


def test_steps_that_the_estimator_does_not_know_give_no_rows(record: Record, vehicle: VehicleDescription) -> None:
    stranger = replace(record.segments[0], step="my own")
    assert usable_equations([stranger], vehicle.geometry, Processing()) == []
