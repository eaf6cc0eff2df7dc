from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.errors import EstimationError
from ident.estimate.identify import identify
from ident.estimate.result import Identification, KnownInertia
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters, parameter_column

RecordOf = Callable[..., Record]
FOUR_STEPS = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)


@pytest.fixture(scope="module")
def record(record_of: RecordOf, vehicle: VehicleDescription, truth: Parameters) -> Record:
    return record_of(vehicle, truth)


@pytest.fixture(scope="module")
def identification(record: Record, vehicle: VehicleDescription) -> Identification:
    return identify(record, vehicle.geometry)


def test_parameters_of_a_perfect_record_are_recovered(identification: Identification, truth: Parameters) -> None:
    """What is left, some 1e-4, is the smoothing of the positions before they are differentiated."""
    np.testing.assert_allclose(identification.values, truth.values, rtol=3e-4)
    assert [estimate.name for estimate in identification.estimates] == list(PARAMETER_NAMES)


def test_the_four_steps_of_the_paper_suffice_when_wheel_inertia_is_known(
    record: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    four = Record([segment for segment in record.segments if segment.step in FOUR_STEPS], "four steps")
    found = identify(four, vehicle.geometry, known_inertia=KnownInertia(truth["B_w"], 0.0, "data sheet"))
    np.testing.assert_allclose(found.values, truth.values, rtol=3e-4)
    assert found["B_w"].method == "data sheet"
    assert found["B_w"].std == 0.0


def test_neither_the_order_of_steps_nor_steps_of_other_names_matter(
    record: Record, identification: Identification, vehicle: VehicleDescription
) -> None:
    stranger = replace(record.segments[0], step="a step of my own")
    shuffled = Record([stranger, *reversed(record.segments)], "shuffled")
    np.testing.assert_allclose(identify(shuffled, vehicle.geometry).values, identification.values, rtol=1e-9)


def test_fitted_residuals_are_a_small_fraction_of_the_signal(identification: Identification) -> None:
    for floor in identification.floors:
        assert floor.nrmse < 2e-3, (floor.step, floor.coordinate)


def test_the_condition_number_is_that_of_the_rows_that_were_used(identification: Identification) -> None:
    used = [rows for rows in identification.equations if rows.step != Step.WHEEL_LIFTED]
    theta = np.concatenate([rows.regressor[rows.moving] for rows in used])[:, :-1]
    gram = theta.T @ theta
    norms = np.sqrt(np.diag(gram))
    assert identification.condition == pytest.approx(np.linalg.cond(gram / np.outer(norms, norms)), rel=1e-6)


def test_independence_is_what_the_other_columns_leave_of_a_column(identification: Identification) -> None:
    used = [rows for rows in identification.equations if rows.step != Step.WHEEL_LIFTED]
    theta = np.concatenate([rows.regressor[rows.moving] for rows in used])[:, :-1]
    for index, estimate in enumerate(identification.estimates[:-1]):
        others = np.delete(theta, index, axis=1)
        others = others / np.linalg.norm(others, axis=0)
        left = theta[:, index] - others @ np.linalg.lstsq(others, theta[:, index], rcond=None)[0]
        expected = np.linalg.norm(left) / np.linalg.norm(theta[:, index])
        assert estimate.independence == pytest.approx(expected, rel=1e-6)


@pytest.fixture(scope="module")
def four_steps(record: Record) -> Record:
    return Record([segment for segment in record.segments if segment.step in FOUR_STEPS], "four steps")


def test_an_error_of_the_wheel_inertia_moves_the_inertias_as_kappa_says(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    """On the prototype 50 % of B_w are 24 kg of the vehicle: 4/r^2 of it."""
    geometry, b_w = vehicle.geometry, truth["B_w"]
    right = identify(four_steps, geometry, known_inertia=KnownInertia(b_w, 0.0, "truth"))
    wrong = identify(four_steps, geometry, known_inertia=KnownInertia(1.5 * b_w, 0.0, "50 % off"))
    moved = wrong.values - right.values
    steering = 2 * (geometry.wheel_offset / geometry.wheel_radius) ** 2
    lever = np.hypot(geometry.wheelbase, geometry.track_width) / 2 + geometry.wheel_offset
    per_inertia = {
        "C_l": -steering,
        "C_r": -steering,
        "m_ch": -4 / geometry.wheel_radius**2,
        "C_ch": -4 * (lever / geometry.wheel_radius) ** 2 + 2 * steering,  # the total yaw inertia contains C_l + C_r
    }
    for name in PARAMETER_NAMES[:-1]:
        expected = per_inertia.get(name, 0.0) * 0.5 * b_w
        # m_ch and the frictions share rows, and the smoothing error of 1e-4 does not cancel exactly.
        assert moved[parameter_column(name)] == pytest.approx(expected, rel=2e-3, abs=1e-4 * truth[name]), name


def test_the_uncertainty_of_the_wheel_inertia_is_part_of_the_standard_deviations(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    std = 0.1 * truth["B_w"]
    sure = identify(four_steps, vehicle.geometry, known_inertia=KnownInertia(truth["B_w"], 0.0, "sure"))
    unsure = identify(four_steps, vehicle.geometry, known_inertia=KnownInertia(truth["B_w"], std, "unsure"))
    r = vehicle.geometry.wheel_radius
    assert unsure["m_ch"].b_w_std == pytest.approx(4 / r**2 * std, rel=2e-3)
    for name in PARAMETER_NAMES[:-1]:
        assert unsure[name].std == pytest.approx(np.hypot(sure[name].std, unsure[name].b_w_std))
        assert sure[name].b_w_std == 0.0
        assert unsure[name].value == sure[name].value
        assert unsure[name].naive_std == sure[name].naive_std
    low, high = unsure["m_ch"].ci95
    assert low < unsure["m_ch"].value - 1.9 * unsure["m_ch"].b_w_std
    assert high > unsure["m_ch"].value + 1.9 * unsure["m_ch"].b_w_std
    assert unsure.correlation[parameter_column("m_ch"), parameter_column("B_w")] == pytest.approx(-1.0, abs=1e-3)
    assert unsure["B_w"].std == std


def test_a_correlation_matrix_is_one(identification: Identification) -> None:
    correlation = identification.correlation
    np.testing.assert_allclose(correlation, correlation.T)
    np.testing.assert_allclose(np.diag(correlation), 1.0)
    assert np.linalg.eigvalsh(correlation).min() > -1e-9


@pytest.mark.parametrize(
    ("missing", "named"),
    [
        (Step.STEERING_LEFT, ("d_vl", "d_cl")),
        (Step.STEERING_RIGHT, ("d_vr", "d_cr")),
        (Step.STRAIGHT, ("m_ch",)),
        (Step.ROTATION, ("C_ch",)),
    ],
)
def test_a_missing_step_is_missed_by_the_parameters_it_excites(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters, missing: Step, named: tuple[str, ...]
) -> None:
    rest = Record([segment for segment in four_steps.segments if segment.step != missing], "three steps")
    with pytest.raises(EstimationError) as caught:
        identify(rest, vehicle.geometry, known_inertia=KnownInertia(truth["B_w"], 0.0, "truth"))
    assert all(name in caught.value.what for name in named)
    assert missing in caught.value.remedy


def test_motion_in_the_stiction_range_excites_nothing(
    record_of: RecordOf, vehicle: VehicleDescription, truth: Parameters
) -> None:
    slow = record_of(vehicle, truth, FOUR_STEPS, speed=0.002)
    with pytest.raises(EstimationError) as caught:
        identify(slow, vehicle.geometry, known_inertia=KnownInertia(truth["B_w"], 0.0, "truth"))
    assert "m_ch" in caught.value.what
    assert "d_cl" in caught.value.what
    assert "stiction" in caught.value.remedy


def at_one_speed(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters, noise: float, ripple: float = 0.0
) -> Record:
    """Straight in both directions at one speed, torques with white noise of that size [Nm]; other steps as they are.

    The speed has a ripple [rad/s] of 1 Hz, which alone accelerates the mass.
    """
    generator = np.random.default_rng(0)
    straight = next(four_steps.of(Step.STRAIGHT))
    time, geometry = straight.time, vehicle.geometry
    wheel, pulse = 5.0, 2 * np.pi
    angle = wheel * time + ripple / pulse * np.sin(pulse * time)
    rate, acceleration = wheel + ripple * np.cos(pulse * time), -ripple * pulse * np.sin(pulse * time)
    inertia = truth["m_ch"] * geometry.wheel_radius**2 / 4 + truth["B_w"]
    torque = (inertia * acceleration + truth["d_vw"] * rate + truth["d_cw"]) / geometry.gear_ratio
    runs = [
        replace(
            straight,
            step=str(Step.STRAIGHT),
            wheel_angles=np.tile((sign * angle)[:, None], 4),
            motor_torques=sign * torque[:, None] + noise * generator.normal(size=(len(time), 4)),
        )
        for sign in (1.0, -1.0)
    ]
    others = [segment for segment in four_steps.segments if segment.step != Step.STRAIGHT]
    return Record([*others, *runs], "one speed")


def test_driving_straight_with_hardly_any_acceleration_leaves_the_mass_poor(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    inertia = KnownInertia(truth["B_w"], 0.0, "truth")
    found = identify(at_one_speed(four_steps, vehicle, truth, 0.05, 0.0015), vehicle.geometry, known_inertia=inertia)
    assert found["m_ch"].poor
    assert abs(found["m_ch"].value - truth["m_ch"]) < 4 * found["m_ch"].std
    assert not found["C_ch"].poor


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_driving_straight_without_acceleration_is_refused_for_the_mass(
    four_steps: Record, vehicle: VehicleDescription, truth: Parameters, noise: float
) -> None:
    """Nothing but rounding, or noise, in the column of the mass."""
    inertia = KnownInertia(truth["B_w"], 0.0, "truth")
    with pytest.raises(EstimationError, match="m_ch") as caught:
        identify(at_one_speed(four_steps, vehicle, truth, noise), vehicle.geometry, known_inertia=inertia)
    assert "C_ch" not in caught.value.what
    assert "straight" in caught.value.remedy


def test_without_wheels_in_the_air_the_wheel_inertia_must_be_given(
    four_steps: Record, vehicle: VehicleDescription
) -> None:
    with pytest.raises(EstimationError, match="wheel_lifted") as caught:
        identify(four_steps, vehicle.geometry)
    assert "B_w" in caught.value.remedy


def test_a_record_of_other_steps_holds_nothing_to_identify(record: Record, vehicle: VehicleDescription) -> None:
    lifted = Record(list(record.of(Step.WHEEL_LIFTED)), "lifted only")
    with pytest.raises(EstimationError, match="none of the steps") as caught:
        identify(lifted, vehicle.geometry)
    assert "rotation" in caught.value.remedy
