"""Sizes in noise units: proportional to the effect, blind to what the model absorbs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from emulator.effects import Wanted
from emulator.prototype import load_prototype
from hil.exam.noise_units import Noise, SizeInNoise, size_in_noise
from hil.exam.plans import plan_exam, plans_from_text, plans_text
from hil.exam.worlds import world_of
from ident.campaign.plan import Plan
from ident.effects.text import parse_effect
from ident.estimate.equations import usable_equations
from ident.estimate.filters import Processing
from ident.records.record import Record
from ident.vehicle.description import load_vehicle

pytestmark = pytest.mark.slow

CYCLE = 0.002
PROTOTYPE = world_of("prototype", None)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return replace(plan_exam(load_vehicle("prototype"), 3, CYCLE).fit, periods=1)


@pytest.fixture(scope="module")
def plain(plan: Plan) -> Record:
    return PROTOTYPE.drive_quietly(plan, ())


def size(plan: Plan, plain: Record, *effects: Wanted) -> SizeInNoise:
    steps = {"steering_left": "alpha_l", "steering_right": "alpha_r", "straight": "x", "rotation": "gamma"}
    noise = Noise({(step, name): 1.0 for step, name in steps.items()}, {step: np.ones(8) for step in steps})
    changed = PROTOTYPE.drive_quietly(plan, effects)
    return size_in_noise(noise, plain, changed, load_prototype().truth.values, plan.vehicle.geometry)


def test_twice_the_imbalance_is_twice_the_size(plan: Plan, plain: Record) -> None:
    once, twice = (
        size(plan, plain, parse_effect(f"asymmetric_coulomb@steering_left={imbalance}Nm")).torque
        for imbalance in (1.0, 2.0)
    )
    assert twice == pytest.approx(2 * once, rel=0.1)
    # It is a constant of 1 Nm, of which the columns of this step alone absorb at least as much as those of all steps.
    rows = next(iter(usable_equations(list(plain.of("steering_left")), plan.vehicle.geometry, Processing())))
    columns = rows.regressor[rows.moving][:, rows.regressor.any(axis=0)]
    columns /= np.linalg.norm(columns, axis=0)
    constant = np.ones(len(columns))
    left = constant - columns @ np.linalg.lstsq(columns, constant, rcond=None)[0]
    assert 0.9 * np.sqrt(np.mean(left**2)) <= once <= 1.1


def test_a_changed_mass_is_a_drift_and_leaves_no_gap(plan: Plan, plain: Record) -> None:
    found = size(plan, plain, parse_effect("parameter_change@m_ch=5%"))
    assert found.drift > 10.0
    assert found.torque < 0.1 * found.drift


def test_another_radius_shows_in_the_constraints_alone(plan: Plan, plain: Record) -> None:
    found = size(plan, plain, parse_effect("wheel_radius@wheel_fl=1mm"))
    assert found.kinematic > 1e-3
    assert found.torque < 1.0


def test_plans_survive_being_written() -> None:
    vehicle = load_vehicle("prototype")
    plans = plan_exam(vehicle, 3, CYCLE)
    again = plans_from_text(plans_text(plans), vehicle, CYCLE)
    for one, other in ((plans.fit, again.fit), (plans.confirm, again.confirm)):
        for step in one.steps:
            first, second = (each.reference(step, vehicle.prior) for each in (one, other))
            assert np.array_equal(first.feed_forward, second.feed_forward)
