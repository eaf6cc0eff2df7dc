"""The independent vehicle moves as mechanics says, and has the effects that docs/effects.md describes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.plans import plan_exam
from hil.exam.sources import Source
from hil.exam.sources.campaigns import drive_campaign
from hil.exam.sources.independent import GRAVITY, Plant, Truth
from hil.exam.sources.lacking import Built
from hil.exam.worlds import world_of
from ident.campaign.plan import Plan
from ident.diagnosis.law.spline import Knots
from ident.effects import Effect, make_effect
from ident.effects.laws import COUNT, coefficient
from ident.errors import UserError
from ident.extras import EngineName
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription, load_vehicle

Array = NDArray[np.float64]

AHEAD = np.zeros((1, 2))


@pytest.fixture(scope="module")
def plan(prototype: VehicleDescription) -> Plan:
    return replace(plan_exam(prototype, 3, 0.002).fit, steps=("steering_left", "straight"), periods=1)


@pytest.fixture(scope="module")
def plain(plan: Plan) -> Record:
    return drive_campaign(plan, 1, (), noise=0.0)


@pytest.fixture(scope="module")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


def built(name: str, where: str, **values: float) -> Built:
    return Built().having([make_effect(name, where, values)])


def released(truth: Truth, vehicle: VehicleDescription, time: float) -> Array:
    """Velocities (9,) after some time without torques, from rest."""
    plant = Plant(truth, vehicle, AHEAD)
    for step in range(round(time / 1e-3)):
        plant.advance(np.zeros((1, 4)), np.zeros((1, 9)), step * 1e-3)
    return np.asarray(plant.velocity[0])


def frictionless(truth: Truth) -> Truth:
    kept = {name: 0.0 if name.startswith("d_") else value for name, value in truth.parameters.items()}
    return replace(truth, parameters=kept)


def test_a_vehicle_without_friction_rolls_down_a_slope_with_its_wheels(prototype: VehicleDescription) -> None:
    truth = frictionless(built("slope", "chassis", angle=0.02).truth)
    inertia = truth.parameters["m_ch"] + 4 * truth.parameters["B_w"] / prototype.geometry.wheel_radius**2
    wanted = -truth.parameters["m_ch"] * GRAVITY * np.sin(0.02) / inertia * 0.2
    assert released(truth, prototype, 0.2)[0] == pytest.approx(wanted, rel=1e-3)


def test_dry_friction_holds_it_on_a_lesser_slope(prototype: VehicleDescription) -> None:
    truth = built("slope", "chassis", angle=0.003).truth
    assert abs(released(truth, prototype, 1.0)[0]) < 1e-4


def test_a_wheel_of_another_radius_turns_as_much_less(plan: Plan, plain: Record) -> None:
    error = 0.001
    large = drive_campaign(plan, 1, [make_effect("wheel_radius", "wheel_fr", {"error": error})], noise=0.0)
    radius, angles = plan.vehicle.geometry.wheel_radius, large.segments[1].wheel_angles
    travel = np.ptp(angles[:, 2]) / np.ptp(angles[:, 3])
    assert travel == pytest.approx(radius / (radius + error), rel=2e-4)


def test_a_bias_is_made_up_for_and_not_seen_in_what_is_reported(plan: Plan, plain: Record) -> None:
    biased = drive_campaign(plan, 1, [make_effect("torque_bias", "drive_rl", {"bias": 0.05})], noise=0.0)
    moved = biased.segments[1].motor_torques.sum(axis=1) - plain.segments[1].motor_torques.sum(axis=1)
    moving = plain.segments[1].period >= 0
    assert np.mean(moved[moving]) == pytest.approx(-0.05, abs=0.02)


def test_an_encoder_reports_where_its_side_was(plan: Plan, plain: Record) -> None:
    late = drive_campaign(plan, 1, [make_effect("time_delay", "encoder_left", {"delay": 0.006})], noise=0.0)
    lag = _lag(late.segments[0].steering_angles[:, 0], late.segments[0].wheel_angles[:, 0])
    assert lag - _lag(plain.segments[0].steering_angles[:, 0], plain.segments[0].wheel_angles[:, 0]) == pytest.approx(
        3.0, abs=0.2
    )


def _lag(late: Array, early: Array) -> float:
    """Samples by which one series follows another that is proportional to it, by least squares of the derivative."""
    series, slope = early - early[0], np.gradient(early)
    columns = np.stack([series, slope], axis=1)
    share, part = np.linalg.lstsq(columns, late - late[0], rcond=None)[0]
    return float(-part / share)


@pytest.mark.parametrize("period", [0.0, 2 * np.pi])
def test_a_law_is_the_function_that_its_coefficients_say(period: float) -> None:
    generator = np.random.default_rng(4)
    step = period / COUNT if period else 0.1
    values = {coefficient(index): float(value) for index, value in enumerate(generator.normal(size=COUNT))}
    where = {"scale": 2.0, "start": -1.0, "step": step, "period": period}
    truth = Built().having([make_effect("law_angle", "wheel_rl", where | values)]).truth
    beta = generator.uniform(-9.0, 9.0, size=(50, 4))
    assert truth.resists is not None
    found = truth.resists(np.zeros((50, 2)), beta, np.zeros((50, 9)), 0.0)
    assert found[:, 6] == pytest.approx(2 * Knots(-1.0, step, period).basis(beta[:, 1]) @ list(values.values()))
    assert not found[:, [3, 4, 5, 7, 8]].any()


FRICTIONS: Mapping[str, Mapping[str, float]] = {
    "stribeck": {"amplitude": 3.0},
    "asymmetric_coulomb": {"imbalance": 1.0},
    "asymmetric_viscous": {"imbalance": 0.5},
    "quadratic_drag": {"coefficient": 0.05},
    "friction_warming": {"change": 0.3, "time": 5.0},
}


@pytest.mark.parametrize("name", FRICTIONS)
def test_two_frictions_of_single_wheels_are_one_of_both(name: str) -> None:
    alone = [make_effect(name, f"wheel_{wheel}", FRICTIONS[name]) for wheel in ("fl", "rl", "fr", "rr")]
    together = [make_effect(name, "wheels", FRICTIONS[name])]
    assert resistance(alone) == pytest.approx(resistance(together))


def resistance(effects: list[Effect]) -> Array:
    truth = Built().having(effects).truth
    rates = np.random.default_rng(2).normal(size=(20, 9))
    angles = np.zeros((20, 2)), np.zeros((20, 4))
    return np.stack(
        [np.zeros((20, 9)) if one is None else one(*angles, rates, 3.0) for one in (truth.resists, truth.dry)]
    )


def test_it_has_no_second_unit_behind_a_spring() -> None:
    with pytest.raises(UserError, match="has no elasticity@steering_left"):
        built("elasticity", "steering_left", compliance=1e-4)


@pytest.mark.parametrize(("engine", "vehicle"), [(EngineName.MUJOCO, "prototype"), (None, "compact")])
def test_it_is_one_vehicle_with_physics_of_its_own(engine: EngineName | None, vehicle: str) -> None:
    with pytest.raises(UserError, match="takes no --"):
        world_of(vehicle, engine, Source.FIRST_PRINCIPLES)
