"""Friction that the prototype file does not have, measured by holding speeds, against the textbook curves."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from emulator.effects import inject
from emulator.effects.laws import Moment
from emulator.prototype import load_prototype
from ident.effects import make_effect
from ident.errors import UserError

Make = Callable[..., object]


@pytest.mark.parametrize("rate", [0.1, 0.3, 1.0, -0.3])
def test_the_stribeck_curve_is_measured_at_constant_speed(make: Make, rate: float) -> None:
    moving = make("stribeck@wheel_rl=1.5Nm,velocity=0.4rad/s", lifted=True)
    torque = moving.hold_speed([rate] * 4, 3.0)
    p = moving.prototype.truth
    plain = p["d_vw"] * rate + math.copysign(p["d_cw"], rate)
    extra = math.copysign(1.5 * math.exp(-((rate / 0.4) ** 2)), rate)
    assert torque == pytest.approx([plain, plain + extra, plain, plain], rel=2e-3)


def test_stribeck_raises_the_torque_at_which_a_wheel_breaks_away(make: Make) -> None:
    moving = make("stribeck@wheel_fl=1.5Nm", lifted=True)
    held = moving.prototype.truth["d_cw"] + 1.4
    moving.torque([held, 0.0, held, 0.0], 0.5)
    angles = moving.vehicle.ground_truth().wheel_angles
    assert abs(angles[0]) < 1e-5
    assert angles[2] > 0.5


@pytest.mark.parametrize("rate", [1.5, -1.5])
def test_asymmetric_friction_depends_on_the_direction(make: Make, rate: float) -> None:
    moving = make("asymmetric_coulomb@wheel_fl=0.8Nm", "asymmetric_viscous@wheel_rr=0.3", lifted=True)
    torque = moving.hold_speed([rate] * 4, 3.0)
    p, sign = moving.prototype.truth, math.copysign(1.0, rate)
    plain = p["d_vw"] * rate + sign * p["d_cw"]
    fl = p["d_vw"] * rate + sign * (p["d_cw"] + sign * 0.8)
    rr = (p["d_vw"] + sign * 0.3) * rate + sign * p["d_cw"]
    assert torque == pytest.approx([fl, plain, plain, rr], rel=2e-3)


@pytest.mark.parametrize(("torque", "moves"), [(4.6, False), (4.9, True), (-3.0, False), (-3.3, True)])
def test_asymmetric_coulomb_sticks_up_to_another_torque_each_way(make: Make, torque: float, moves: bool) -> None:
    moving = make("asymmetric_coulomb@wheels=0.8Nm", lifted=True)
    moving.torque([torque] * 4, 0.3)
    assert (abs(moving.vehicle.ground_truth().wheel_angles[0]) > 1e-4) is moves


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_side_steers_against_the_friction_of_its_two_units(make: Make, direction: float) -> None:
    """At constant steering rate: torque -s (a/r)(T_fl - T_rl) = friction of the side and of its rolling wheels."""
    moving = make("asymmetric_coulomb@steering_left=3Nm", "stribeck@steering_left=2Nm,velocity=0.5rad/s")
    g, p = moving.prototype.geometry, moving.prototype.truth
    rate, ratio = 0.4 * direction, g.wheel_offset / g.wheel_radius
    torque = moving.hold_speed([-ratio * rate, ratio * rate, 0.0, 0.0], 1.5)
    steering = -ratio * (torque[0] - torque[1])
    rolling = 2 * ratio * (p["d_vw"] * ratio * rate + direction * p["d_cw"])
    side = p["d_vl"] * rate + direction * p["d_cl"] + 3.0 + direction * 2.0 * math.exp(-((0.4 / 0.5) ** 2))
    assert steering == pytest.approx(side + rolling, rel=5e-3)


@pytest.mark.parametrize("rate", [4.0, -4.0])
def test_drag_grows_with_the_square_of_the_speed(make: Make, rate: float) -> None:
    moving = make("quadratic_drag@chassis=30N s^2/m^2", "quadratic_drag@wheel_fl=0.05")
    p, r = moving.prototype.truth, moving.prototype.geometry.wheel_radius
    torque = moving.hold_speed([rate] * 4, 9.0)
    plain = 4 * (p["d_vw"] * rate + math.copysign(p["d_cw"], rate))
    wheel, body = 0.05 * rate * abs(rate), 30 * (r * rate) * abs(r * rate) * r
    assert np.sum(torque) == pytest.approx(plain + wheel + body, rel=2e-3)


def test_scrub_resists_turning_on_the_spot_and_not_driving_straight(make: Make) -> None:
    scrubbing, plain = make("scrub@steering_left=4Nm"), make()
    g, rate = plain.prototype.geometry, 0.5
    ratio = g.wheel_offset / g.wheel_radius
    rates = [-ratio * rate, ratio * rate, 0.0, 0.0]
    with_scrub, without = (m.hold_speed(rates, 1.5) for m in (scrubbing, plain))
    steering = [-ratio * (torque[0] - torque[1]) for torque in (with_scrub, without)]
    assert steering[0] - steering[1] == pytest.approx(4.0, rel=0.02)
    straight = [m.hold_speed([2.0] * 4, 3.0) for m in (make("scrub@steering_left=4Nm"), make())]
    assert straight[0].sum() == pytest.approx(straight[1].sum(), rel=1e-3)


@pytest.mark.parametrize("angle", [0.8, -0.8])
def test_friction_over_the_position_is_the_same_at_both_units_of_a_side(angle: float) -> None:
    [effect] = [make_effect("friction_position", "steering_left", {"slope": 3.0})]
    # The rear unit turns against the front one.
    now = Moment(0.0, None, [angle, -angle, 0.5, -0.5, 0, 0, 0, 0], [0.1] * 8, [0.0] * 8, [0.0] * 4, [5.0] * 8)
    for law in inject(load_prototype(), [effect], 1e-3).laws:
        law(now)
    assert now.coulomb == pytest.approx([5.0 + 1.5 * angle] * 2 + [5.0] * 6)
    assert now.torques == [0.0] * 8


def test_friction_that_would_drive_a_steering_axis_is_refused() -> None:
    effect = make_effect("friction_position", "steering_left", {"slope": 50.0})
    with pytest.raises(UserError, match="more than the dry friction has to lose"):
        inject(load_prototype(), [effect], 1e-3)
