from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

Array = NDArray[np.float64]

property_of = settings(max_examples=30, deadline=None, derandomize=True)
rate = st.floats(-2.0, 2.0)
pair = st.tuples(rate, rate)
share = st.floats(-0.8, 0.8)
modes = pytest.mark.parametrize("mode", list(Mode))


def steering_of(mode: Mode, free: tuple[float, float], virtual: float, geometry: Geometry) -> Array:
    return {
        Mode.ALIGNMENT: np.array([free]) / 2,
        Mode.STEERED: kinematics.steering_from_virtual(virtual * geometry.rotation_angle, geometry),
        Mode.LATERAL: np.array([[-np.pi / 2, np.pi / 2]]),
        Mode.ROTATION: np.array([[-geometry.rotation_angle, geometry.rotation_angle]]),
    }[mode]


def acceleration_energy(rates: Array, accelerations: Array, p: dict[str, float]) -> float:
    """Gibbs function of all bodies; the chassis by its path in space, traced a little way from here."""
    h = 1e-3

    def world_velocity(time: float) -> Array:
        heading = rates[2] * time + accelerations[2] * time**2 / 2
        x, y = rates[:2] + accelerations[:2] * time
        c, s = np.cos(heading), np.sin(heading)
        return np.array([c * x - s * y, s * x + c * y])

    acceleration = (8 * (world_velocity(h) - world_velocity(-h)) - (world_velocity(2 * h) - world_velocity(-2 * h))) / (
        12 * h
    )
    yaw_inertia = p["C_ch"] + p["C_l"] + p["C_r"]  # the approximation the paper makes for the steering units
    bodies = p["m_ch"] * acceleration @ acceleration + yaw_inertia * accelerations[2] ** 2
    units = p["C_l"] * accelerations[3] ** 2 + p["C_r"] * accelerations[4] ** 2
    return float(bodies + units + p["B_w"] * np.sum(accelerations[5:] ** 2)) / 2


def dissipation(rates: Array, p: dict[str, float]) -> float:
    """Rayleigh function: its gradient is the friction torque."""

    def axis(speed: Array, viscous: float, coulomb: float) -> float:
        ratio = np.abs(speed) / COULOMB_EPSILON
        log_cosh = ratio + np.log1p(np.exp(-2 * ratio)) - np.log(2)
        return float(np.sum(viscous * speed**2 / 2 + coulomb * COULOMB_EPSILON * log_cosh))

    steering = axis(rates[3:4], p["d_vl"], p["d_cl"]) + axis(rates[4:5], p["d_vr"], p["d_cr"])
    return steering + axis(rates[5:], p["d_vw"], p["d_cw"])


def gradient(function: Callable[[Array], float], at: Array, step: float) -> Array:
    unit = np.eye(len(at)) * step
    return np.array([(function(at + row) - function(at - row)) / (2 * step) for row in unit])


@property_of
@given(
    rates=st.lists(rate, min_size=9, max_size=9),
    accelerations=st.lists(rate, min_size=9, max_size=9),
)
def test_the_regressor_is_the_gradient_of_gibbs_and_rayleigh_functions(
    vehicle: VehicleDescription, rates: list[float], accelerations: list[float]
) -> None:
    velocity, acceleration = np.array(rates), np.array(accelerations)
    p = dict(zip(PARAMETER_NAMES, vehicle.prior.values.tolist(), strict=True))
    inertial = gradient(lambda a: acceleration_energy(velocity, a, p), acceleration, 1.0)  # quadratic: exact
    friction = gradient(lambda v: dissipation(v, p), velocity, 1e-5)
    found = dynamics.regressor(velocity, acceleration)[0] @ vehicle.prior.values
    np.testing.assert_allclose(found, inertial + friction, atol=2e-4)


