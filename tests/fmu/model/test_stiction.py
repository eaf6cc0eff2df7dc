"""Friction holds what it should hold, and lets go of what moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fmu.variables import Inputs
from ident.plant.contact import CREEP_STIFFNESS, Contacts

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


def slope_for(core: Any, force: float) -> float:
    """Angle at which the vehicle's weight pulls it down by a force [N]."""
    return float(np.arcsin(force / (core.vehicle.prior["m_ch"] * 9.80665)))


def wheel_friction(core: Any) -> float:
    """Force along the floor that the friction of all four wheels holds [N]."""
    return float(4 * core.vehicle.prior["d_cw"] / core.vehicle.geometry.wheel_radius)


def hours_travel(instance: Any) -> float:
    """How far the chassis gets in an hour [m]."""
    for _ in range(3600):
        instance.step(1.0)
    return float(np.hypot(instance["pose_x"], instance["pose_y"]))


@pytest.mark.parametrize("contacts", list(Contacts))
@pytest.mark.parametrize("downhill", ["slope_x", "slope_y"])
def test_a_vehicle_parked_at_half_of_its_friction_moves_less_than_a_millimetre_in_an_hour(
    core: Any, posture: np.ndarray, downhill: str, contacts: Contacts
) -> None:
    slope = {downhill: slope_for(core, 0.5 * wheel_friction(core))}
    stiffness = CREEP_STIFFNESS[contacts]
    instance = core.new(alpha_l=posture[0], alpha_r=posture[1], creep_stiffness=stiffness, **slope)
    assert hours_travel(instance) < 1e-3
    assert abs(instance["gamma"]) < 1e-3


@pytest.mark.parametrize("contacts", list(Contacts))
def test_a_vehicle_parked_by_its_drives_moves_less_than_a_millimetre_in_an_hour(
    core_of: Callable[..., Any], contacts: Contacts
) -> None:
    """On a slope that its friction alone does not hold; the drives are told to stand."""
    core = core_of("prototype", (), Inputs.SPEED)
    started = core.new(slope_x=0.05, creep_stiffness=CREEP_STIFFNESS[contacts])
    assert slope_for(core, wheel_friction(core)) < 0.05
    started.step(10.0)
    settled = started["pose_x"]
    for _ in range(3600):
        started.step(1.0)
    assert abs(started["pose_x"] - settled) < 1e-3


def test_a_vehicle_that_was_parked_starts_as_one_that_never_stood(core: Any) -> None:
    """What the contacts hold fades in motion and pushes nothing."""
    parked, fresh = (core.new(slope_x=slope_for(core, 0.5 * wheel_friction(core))) for _ in range(2))
    for _ in range(60):
        parked.step(1.0)
    origin = parked["pose_x"]
    for instance in (parked, fresh):
        instance.set(slope_x=0.0, torque_fl=1.0, torque_rl=1.0, torque_fr=1.0, torque_rr=1.0)
        for _ in range(1000):
            instance.step(0.002)
    assert fresh["pose_x"] > 0.5
    assert parked["pose_x"] - origin == pytest.approx(fresh["pose_x"], rel=1e-3)


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
