"""The terms of effects against Lagrange's equations and mechanics by hand."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from ident.effects import EFFECTS, Effect, EffectTerm, effect_term, make_effect, symbolic_term, terms_of
from ident.plant import symbolic, terms
from ident.plant.places import WHEEL_PLACES, rows_of
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]

EPSILON = 0.01


def term_of(effect: Effect) -> EffectTerm:
    return terms_of([effect])[0]


@pytest.fixture
def state() -> terms.State:
    generator = np.random.default_rng(7)
    heading, alpha, beta = 0.7, generator.normal(size=2), generator.normal(size=4)
    rates, accelerations, loads = (generator.normal(size=count) for count in (9, 9, 4))
    joints = [(where, row) for where in EFFECTS["presliding"].places for row in rows_of(where)]
    bent = {joint: float(generator.uniform(-1, 1)) for joint in joints}
    return terms.State(heading, alpha, beta, rates, accelerations, 100.0, loads, bent)


def number(expression: object, geometry: Geometry) -> Array:
    function = ca.Function("f", [symbolic.GEOMETRY, symbolic.EPSILON], [ca.densify(ca.SX(expression))])
    return np.asarray(function(geometry.as_vector(), EPSILON)).ravel()


def forces(name: str, where: str, state: terms.State, vehicle: VehicleDescription, **values: float) -> Array:
    term = term_of(make_effect(name, where, values))
    return number(terms.added_forces([term], state, vehicle.prior.values), vehicle.geometry)


def lagrange(
    kinetic: object, potential: object, q: object, rates: object, state: terms.State, geometry: Geometry
) -> Array:
    """Generalized forces (5,) in the chassis frame from energies in world coordinates (X, Y, γ, α_l, α_r)."""
    accelerations = ca.SX.sym("qdd", 5)
    momentum = ca.gradient(kinetic, rates)
    force = ca.jtimes(momentum, q, rates) + ca.jtimes(momentum, rates, accelerations)
    force = force - ca.gradient(kinetic, q) + ca.gradient(potential, q)
    c, s = np.cos(state.heading), np.sin(state.heading)
    turn = np.array([[c, -s], [s, c]])
    x_rate, y_rate, yaw_rate = state.rates[:3]
    x_acc, y_acc = state.accelerations[:2]
    in_chassis = np.array([x_acc - y_rate * yaw_rate, y_acc + x_rate * yaw_rate])
    function = ca.Function("lagrange", [q, rates, accelerations, symbolic.GEOMETRY], [force])
    world = np.asarray(
        function(
            np.array([0.0, 0.0, state.heading, *state.alpha]),
            np.concatenate([turn @ state.rates[:2], state.rates[2:5]]),
            np.concatenate([turn @ in_chassis, state.accelerations[2:5]]),
            geometry.as_vector(),
        )
    ).ravel()
    return np.concatenate([turn.T @ world[:2], world[2:]])


def planar(angle: object) -> object:
    return ca.vertcat(ca.horzcat(ca.cos(angle), -ca.sin(angle)), ca.horzcat(ca.sin(angle), ca.cos(angle)))


def test_without_size_no_effect_changes_anything(state: terms.State, vehicle: VehicleDescription) -> None:
    everything = [effect_term(kind.name, where, kind.neutral()) for kind in EFFECTS.values() for where in kind.places]
    p, geometry = vehicle.prior.values, vehicle.geometry
    assert np.allclose(number(terms.added_forces(everything, state, p), geometry), 0, atol=1e-12)
    assert np.allclose(number(terms.changed_parameters(everything, p, state), geometry), p)
    torques = np.array([1.0, 2.0, 3.0, 4.0])
    assert np.allclose(number(terms.shaft_torques(everything, torques, state.beta), geometry), torques)
    assert np.allclose(number(terms.rolling_radii(everything, state.beta), geometry), geometry.wheel_radius)
    assert np.allclose(number(terms.true_steering(everything, state.alpha), geometry), state.alpha)


@pytest.mark.parametrize("load", [0.0, 120.0])
def test_a_centre_of_mass_off_the_centre_obeys_lagrange_on_a_slope(
    state: terms.State, vehicle: VehicleDescription, load: float
) -> None:
    """A load stands over the centre of the chassis, wherever the centre of mass is."""
    offset, angle, direction = np.array([0.11, -0.07]), 0.05, 0.4
    mass, inertia = vehicle.prior["m_ch"], vehicle.prior["C_ch"]
    q, rates = ca.SX.sym("q", 5), ca.SX.sym("qd", 5)
    centre = q[:2] + planar(q[2]) @ offset
    velocity = ca.jtimes(centre, q, rates)
    kinetic = (mass * ca.sumsqr(velocity) + load * ca.sumsqr(rates[:2]) + inertia * rates[2] ** 2) / 2
    uphill = np.array([np.cos(direction), np.sin(direction)])
    potential = GRAVITY * np.sin(angle) * ca.dot(mass * centre + load * q[:2], uphill)
    whole = lagrange(kinetic, potential, q, rates, state, vehicle.geometry)
    plain = mass * ca.sumsqr(rates[:2]) / 2 + inertia * rates[2] ** 2 / 2
    expected = whole - lagrange(plain, ca.SX(0), q, rates, state, vehicle.geometry)
    effects = [
        term_of(make_effect("com_offset", "chassis", {"x": offset[0], "y": offset[1]})),
        term_of(make_effect("slope", "chassis", {"angle": angle, "direction": direction})),
        term_of(make_effect("payload", "chassis", {"mass": load})),
    ]
    added = number(terms.added_forces(effects, state, vehicle.prior.values), vehicle.geometry)
    assert np.allclose(added[:5], expected, rtol=1e-9)
    assert np.allclose(added[5:], 0)


def test_steering_units_off_their_axes_obey_lagrange(state: terms.State, vehicle: VehicleDescription) -> None:
    mass, g = 6.0, vehicle.geometry
    q, rates = ca.SX.sym("q", 5), ca.SX.sym("qd", 5)
    kinetic = ca.SX(0)
    for front, side in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        column = 3 if side > 0 else 4
        axis = q[:2] + planar(q[2]) @ np.array([front * g.wheelbase / 2, side * g.track_width / 2])
        arm = planar(q[2] + front * q[column]) @ np.array([0.0, side * g.wheel_offset])
        contact, at_axis = ca.jtimes(axis + arm, q, rates), ca.jtimes(axis, q, rates)
        about_axis = g.wheel_offset**2 * (rates[2] + front * rates[column]) ** 2
        kinetic += mass / 2 * (ca.sumsqr(contact) - ca.sumsqr(at_axis) - about_axis)
    expected = lagrange(kinetic, ca.SX(0), q, rates, state, g)
    added = forces("steering_unit_mass", "chassis", state, vehicle, mass=mass)
    assert np.allclose(added[:5], expected, rtol=1e-9, atol=1e-12)


def test_a_payload_is_mass_and_inertia_of_the_chassis(state: terms.State, vehicle: VehicleDescription) -> None:
    theta = number(symbolic.regressor(state.rates, state.accelerations), vehicle.geometry).reshape(9, 11)
    added = forces("payload", "chassis", state, vehicle, mass=80.0, inertia=9.0)
    changed = Parameters(np.zeros(11), np.zeros(11)).replaced(m_ch=80.0, C_ch=9.0)
    assert np.allclose(added, theta @ changed.values)


@pytest.mark.parametrize(("rate", "where", "row"), [(0.4, "steering_right", 4), (-0.4, "wheel_rl", 6)])
def test_friction_adds_to_viscous_and_coulomb_by_direction(
    rate: float, where: str, row: int, state: terms.State, vehicle: VehicleDescription
) -> None:
    state.rates[row] = rate
    stribeck = forces("stribeck", where, state, vehicle, amplitude=3.0, velocity=0.4)
    assert stribeck[row] == pytest.approx(3.0 / np.e * np.sign(rate))
    # d_c + imbalance forward, d_c - imbalance backward: against the motion it is +imbalance both times.
    assert forces("asymmetric_coulomb", where, state, vehicle, imbalance=2.0)[row] == pytest.approx(2.0)
    viscous = forces("asymmetric_viscous", where, state, vehicle, imbalance=2.0)
    assert viscous[row] == pytest.approx(2.0 * abs(rate))
    assert np.count_nonzero(viscous) == 1


@pytest.mark.parametrize("rate", [0.4, -0.4])
def test_friction_over_the_position_resists_what_turns_more_where_it_stands_further(
    rate: float, state: terms.State, vehicle: VehicleDescription
) -> None:
    state.rates[3:5] = rate
    found = forces("friction_position", "steering", state, vehicle, slope=2.0)
    assert found[3:5] == pytest.approx(2.0 * state.alpha * np.sign(rate))
    assert np.count_nonzero(found) == 2


@pytest.mark.parametrize("rate", [0.4, -0.4])
def test_a_share_of_the_load_of_a_gear_resists_whichever_way_it_acts(
    rate: float, state: terms.State, vehicle: VehicleDescription
) -> None:
    state.rates[5:] = rate
    loaded = replace(state, loads=np.array([8.0, -6.0, 0.0, 2.0]))
    found = forces("friction_load", "wheels", loaded, vehicle, share=0.05)
    assert found[5:] == pytest.approx(0.05 * np.array([8.0, 6.0, 0.0, 2.0]) * np.sign(rate), abs=6e-4)
    assert not found[:5].any()


def test_bristles_resist_by_how_far_they_are_bent_wherever_they_move(
    state: terms.State, vehicle: VehicleDescription
) -> None:
    bent = replace(state, bent={("steering", 3): 0.7, ("steering", 4): -1.0})
    found = forces("presliding", "steering", bent, vehicle, amplitude=2.0)
    assert found == pytest.approx([0, 0, 0, 1.4, -2.0, 0, 0, 0, 0])


def test_drag_takes_power_whatever_the_direction(state: terms.State, vehicle: VehicleDescription) -> None:
    speed = np.hypot(*state.rates[:2])
    drag = forces("quadratic_drag", "chassis", state, vehicle, coefficient=30.0)
    assert drag @ state.rates == pytest.approx(30.0 * speed**3, rel=1e-6)
    wheel = forces("quadratic_drag", "wheels", state, vehicle, coefficient=0.1)
    assert np.allclose(wheel[5:], 0.1 * state.rates[5:] * abs(state.rates[5:]))


def test_scrub_resists_turning_on_the_spot_with_its_torque(vehicle: VehicleDescription) -> None:
    steering, turning = np.zeros(9), np.zeros(9)
    steering[3], turning[2] = -1.0, 1.0
    rest = np.zeros(9)
    at_steering = terms.State(0.0, np.zeros(2), np.zeros(4), steering, rest, 0.0)
    at_turning = terms.State(0.0, np.zeros(2), np.zeros(4), turning, rest, 0.0)
    side = forces("scrub", "steering_left", at_steering, vehicle, torque=5.0)
    assert np.allclose(side, [0, 0, 0, -5.0, 0, 0, 0, 0, 0])
    chassis = forces("scrub", "chassis", at_turning, vehicle, torque=5.0)
    assert np.allclose(chassis, [0, 0, 5.0, 0, 0, 0, 0, 0, 0])


def test_a_motor_gives_what_gain_bias_and_ripple_make_of_the_report(vehicle: VehicleDescription) -> None:
    effects = [
        term_of(make_effect("torque_gain", "drive_fl", {"error": 0.1})),
        term_of(make_effect("torque_bias", "drive_rl", {"bias": -0.2})),
        term_of(make_effect("torque_ripple", "drive_rr", {"amplitude": 0.3, "order": 2.0})),
    ]
    beta = np.array([0.0, 0.0, 0.0, 0.05])
    true = number(terms.shaft_torques(effects, np.ones(4), beta), vehicle.geometry)
    ripple = 0.3 * np.sin(2 * vehicle.geometry.gear_ratio * 0.05)
    assert np.allclose(true, [1.1, 0.8, 1.0, 1.0 + ripple])


def test_the_weight_on_an_eccentric_wheel_does_the_work_of_lifting_it(
    state: terms.State, vehicle: VehicleDescription
) -> None:
    """Power of the force is the rate of N (r + e cos(β + φ)), by differences; a load is lifted too."""
    e, phase, beta = 2e-4, 0.3, np.asarray(state.beta, dtype=float)
    values = {"amplitude": e, "phase": phase}
    effects = [
        term_of(make_effect("wheel_eccentricity", "wheel_fr", values)),
        term_of(make_effect("payload", "chassis", {"mass": 60.0})),
    ]
    both, load = (
        number(terms.added_forces(those, state, vehicle.prior.values), vehicle.geometry)
        for those in (effects, effects[1:])
    )
    force = both - load
    weight, step = (vehicle.prior["m_ch"] + 60.0) * GRAVITY / 4, 1e-6
    height = [weight * e * np.cos(beta[2] + turn + phase) for turn in (-step, step)]
    assert force[7] == pytest.approx((height[1] - height[0]) / (2 * step), rel=1e-6)
    assert np.count_nonzero(force) == 1


@pytest.mark.parametrize("wheel", range(4))
def test_a_rigid_vehicle_on_four_springs_takes_a_higher_wheel_by_a_quarter_in_its_warp(
    wheel: int, vehicle: VehicleDescription
) -> None:
    """Least squares of three heights of the chassis against what the wheels stand higher by."""
    e, warp, across = 2e-4, 0.5, np.array([[1, x, y] for y in (1, -1) for x in (1, -1)], dtype=float)
    higher = e * np.eye(4)[wheel]
    chassis = np.linalg.lstsq(across, higher, rcond=None)[0]
    given_way = higher - across @ chassis
    term = term_of(make_effect("wheel_eccentricity", WHEEL_PLACES[wheel], {"amplitude": e, "warp": warp}))
    radii = number(terms.rolling_radii([term], np.zeros(4)), vehicle.geometry)
    assert radii - vehicle.geometry.wheel_radius == pytest.approx(higher - warp * given_way)


def test_wheels_on_other_radii_still_roll(vehicle: VehicleDescription) -> None:
    effects = [
        term_of(make_effect("wheel_radius", "wheel_fl", {"error": -0.002})),
        term_of(make_effect("wheel_eccentricity", "wheel_rr", {"amplitude": 0.001, "phase": -0.4})),
    ]
    radii = terms.rolling_radii(effects, np.full(4, 0.4))
    H = terms.on_radii(symbolic.complement(symbolic.Mode.STEERED, np.array([0.1, 0.09])), radii)
    values = number(radii, vehicle.geometry)
    assert np.allclose(values - vehicle.geometry.wheel_radius, [-0.002, 0, 0, 0.001])
    plain = number(symbolic.complement(symbolic.Mode.STEERED, np.array([0.1, 0.09])), vehicle.geometry)
    rolled = number(H, vehicle.geometry).reshape(9, 2)[5:] * values[:, None]
    assert np.allclose(rolled, plain.reshape(9, 2)[5:] * vehicle.geometry.wheel_radius)


def test_every_parameter_symbol_has_its_own_name() -> None:
    every = [symbolic_term(kind.name, where) for kind in EFFECTS.values() for where in kind.places]
    names = [str(value) for term in every for value in term.values.values()]
    assert len(names) == len(set(names))
    assert len(PARAMETER_NAMES) == sum(name.startswith("parameter_change") for name in names)