@modes
@property_of
@given(free=pair, virtual=share, velocity=pair, acceleration=pair)
def test_motion_under_the_feed_forward_torques_obeys_newton_with_contact_forces(
    slip_of: Callable[[Array, Array], Array],
    mode: Mode,
    vehicle: VehicleDescription,
    free: tuple[float, float],
    virtual: float,
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
) -> None:
    """World coordinates, no projection, no centripetal terms: M q'' = B u - friction + contact forces.

    The contact forces keep the slip of wheels in space at zero; the torques of (21) must yield the motion asked for.
    """
    geometry, p = vehicle.geometry, vehicle.prior
    width = len(kinematics.GENERALIZED_VELOCITIES[mode])
    alpha = steering_of(mode, free, virtual, geometry)
    wanted = np.array([velocity[:width]]), np.array([acceleration[:width]])
    rates, accelerations = (values[0] for values in dynamics.lift_velocities(mode, alpha, *wanted, geometry))
    u = dynamics.feed_forward(mode, alpha, *wanted, p.values, geometry)[0]

    q = np.concatenate([[0.0, 0.0, 0.0], alpha[0], np.zeros(4)])
    mass = np.array([p["m_ch"], p["m_ch"], p["C_ch"] + p["C_l"] + p["C_r"], p["C_l"], p["C_r"], *[p["B_w"]] * 4])
    viscous = np.array([0, 0, 0, p["d_vl"], p["d_vr"], *[p["d_vw"]] * 4])
    coulomb = np.array([0, 0, 0, p["d_cl"], p["d_cr"], *[p["d_cw"]] * 4])
    drive = np.concatenate([np.zeros(5), geometry.gear_ratio * u])
    force = drive - viscous * rates - coulomb * np.tanh(rates / COULOMB_EPSILON)

    def constraints(at: Array) -> Array:
        rolling = np.stack([slip_of(at, unit) for unit in np.eye(9)], axis=1)
        return np.vstack([rolling, steering_constraint(mode, at, geometry)])

    h = 1e-4
    A = constraints(q)
    bias = (constraints(q + h * rates) - constraints(q - h * rates)) @ rates / (2 * h)
    system = np.block([[np.diag(mass), -A.T], [A, np.zeros((len(A), len(A)))]])
    found = np.linalg.lstsq(system, np.concatenate([force, -bias]), rcond=1e-9)[0][:9]
    world = accelerations.copy()
    world[:2] += rates[2] * np.array([-rates[1], rates[0]])  # the chassis frame turns
    np.testing.assert_allclose(found, world, atol=2e-4 * max(1.0, np.abs(world).max()))


def steering_constraint(mode: Mode, q: Array, geometry: Geometry) -> Array:
    """Rows that keep the steering on what the mode allows: free, on the common centre (6), or held."""
    hold = np.eye(9)[3:5]
    if mode is Mode.ALIGNMENT:
        return np.zeros((0, 9))
    if mode is not Mode.STEERED:
        return hold

    def gap(left: float, right: float) -> float:
        """(6) times both tangents: (l/2)(tan right - tan left) + b tan left tan right."""
        a, b = np.tan(left), np.tan(right)
        return float(geometry.wheelbase / 2 * (b - a) + geometry.track_width * a * b)

    return gradient(lambda alpha: gap(*alpha), q[3:5], 1e-6)[None] @ hold


@modes
@property_of
@given(free=pair, virtual=share, velocity=pair, acceleration=pair)
def test_motor_power_becomes_kinetic_energy_and_friction_heat(
    mode: Mode,
    vehicle: VehicleDescription,
    free: tuple[float, float],
    virtual: float,
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
) -> None:
    geometry, p = vehicle.geometry, vehicle.prior
    width = len(kinematics.GENERALIZED_VELOCITIES[mode])
    alpha = steering_of(mode, free, virtual, geometry)
    wanted = np.array([velocity[:width]]), np.array([acceleration[:width]])
    rates, accelerations = (values[0] for values in dynamics.lift_velocities(mode, alpha, *wanted, geometry))
    u = dynamics.feed_forward(mode, alpha, *wanted, p.values, geometry)[0]
    mass = np.array([p["m_ch"], p["m_ch"], p["C_ch"] + p["C_l"] + p["C_r"], p["C_l"], p["C_r"], *[p["B_w"]] * 4])
    stored = rates @ (mass * accelerations)  # d/dt of the kinetic energy; what turns the velocity does no work
    viscous = np.array([0, 0, 0, p["d_vl"], p["d_vr"], *[p["d_vw"]] * 4])
    coulomb = np.array([0, 0, 0, p["d_cl"], p["d_cr"], *[p["d_cw"]] * 4])
    heat = rates @ (viscous * rates + coulomb * np.tanh(rates / COULOMB_EPSILON))
    power = geometry.gear_ratio * u @ rates[5:]
    assert power == pytest.approx(stored + heat, rel=1e-9, abs=1e-6)


