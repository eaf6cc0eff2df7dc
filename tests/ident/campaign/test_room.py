from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.campaign.plan import Plan, Room, assemble_plan
from ident.campaign.reference import Reference
from ident.campaign.steps import ORDER, PERIODS
from ident.errors import CampaignError
from ident.plant.kinematics import constraint_matrix
from ident.records.record import Step
from ident.vehicle.geometry import Geometry

References = dict[Step, Reference]
CYCLE = 0.002


def wheel_contacts(geometry: Geometry, reference: Reference) -> np.ndarray:
    """World positions of the four wheel contacts along a step, (N * 4, 2)."""
    half = np.array([geometry.wheelbase / 2, geometry.track_width / 2])
    points = []
    for front, side in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        name = "alpha_l" if side > 0 else "alpha_r"
        steering = front * reference.tracks[name].position if name in reference.tracks else np.zeros(len(reference))
        x = front * half[0] - side * geometry.wheel_offset * np.sin(steering)
        y = side * half[1] + side * geometry.wheel_offset * np.cos(steering)
        c, s = np.cos(reference.path[:, 2]), np.sin(reference.path[:, 2])
        points.append(reference.path[:, :2] + np.stack([c * x - s * y, s * x + c * y], axis=1))
    return np.concatenate(points)


@pytest.fixture(scope="module")
def room(plan: Plan) -> Room:
    return plan.room()


def test_no_wheel_leaves_the_room_that_is_announced(plan: Plan, references: References, room: Room) -> None:
    contacts = np.concatenate([wheel_contacts(plan.vehicle.geometry, found) for found in references.values()])
    assert -room.behind <= contacts[:, 0].min()
    assert contacts[:, 0].max() <= room.ahead
    assert -room.right <= contacts[:, 1].min()
    assert contacts[:, 1].max() <= room.left


def test_the_room_is_the_bounding_box_of_the_circle_that_the_wheels_can_sweep(
    plan: Plan, references: References, room: Room
) -> None:
    geometry = plan.vehicle.geometry
    radius = np.hypot(geometry.wheelbase, geometry.track_width) / 2 + geometry.wheel_offset
    paths = np.vstack([found.path for found in references.values()])
    assert room.ahead == pytest.approx(paths[:, 0].max() + radius)
    assert room.behind == pytest.approx(-paths[:, 0].min() + radius)
    assert room.left == pytest.approx(paths[:, 1].max() + radius)
    assert room.right == pytest.approx(-paths[:, 1].min() + radius)
    assert room.length == pytest.approx(room.ahead + room.behind)
    assert room.width == pytest.approx(room.left + room.right)


def test_a_campaign_without_travel_needs_the_circle_alone(plan: Plan) -> None:
    standing = assemble_plan(
        plan.vehicle, plan.excitations, steps=[Step.STEERING_LEFT], periods=PERIODS, cycle=CYCLE
    ).room()
    length, width = plan.vehicle.geometry.footprint
    assert standing.length == pytest.approx(length)
    assert standing.width == pytest.approx(width)


@pytest.mark.parametrize(("which", "word"), [("floor_length", "long"), ("floor_width", "wide")])
def test_too_small_a_floor_is_refused_before_anything_moves(plan: Plan, which: str, word: str) -> None:
    """Steering at standstill needs the circle of the wheels; here a centimetre less is there."""
    need = plan.vehicle.geometry.footprint[0]
    small = replace(plan.vehicle, limits=replace(plan.vehicle.limits, **{which: need - 0.01}))
    with pytest.raises(CampaignError, match=f"{need:.2f} m {word}") as caught:
        assemble_plan(small, plan.excitations, steps=[Step.STEERING_LEFT], periods=PERIODS, cycle=CYCLE)
    assert "floor_length" in caught.value.remedy


def test_the_steps_are_driven_in_the_order_that_knows_the_heading(plan: Plan) -> None:
    """Straight before rotation, so that the direction of travel is still known (paper, section 6.2)."""
    shuffled = assemble_plan(
        plan.vehicle, plan.excitations, steps=list(reversed(ORDER)), periods=PERIODS, cycle=CYCLE
    ).steps
    assert shuffled == ORDER
    assert shuffled.index(Step.STRAIGHT) < shuffled.index(Step.ROTATION)
    assert shuffled[-1] is Step.LANE_CHANGE


def test_a_campaign_needs_steps_and_enough_periods(plan: Plan) -> None:
    with pytest.raises(CampaignError, match="no step"):
        assemble_plan(plan.vehicle, plan.excitations, steps=[], periods=PERIODS, cycle=CYCLE)
    with pytest.raises(CampaignError, match="periods") as caught:
        assemble_plan(plan.vehicle, plan.excitations, steps=ORDER, periods=PERIODS - 1, cycle=CYCLE)
    assert str(PERIODS) in caught.value.remedy


def test_the_contacts_of_this_test_are_those_of_the_model(plan: Plan, references: References) -> None:
    """A yaw rate moves each contact at its lever, which the longitudinal rows of the constraints know as well."""
    geometry = plan.vehicle.geometry
    contacts = wheel_contacts(geometry, references[Step.ROTATION]).reshape(4, -1, 2)[:, 0]
    rows = constraint_matrix(plan.posture(Step.ROTATION), geometry)[0, 4:, 2]
    np.testing.assert_allclose(np.hypot(*contacts.T), np.abs(rows))
