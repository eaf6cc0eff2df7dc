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


@pytest.mark.parametrize(("torque", "rate"), [(4.0, 0.3), (0.6, 0.3), (0.6, 0.1), (0.6, -0.1)])
def test_scrub_is_a_dry_resistance_to_turning_on_the_spot(make: Make, torque: float, rate: float) -> None:
    """As much at a slow turn as at a fast one, however small it is."""
    scrubbing, plain = make(f"scrub@steering_left={torque}Nm"), make()
    g = plain.prototype.geometry
    ratio = g.wheel_offset / g.wheel_radius
    rates = [-ratio * rate, ratio * rate, 0.0, 0.0]
    with_scrub, without = (m.hold_speed(rates, 0.6 / abs(rate)) for m in (scrubbing, plain))
    steering = [-ratio * (torques[0] - torques[1]) for torques in (with_scrub, without)]
    assert steering[0] - steering[1] == pytest.approx(math.copysign(torque, rate), rel=0.02)


def test_scrub_does_not_resist_driving_straight(make: Make) -> None:
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


def test_a_gear_rubs_in_proportion_to_what_it_transmits() -> None:
    [effect] = [make_effect("friction_load", "wheels", {"share": 0.05})]
    now = Moment(0.0, None, [0.0] * 8, [0.0] * 8, [0.0] * 8, [8.0, -6.0, 0.0, 2.0], [1.0] * 8)
    for law in inject(load_prototype(), [effect], 1e-3).laws:
        law(now)
    assert now.coulomb == pytest.approx([1.0] * 4 + [1.4, 1.3, 1.0, 1.1])


@pytest.mark.parametrize("share", [-0.1, 1.0])
def test_a_gear_that_drives_itself_or_never_moves_is_refused(share: float) -> None:
    with pytest.raises(UserError, match="either drives itself or never moves"):
        inject(load_prototype(), [make_effect("friction_load", "wheel_fl", {"share": share})], 1e-3)


def test_a_loaded_gear_asks_for_more_torque_at_constant_speed(make: Make) -> None:
    """i_G u (1 - share) = d_c + d_v rate."""
    moving = make("friction_load@wheel_rr=0.1", lifted=True)
    p = moving.prototype.truth
    held = moving.hold_speed([3.0] * 4, 3.0)
    assert held[3] == pytest.approx((p["d_cw"] + 3 * p["d_vw"]) / 0.9, rel=2e-3)
    assert held[0] == pytest.approx(p["d_cw"] + 3 * p["d_vw"], rel=2e-3)


def test_bristles_build_up_over_an_angle_and_lose_work_in_a_cycle() -> None:
    """After a reversal the force is T (1 - 2 exp(-s/angle)) at a way s; the loop's area is lost."""
    effect = make_effect("presliding", "wheel_fl", {"amplitude": 0.5, "angle": 0.2})
    [law] = inject(load_prototype(), [effect], 1e-3).laws
    work, force = 0.0, []
    for rate in [*[1.0] * 3000, *[-1.0] * 3000, *[1.0] * 3000]:
        now = Moment(0.0, None, [0.0] * 8, [0.0] * 4 + [rate] * 4, [0.0] * 8, [0.0] * 4, [1.0] * 8)
        law(now)
        force.append(now.torques[4])
        work += now.torques[4] * rate * 1e-3
    way = 0.3
    assert force[3000 + round(way / 1e-3) - 1] == pytest.approx(0.5 * (1 - 2 * math.exp(-way / 0.2)), abs=1e-6)
    assert work < 0


def test_bristles_of_a_side_are_half_at_each_of_its_units() -> None:
    effect = make_effect("presliding", "steering_right", {"amplitude": 3.0})
    now = Moment(0.0, None, [0.0] * 8, [0, 0, 1e4, -1e4, 0, 0, 0, 0], [0.0] * 8, [0.0] * 4, [1.0] * 8)
    for law in inject(load_prototype(), [effect], 1e-3).laws:
        law(now)
    assert now.torques == pytest.approx([0, 0, -1.5, 1.5, 0, 0, 0, 0])


@pytest.mark.parametrize("values", [{"amplitude": -1.0}, {"amplitude": 1.0, "angle": 1e-8}])
def test_bristles_that_push_or_are_too_stiff_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(UserError, match="bristles"):
        inject(load_prototype(), [make_effect("presliding", "wheels", values)], 1e-3)


def test_friction_that_would_drive_a_steering_axis_is_refused() -> None:
    effect = make_effect("friction_position", "steering_left", {"slope": 50.0})
    with pytest.raises(UserError, match="more than the dry friction has to lose"):
        inject(load_prototype(), [effect], 1e-3)