@modes
@property_of
@given(free=pair, virtual=share, velocity=pair, acceleration=pair)
def test_feed_forward_makes_the_wanted_forces_with_the_smallest_torques(
    mode: Mode,
    vehicle: VehicleDescription,
    free: tuple[float, float],
    virtual: float,
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
) -> None:
    geometry, p = vehicle.geometry, vehicle.prior.values
    width = len(kinematics.GENERALIZED_VELOCITIES[mode])
    alpha = steering_of(mode, free, virtual, geometry)
    wanted = np.array([velocity[:width]]), np.array([acceleration[:width]])
    u = dynamics.feed_forward(mode, alpha, *wanted, p, geometry)
    rates, accelerations = dynamics.lift_velocities(mode, alpha, *wanted, geometry)
    H = kinematics.complement(mode, alpha, geometry)[0]
    generalized = H.T @ dynamics.regressor(rates, accelerations)[0] @ p
    np.testing.assert_allclose(
        dynamics.generalized_torques(mode, alpha, u, geometry)[0], generalized, rtol=1e-9, atol=1e-8
    )
    input_rows = H.T @ np.vstack([np.zeros((5, 4)), geometry.gear_ratio * np.eye(4)])
    smallest, *_ = np.linalg.lstsq(input_rows, generalized, rcond=None)
    np.testing.assert_allclose(u[0], smallest, rtol=1e-8, atol=1e-9)


def test_a_lever_between_wheel_and_steering_axis_turns_wheel_torque_into_steering_torque(geometry: Geometry) -> None:
    """Pushing the left front wheel ahead and the rear one back turns both outwards: -a/r of the wheel torque each."""
    torque = 1.0
    u = np.array([[torque, -torque, 0.0, 0.0]])
    steering = dynamics.generalized_torques(Mode.ALIGNMENT, np.array([0.2, 0.1]), u, geometry)[0]
    expected = -2 * geometry.wheel_offset / geometry.wheel_radius * geometry.gear_ratio * torque
    np.testing.assert_allclose(steering, [expected, 0.0], atol=1e-12)


def test_wheel_torque_becomes_drive_force_at_the_wheel_radius(geometry: Geometry) -> None:
    force = dynamics.generalized_torques(Mode.STEERED, np.zeros(2), np.ones((1, 4)), geometry)[0, 1]
    assert force == pytest.approx(4 * geometry.gear_ratio / geometry.wheel_radius)


def test_driving_straight_feels_the_wheels_as_extra_mass(vehicle: VehicleDescription) -> None:
    """m_ch + 4 B_w / r^2, the combination that makes B_w and m_ch inseparable on the floor."""
    p, r = vehicle.prior.replaced(d_vw=0.0, d_cw=0.0), vehicle.geometry.wheel_radius
    u = dynamics.feed_forward(Mode.STEERED, np.zeros((1, 2)), [[0, 0.5]], [[0, 1.0]], p.values, vehicle.geometry)
    force = dynamics.generalized_torques(Mode.STEERED, np.zeros((1, 2)), u, vehicle.geometry)[0, 1]
    assert force == pytest.approx(p["m_ch"] + 4 * p["B_w"] / r**2)


def test_turning_on_the_spot_feels_the_wheels_at_their_lever(vehicle: VehicleDescription) -> None:
    p, g = vehicle.prior.replaced(d_vw=0.0, d_cw=0.0), vehicle.geometry
    lever = (np.hypot(g.wheelbase, g.track_width) / 2 + g.wheel_offset) / g.wheel_radius
    u = dynamics.feed_forward(Mode.ROTATION, np.zeros((1, 2)), [[0.5]], [[1.0]], p.values, g)
    torque = dynamics.generalized_torques(Mode.ROTATION, np.zeros((1, 2)), u, g)[0, 0]
    assert torque == pytest.approx(p["C_ch"] + p["C_l"] + p["C_r"] + 4 * p["B_w"] * lever**2)


def test_parameters_are_ordered_as_in_equation_18() -> None:
    assert PARAMETER_NAMES == ("C_l", "d_vl", "d_cl", "C_r", "d_vr", "d_cr", "m_ch", "C_ch", "d_vw", "d_cw", "B_w")


def test_coulomb_friction_saturates_at_the_width_that_is_asked_for() -> None:
    rates = np.zeros((1, 9))
    rates[0, 5] = 0.02
    column = PARAMETER_NAMES.index("d_cw")
    sharp, blunt = (dynamics.regressor(rates, np.zeros((1, 9)), epsilon)[0, 5, column] for epsilon in (0.01, 0.1))
    assert sharp == pytest.approx(np.tanh(2.0))
    assert blunt == pytest.approx(np.tanh(0.2))
