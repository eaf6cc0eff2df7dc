"""Friction holds what it should hold, and lets go of what moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

DRIFT = 2e-3


@pytest.fixture(scope="module")
def prototype(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype")


def breakaway(instance: Any) -> float:
    """Torque of front and rear motor, against each other, at which the left side starts to steer [Nm]."""
    geometry = instance.core.vehicle.geometry
    friction = instance["d_cl"] + 2 * geometry.lever_ratio * instance["d_cw"]
    return friction / (2 * geometry.gear_ratio * geometry.lever_ratio)


def steer(instance: Any, torque: float, duration: float, interval: float = 0.002) -> np.ndarray:
    """Angle of the left side over time under torques that only steer it."""
    instance.set(torque_fl=-torque, torque_rl=torque)
    angles = []
    for _ in range(round(duration / interval)):
        instance.step(interval)
        angles.append(instance["alpha_l"])
    return np.array(angles)


@pytest.mark.parametrize("part", [0.3, 0.6, 0.9, -0.9])
def test_a_held_steering_angle_holds_for_forty_seconds(core: Any, part: float) -> None:
    instance = core.new(alpha_l=0.3, alpha_r=-0.2)
    angles = steer(instance, part * breakaway(instance), 40.0, 0.01)
    assert np.abs(angles - 0.3).max() < DRIFT
    assert np.ptp(angles[-1000:]) < DRIFT / 40


def test_friction_of_the_paper_alone_creeps(prototype: Any) -> None:
    instance = prototype.new(alpha_l=0.3, stick_time=1e9)
    assert steer(instance, 0.5 * breakaway(instance), 40.0, 0.01)[-1] - 0.3 > 0.1


def test_steering_that_comes_to_rest_under_torque_stays_there(prototype: Any) -> None:
    instance = prototype.new()
    steer(instance, 3.0 * breakaway(instance), 0.2)
    assert instance["alpha_l_dot"] > 1.0
    held = 0.8 * breakaway(instance)
    angles = steer(instance, held, 3.0)
    rates = np.gradient(angles, 0.002)
    stopped = int(np.argmax(np.abs(rates) < 0.02))
    assert np.abs(angles[stopped:] - angles[stopped]).max() < DRIFT


@pytest.mark.parametrize(("frequency", "mean", "swing"), [(0.5, 0.4, 0.3), (0.5, 0.1, 0.5), (0.1, 0.3, 0.3)])
def test_a_swinging_torque_below_friction_does_not_walk_the_steering_away(
    prototype: Any, frequency: float, mean: float, swing: float
) -> None:
    instance = prototype.new(alpha_l=0.3)
    limit, angles = breakaway(instance), []
    for moment in np.arange(0.0, 40.0, 0.01):
        torque = (mean + swing * np.sin(2 * np.pi * frequency * moment)) * limit
        angles.append(steer(instance, torque, 0.01, 0.01)[0])
    period = round(1 / frequency / 0.01)
    assert abs(np.mean(angles[-period:]) - 0.3) < DRIFT


def test_steering_lets_go_just_above_its_friction(core: Any) -> None:
    instance = core.new()
    limit = breakaway(instance)
    assert steer(instance.copy(), 0.97 * limit, 10.0, 0.01)[-1] < 5e-3
    assert steer(instance, 1.05 * limit, 10.0, 0.01)[-1] > 0.5


def test_sliding_friction_is_that_of_the_paper_whatever_was_held_before(prototype: Any) -> None:
    """Constant torque, steady sliding: torque minus Coulomb friction is viscous friction."""
    instance = prototype.new(alpha_l=-1.5)
    steer(instance, 0.9 * breakaway(instance), 2.0)
    torque = 1.5 * breakaway(instance)
    steer(instance, torque, 1.1)
    geometry = prototype.vehicle.geometry
    at_axis = 2 * geometry.gear_ratio * geometry.lever_ratio * (torque - breakaway(instance))
    viscous = instance["d_vl"] + 2 * geometry.lever_ratio**2 * instance["d_vw"]
    assert instance["alpha_l_dot"] == pytest.approx(at_axis / viscous, rel=1e-3)


def test_a_parked_vehicle_stays_on_a_slope_that_its_wheels_hold(core: Any) -> None:
    """Nothing but the creep of the wheels and of friction that takes up the load."""
    grade = 0.5 * 4 * core.vehicle.prior["d_cw"] / core.vehicle.geometry.wheel_radius
    instance = core.new(slope_x=np.arcsin(grade / (core.vehicle.prior["m_ch"] * 9.80665)))
    for _ in range(4000):
        instance.step(0.01)
    creep = 40.0 * grade / (4 * core.table["creep_stiffness"].start)
    assert -1e-3 - creep < instance["pose_x"] < 0.0


def test_a_vehicle_on_a_steep_slope_rolls_down_as_gravity_and_friction_say(core: Any) -> None:
    prior, radius = core.vehicle.prior, core.vehicle.geometry.wheel_radius
    instance = core.new(slope_x=0.1)
    for _ in range(500):
        instance.step(0.002)
    mass = prior["m_ch"] + 4 * prior["B_w"] / radius**2
    weight = prior["m_ch"] * 9.80665 * np.sin(0.1) - 4 * prior["d_cw"] / radius
    viscous = 4 * prior["d_vw"] / radius**2
    expected = -weight / viscous * (1 - np.exp(-viscous / mass))
    assert instance["x_dot"] == pytest.approx(expected, rel=2e-3)
