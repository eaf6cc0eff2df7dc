"""Gears and couplings that give way, against what two masses on a spring do in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.feed_forward import Course, feed_forward
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel, simulation_of
from ident.plant import dynamics
from ident.plant.modes import Mode
from ident.plant.simulation import Motion, Readings, Trajectory
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

DT = 0.002
COMPLIANCE = 5e-4
MOTOR_SHARE = 0.5
SOFT = make_effect("elasticity", "drive_fl", {"compliance": COMPLIANCE})
FRICTIONLESS = {name: 0.0 for name in ("d_vl", "d_cl", "d_vr", "d_cr", "d_vw", "d_cw")}


SENSE = np.array([-1.0, -1.0, 1.0, 1.0])
"""In which the wheels roll while the vehicle turns to the left on the spot."""


def turning(
    model: ExtendedModel, torques: Array, vehicle: VehicleDescription, speed: float = 0.8
) -> tuple[Trajectory, Array]:
    """On the spot, with what the encoders of the four wheels read, forward in the sense of the turn."""
    alpha = np.array([[-1.0, 1.0]]) * vehicle.geometry.rotation_angle
    start = Motion(np.zeros(1), alpha, np.zeros((1, 4)), np.array([[speed]]))
    run = simulation_of(model, Mode.ROTATION, vehicle.geometry).run(start, torques[None] * SENSE, DT)
    return run, run.readings.wheel_rates[0] * SENSE


def slow_wave(duration: float) -> Array:
    time = np.arange(0, duration, DT)
    return np.tile(0.6 * np.sin(4 * np.pi * time)[:, None], 4)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_motor_leads_its_wheel_by_compliance_times_load(vehicle: VehicleDescription) -> None:
    torques = slow_wave(0.3)
    _, wheels = turning(ExtendedModel(vehicle.prior, (SOFT,)), torques, vehicle)
    load = vehicle.geometry.gear_ratio * torques[:, 0] - MOTOR_SHARE * vehicle.prior["B_w"] * np.gradient(
        wheels[:, 1], DT
    )
    expected = COMPLIANCE * np.gradient(load, DT)
    assert rms((wheels[:, 0] - wheels[:, 1] - expected)[5:-5]) < 0.02 * rms(expected)


def test_motor_and_vehicle_swing_as_two_masses_on_a_spring(vehicle: VehicleDescription) -> None:
    p = vehicle.prior.replaced(**FRICTIONLESS)
    torques = np.zeros((100, 4))
    torques[2:, 0] = 0.5
    _, wheels = turning(ExtendedModel(p, (SOFT,)), torques, vehicle)
    twisting = wheels[10:, 0] - wheels[10:, 1]
    crossings = np.flatnonzero(np.diff(np.sign(twisting)))
    exact = crossings + twisting[crossings] / (twisting[crossings] - twisting[crossings + 1])
    motor, lever = MOTOR_SHARE * p["B_w"], vehicle.geometry.rotation_lever / vehicle.geometry.wheel_radius
    rest = (p["C_ch"] + p["C_l"] + p["C_r"]) / lever**2 + 4 * p["B_w"] - motor
    assert np.pi * 6 / ((exact[6] - exact[0]) * DT) == pytest.approx(
        np.sqrt((1 / motor + 1 / rest) / COMPLIANCE), rel=0.01
    )


def test_a_rear_unit_on_a_soft_coupling_turns_as_its_wheel_presses(vehicle: VehicleDescription) -> None:
    """Turning on the spot, both wheels of the left side press their units the same way; the rear one gives way."""
    g, p = vehicle.geometry, vehicle.prior.replaced(d_vl=0.0, d_cl=0.0)
    soft = make_effect("elasticity", "steering_left", {"compliance": COMPLIANCE})
    torques = slow_wave(0.3)
    run, wheels = turning(ExtendedModel(p, (soft,)), torques, vehicle, 2.0)
    found, rear = wheels[:, 1] - wheels[:, 0], wheels[:, 1]
    turned = np.gradient(run.velocities[0, :, 0] + found / g.lever_ratio, DT)
    lost = p["B_w"] * np.gradient(rear, DT) + p["d_vw"] * rear + p["d_cw"] * np.tanh(rear / 0.01)
    load = g.lever_ratio * (g.gear_ratio * torques[:, 1] - lost) - p["C_l"] / 2 * turned
    expected = g.lever_ratio * COMPLIANCE * np.gradient(load, DT)
    assert rms((found - expected)[5:-5]) < 0.03 * rms(expected)


def test_play_lets_a_motor_go_by_the_gap(vehicle: VehicleDescription) -> None:
    """Pressed first forward, then backward; compliance of the same gear softens the flanks."""
    gap = 0.01
    loose = make_effect("backlash", "drive_fl", {"gap": gap})
    torques, forward = np.full((round(0.7 / DT), 4), 0.6), round(0.2 / DT)
    torques[forward:] *= -1
    _, wheels = turning(ExtendedModel(vehicle.prior, (loose, SOFT)), torques, vehicle, 2.0)
    ahead = np.cumsum(wheels[:, 0] - wheels[:, 1]) * DT
    inertia = MOTOR_SHARE * vehicle.prior["B_w"] * np.gradient(wheels[:, 1], DT)
    load = vehicle.geometry.gear_ratio * torques[:, 1] - inertia
    settled = slice(-round(0.2 / DT), -1)  # it still bounces a little
    expected = gap + COMPLIANCE * (load[forward - 2] - load[settled].mean())
    assert ahead[forward - 1] - ahead[settled].mean() == pytest.approx(expected, rel=0.03)


def test_a_run_from_readings_starts_as_the_encoders_saw_it(vehicle: VehicleDescription) -> None:
    """What a run gives out in its middle, another one takes for its start and goes on alike."""
    worn = make_effect("wheel_radius", "wheel_rr", {"error": -0.001})
    model, torques, middle = ExtendedModel(vehicle.prior, (SOFT, worn)), slow_wave(0.2), round(0.1 / DT)
    whole, _ = turning(model, torques, vehicle)
    rates = whole.readings.wheel_rates
    alpha = np.array([[-1.0, 1.0]]) * vehicle.geometry.rotation_angle
    angle = np.asarray(np.trapezoid(rates[:, : middle + 1], dx=DT, axis=1))
    start = Motion(np.zeros(1), alpha, angle, whole.velocities[:, middle])
    read = Readings(whole.readings.steering_rates[:, middle : middle + 1], rates[:, middle : middle + 1])
    simulation = simulation_of(model, Mode.ROTATION, vehicle.geometry)
    rest = simulation.run_from_readings(start, read, torques[None, middle:] * SENSE, DT)
    assert np.abs(rest.readings.wheel_rates[0] - rates[0, middle:]).max() < 2e-3 * np.abs(rates).max()


def test_motors_behind_soft_and_loose_gears_are_asked_to_turn_ahead(vehicle: VehicleDescription) -> None:
    g, time = vehicle.geometry, np.arange(0, 0.5, DT)
    omega, width = 2 * np.pi * 4, 0.15
    velocities = (0.8 + width * np.sin(omega * time))[:, None]
    accelerations = (width * omega * np.cos(omega * time))[:, None]
    alpha = np.tile([[-g.rotation_angle, g.rotation_angle]], (len(time), 1))
    lever = g.rotation_lever / g.wheel_radius
    beta = SENSE * lever * (0.8 * time + width / omega * (1 - np.cos(omega * time)))[:, None]
    course = Course(Mode.ROTATION, np.zeros(len(time)), alpha, beta, velocities, accelerations, time)
    plain = dynamics.feed_forward(Mode.ROTATION, alpha, velocities, accelerations, vehicle.prior.values, g)
    model = ExtendedModel(vehicle.prior, (SOFT, make_effect("elasticity", "drive_rr", {"compliance": 1e-3})))
    demand = feed_forward(model, course, plain, g, DT)
    run, wheels = turning(model, demand.torques * SENSE, vehicle, velocities[0, 0])
    inside = slice(round(0.3 / DT), -round(0.05 / DT))
    assert rms((run.velocities[0] - velocities)[inside]) < 2e-3 * width
    ahead, wanted = wheels[:, 3] - lever * velocities[:, 0], np.gradient(demand.twists[:, 3], DT)
    assert rms((ahead - wanted)[inside]) < 0.05 * rms(wanted[inside])
