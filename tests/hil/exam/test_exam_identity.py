"""What no record of the four steps can tell apart, against what the physics says of it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from hil.exam.cases import Injected
from hil.exam.identity import Identities, identities, planned_record
from hil.exam.plans import CONFIRMING
from ident.campaign.plan import make_plan
from ident.campaign.steps import PERIODS
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.effects import EFFECTS
from ident.vehicle.description import load_vehicle

CYCLE = 0.004

SIDES = (("fl", "rl"), ("fr", "rr"))


@pytest.fixture(scope="module", params=["prototype", "compact"])
def known(request: pytest.FixtureRequest) -> Identities:
    """Of the four steps, for either geometry."""
    vehicle = load_vehicle(request.param)
    return identities(build_problem([ideal_record(FOUR, vehicle)], vehicle, vehicle.prior), vehicle)


def names(known: Identities, name: str, where: str, size: float = 1.0) -> frozenset[str]:
    return known.of(Injected(name, where, "", size)).names


def places(known: Identities, name: str, where: str) -> frozenset[str]:
    return known.of(Injected(name, where, "", 1.0)).places


def test_a_biased_torque_is_asymmetric_dry_friction_of_its_wheel(known: Identities) -> None:
    for wheel in ("fl", "rl", "fr", "rr"):
        for size in (-1.0, 1.0):
            both = {"torque_bias", "asymmetric_coulomb"}
            assert names(known, "torque_bias", f"drive_{wheel}", size) == both
            assert names(known, "asymmetric_coulomb", f"wheel_{wheel}", size) == both


def test_a_slope_along_the_only_heading_is_asymmetric_dry_friction_of_all_wheels(known: Identities) -> None:
    assert names(known, "slope", "chassis") == {"slope", "asymmetric_coulomb"}
    assert names(known, "asymmetric_coulomb", "wheels") == {"slope", "asymmetric_coulomb"}


def test_on_a_steering_side_it_is_neither(known: Identities) -> None:
    assert names(known, "asymmetric_coulomb", "steering_left") == {"asymmetric_coulomb"}


def test_more_mass_may_be_a_payload_and_less_may_not(known: Identities) -> None:
    assert names(known, "parameter_change", "m_ch", 0.05) == {"parameter_change", "payload"}
    assert names(known, "parameter_change", "m_ch", -0.05) == {"parameter_change"}
    assert names(known, "payload", "chassis", 20.0) == {"parameter_change", "payload"}


def test_what_the_steps_cannot_show_is_what_changed_values_do(known: Identities) -> None:
    for name, where in (("torque_gain", "drive_fl"), ("com_offset", "chassis"), ("steering_unit_mass", "chassis")):
        assert names(known, name, where) == {name, "parameter_change", "payload"}
    assert names(known, "hose_spring", "steering_left") == {"hose_spring"}


def test_another_inertia_alone_is_no_payload(known: Identities) -> None:
    for size in (-0.05, 0.05):
        assert names(known, "parameter_change", "C_ch", size) == {"parameter_change"}


@pytest.mark.parametrize("name", ["stribeck", "quadratic_drag"])
def test_front_and_rear_wheel_of_a_side_resist_alike(known: Identities, name: str) -> None:
    """Their speeds have one size in every mode, and friction that is odd in speed takes the same power from both."""
    for side, other in (SIDES, SIDES[::-1]):
        for wheel in side:
            alike = places(known, name, f"wheel_{wheel}")
            assert {f"wheel_{one}" for one in side} <= alike
            assert not {f"wheel_{one}" for one in other} & alike


def test_what_depends_on_the_direction_of_a_wheel_is_placed(known: Identities) -> None:
    """Front and rear wheel of a side turn against each other while it steers."""
    for wheel in itertools.chain(*SIDES):
        assert places(known, "asymmetric_viscous", f"wheel_{wheel}") == {f"wheel_{wheel}"}
        assert places(known, "wheel_radius", f"wheel_{wheel}") == {f"wheel_{wheel}"}


def test_every_effect_is_identical_to_itself_and_symmetrically_to_others(known: Identities) -> None:
    for spec in EFFECTS.values():
        for where in spec.places:
            own = known.of(Injected(spec.name, where, "", 1.0))
            assert spec.name in own.names
            assert where in own.places
            assert all(where in places(known, spec.name, other) for other in own.places)


def test_an_effect_without_a_candidate_is_like_nothing(known: Identities) -> None:
    assert names(known, "floor_waves", "chassis") == {"floor_waves"}


def test_the_planned_record_rolls_without_slipping() -> None:
    """Straight ahead, every wheel rolls the way over its radius."""
    vehicle = load_vehicle("prototype")
    plan = make_plan(
        vehicle, np.random.default_rng(3), steps=("straight",), periods=PERIODS, cycle=CYCLE, specs=CONFIRMING
    )
    (segment,) = planned_record(plan, vehicle.prior).segments
    way = replace(plan, periods=1).reference("straight", vehicle.prior).path[:, :1]
    assert segment.wheel_angles == pytest.approx(np.tile(way, 4) / vehicle.geometry.wheel_radius, abs=1e-3)
