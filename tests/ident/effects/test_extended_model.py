"""A model with effects: written and read, asked for torques, and simulated under them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate

from ident.campaign.feed_forward import Course, feed_forward
from ident.effects import Effect, make_effect
from ident.effects.extended import ExtendedModel, simulation_of
from ident.parameters_file import read_model, write_model
from ident.plant import dynamics, kinematics
from ident.plant.lags import following
from ident.plant.modes import Mode
from ident.plant.simulation import Motion
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

SAMPLE_TIME = 0.002
EFFECTS = (
    make_effect("stribeck", "wheel_fl", {"amplitude": 1.5, "velocity": 0.4}),
    make_effect("asymmetric_viscous", "steering_left", {"imbalance": 0.4}),
    make_effect("slope", "chassis", {"angle": 0.01, "direction": 0.3}),
    make_effect("com_offset", "chassis", {"x": 0.05, "y": -0.03}),
    make_effect("torque_gain", "drive_rl", {"error": 0.08}),
    make_effect("torque_bias", "drive_fr", {"bias": 0.04}),
    make_effect("wheel_radius", "wheel_rr", {"error": -0.002}),
    make_effect("steering_unit_mass", "chassis", {"mass": 3.0}),
    make_effect("parameter_change", "d_vw", {"change": 0.3}),
    make_effect("friction_load", "wheels", {"share": 0.06}),
    make_effect("presliding", "wheel_rl", {"amplitude": 1.0, "angle": 0.3}),
    make_effect("presliding", "steering", {"amplitude": 2.0, "angle": 0.1}),
)


def course_of(mode: Mode, vehicle: VehicleDescription) -> tuple[Course, Array]:
    """A motion that does not stop on the way, and its time."""
    time = np.arange(0, 0.5, SAMPLE_TIME)
    names = kinematics.GENERALIZED_VELOCITIES[mode]
    # Speeds keep their sign: at a reversal friction jumps, and sampled torques cannot follow a jump.
    offset, swing = (0.8, 0.3) if mode is not Mode.STEERED else (0.5, 0.2)
    velocities = np.stack([offset + swing * np.sin((3 + k) * time) for k in range(len(names))], axis=1)
    accelerations = np.stack([swing * (3 + k) * np.cos((3 + k) * time) for k in range(len(names))], axis=1)
    g, heading, alpha = vehicle.geometry, np.zeros(len(time)), np.zeros((len(time), 2))
    positions = integrate.cumulative_simpson(velocities, x=time, axis=0, initial=0)
    if mode is Mode.ALIGNMENT:
        alpha = positions - 0.5
    elif mode is Mode.STEERED:
        alpha = kinematics.steering_from_virtual(0.6 * positions[:, 0] - 0.2, g)
        velocities[:, 0] *= 0.6
        accelerations[:, 0] *= 0.6
    rates, _ = dynamics.lift_velocities(mode, alpha, velocities, accelerations, g)
    radii = np.array([1, 1, 1, g.wheel_radius / (g.wheel_radius - 0.002)])
    turned = integrate.cumulative_simpson(rates[:, 5:] * radii, x=time, axis=0, initial=0)
    heading = integrate.cumulative_simpson(rates[:, 2], x=time, initial=0)
    return Course(mode, heading, alpha, turned, velocities, accelerations, time), time


def simulated(model: ExtendedModel, course: Course, torques: Array, vehicle: VehicleDescription) -> Array:
    start = Motion(course.heading[:1], course.alpha[:1], course.beta[:1], course.velocities[:1])
    simulation = simulation_of(model, course.mode, vehicle.geometry)
    return np.asarray(simulation.run(start, torques[None], SAMPLE_TIME).velocities[0])


@pytest.mark.parametrize("mode", list(Mode))
def test_torques_asked_for_give_the_motion_they_were_asked_for(mode: Mode, vehicle: VehicleDescription) -> None:
    course, _ = course_of(mode, vehicle)
    model = ExtendedModel(vehicle.prior, EFFECTS)
    p, g = vehicle.prior.values, vehicle.geometry
    plain = dynamics.feed_forward(mode, course.alpha, course.velocities, course.accelerations, p, g)
    torques = feed_forward(model, course, plain, g, SAMPLE_TIME).torques
    followed = simulated(model, course, torques, vehicle)
    scale = np.abs(course.velocities).max()
    assert np.abs(followed - course.velocities).max() < 1e-3 * scale
    without = simulated(model, course, plain, vehicle)
    assert np.abs(without - course.velocities).max() > 0.01 * scale


@pytest.mark.parametrize("mode", list(Mode))
def test_without_effects_the_torques_are_those_of_the_plain_model(mode: Mode, vehicle: VehicleDescription) -> None:
    course, _ = course_of(mode, vehicle)
    p, g = vehicle.prior.values, vehicle.geometry
    plain = dynamics.feed_forward(mode, course.alpha, course.velocities, course.accelerations, p, g)
    asked = feed_forward(ExtendedModel(vehicle.prior), course, plain, g, SAMPLE_TIME)
    assert np.allclose(asked.torques, plain, atol=1e-9)
    assert not asked.twists.any()


def test_coasting_ends_where_viscous_and_coulomb_friction_say(vehicle: VehicleDescription) -> None:
    """(m + 4 B_w/r²) v̇ = -4 d_v/r² v - 4 d_c/r has the closed form v + c = (v₀ + c) exp(-t/τ)."""
    p, r = vehicle.prior, vehicle.geometry.wheel_radius
    mass, viscous, dry = p["m_ch"] + 4 * p["B_w"] / r**2, 4 * p["d_vw"] / r**2, 4 * p["d_cw"] / r
    time = np.arange(0, 0.5, SAMPLE_TIME)
    expected = (1.0 + dry / viscous) * np.exp(-viscous / mass * time) - dry / viscous
    start = Motion(np.zeros(1), np.zeros((1, 2)), np.zeros((1, 4)), np.array([[0.0, 1.0]]))
    simulation = simulation_of(ExtendedModel(p), Mode.STEERED, vehicle.geometry)
    run = simulation.run(start, np.zeros((1, len(time), 4)), SAMPLE_TIME)
    assert np.allclose(run.velocities[0, :, 1], expected, atol=1e-5)


def test_runs_side_by_side_do_not_see_each_other(vehicle: VehicleDescription) -> None:
    speeds = np.array([[0.0, 0.3], [0.0, 0.9]])
    both = Motion(np.zeros(2), np.zeros((2, 2)), np.zeros((2, 4)), speeds)
    one = Motion(np.zeros(1), np.zeros((1, 2)), np.zeros((1, 4)), speeds[1:])
    simulation = simulation_of(ExtendedModel(vehicle.prior, EFFECTS), Mode.STEERED, vehicle.geometry)
    torques = np.full((2, 50, 4), 0.1)
    together, alone = simulation.run(both, torques, SAMPLE_TIME), simulation.run(one, torques[:1], SAMPLE_TIME)
    assert np.array_equal(together.velocities[1], alone.velocities[0])


def test_a_late_drive_is_asked_earlier(vehicle: VehicleDescription) -> None:
    late = (make_effect("time_delay", "drive_fl", {"delay": 0.01}),)
    course, time = course_of(Mode.ROTATION, vehicle)
    plain = np.tile(np.sin(3 * time)[:, None], 4)
    none = feed_forward(ExtendedModel(vehicle.prior), course, plain, vehicle.geometry, SAMPLE_TIME).torques
    asked = feed_forward(ExtendedModel(vehicle.prior, late), course, plain, vehicle.geometry, SAMPLE_TIME).torques
    assert np.allclose(asked[:-5, 0], none[5:, 0])
    assert np.array_equal(asked[:, 1:], none[:, 1:])


def test_a_drive_that_follows_is_asked_for_what_comes_out_of_it_as_wanted(vehicle: VehicleDescription) -> None:
    slow = (make_effect("torque_filter", "drive_fl", {"time": 0.02}),)
    course, time = course_of(Mode.ROTATION, vehicle)
    plain = np.tile(np.sin(3 * time)[:, None], 4)
    none = feed_forward(ExtendedModel(vehicle.prior), course, plain, vehicle.geometry, SAMPLE_TIME).torques
    asked = feed_forward(ExtendedModel(vehicle.prior, slow), course, plain, vehicle.geometry, SAMPLE_TIME).torques
    middle = slice(75, -25)
    assert following(asked[:, 0], 0.02, SAMPLE_TIME)[middle] == pytest.approx(none[middle, 0], abs=2e-3)
    assert np.abs(asked[middle, 0] - none[middle, 0]).max() > 0.02
    assert np.array_equal(asked[:, 1:], none[:, 1:])


@pytest.mark.parametrize("effects", [(), EFFECTS])
def test_a_model_is_read_as_it_was_written(
    effects: tuple[Effect, ...], vehicle: VehicleDescription, tmp_path: Path
) -> None:
    path = tmp_path / "parameters.toml"
    write_model(ExtendedModel(vehicle.prior, effects), path, {"run": "here"})
    again = read_model(path)
    assert np.allclose(again.parameters.values, vehicle.prior.values)
    assert np.allclose(again.parameters.std, vehicle.prior.std)
    assert [str(effect) for effect in again.effects] == [str(effect) for effect in effects]
    assert all(one.size == pytest.approx(other.size) for one, other in zip(again.effects, effects, strict=True))
    assert np.allclose(again.parameters.values, vehicle.prior.values)
