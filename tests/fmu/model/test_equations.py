"""The C code obeys the equations of the paper, in every posture, at any speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.plant import dynamics, kinematics
from ident.plant.kinematics import detect_mode
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import COULOMB_EPSILON

Array = NDArray[np.float64]

GRAVITY = 9.80665


def random_instance(core: Any, posture: Array, seed: int, *, slip: float = 1e-4) -> Any:
    """A vehicle in motion, its wheels slipping a little, its friction without memory, its stops far away."""
    generator = np.random.default_rng(seed)
    geometry = core.vehicle.geometry
    twist, steering = generator.normal(size=3) * 0.3, generator.normal(size=2) * 0.5
    rows = kinematics.constraint_matrix(posture, geometry)[0, 4:]
    wheels = (rows[:, :3] @ twist + rows[:, 3:5] @ steering) / geometry.wheel_radius + slip * generator.normal(size=4)
    instance = core.new(steering_limit=1e3)
    instance.x[:9] = [*twist, *steering, *wheels]
    instance.set(alpha_l=posture[0], alpha_r=posture[1], gamma=generator.normal())
    instance.u[:4] = generator.normal(size=4)
    return instance


def contact_forces(core: Any, slip: Array) -> Array:
    """Across the wheels, then along them (8,), written down by force and direction."""
    creep = core.table["creep_stiffness"].start
    largest = core.table["friction_limit_fl"].start * core.table["m_ch"].start * GRAVITY / 4
    forces = np.zeros(8)
    for wheel in range(4):
        velocity = slip[[wheel, wheel + 4]]
        speed = np.linalg.norm(velocity)
        size = largest / np.hypot(1.0, largest / (creep * speed))
        forces[[wheel, wheel + 4]] = -size * velocity / speed
    return forces


@pytest.mark.parametrize("seed", range(3))
def test_the_derivatives_fulfil_the_equations_of_motion_with_contact_forces_for_multipliers(
    core: Any, posture: Array, seed: int
) -> None:
    instance = random_instance(core, posture, seed)
    geometry, prior = core.vehicle.geometry, core.vehicle.prior
    rates, derivatives = instance.x[:9], instance.derivatives()
    rolling = kinematics.constraint_matrix(posture, geometry)[0]
    inertial = dynamics.regressor(rates, derivatives[:9])[0] @ prior.values
    motors = np.concatenate([np.zeros(5), geometry.gear_ratio * instance.u[:4]])
    floor = rolling.T @ contact_forces(core, rolling @ rates)
    scale = np.abs(motors).max() + np.abs(floor).max()
    np.testing.assert_allclose(inertial, motors + floor, rtol=1e-9, atol=1e-10 * scale)


def test_the_pose_moves_with_the_twist_turned_into_the_world(core: Any, posture: Array) -> None:
    instance = random_instance(core, posture, 7)
    derivative = dict(zip((row.name for row in core.table.variables[1:]), instance.derivatives(), strict=False))
    heading = np.exp(1j * instance["gamma"])
    velocity = heading * (instance["x_dot"] + 1j * instance["y_dot"])
    assert derivative["pose_x"] + 1j * derivative["pose_y"] == pytest.approx(velocity, rel=1e-12)
    assert derivative["gamma"] == instance["gamma_dot"]


def test_slip_is_what_the_constraints_leave(core: Any, posture: Array) -> None:
    instance = random_instance(core, posture, 11, slip=0.1)
    instance.outputs()
    expected = kinematics.constraint_matrix(posture, core.vehicle.geometry)[0] @ instance.x[:9]
    shown = [instance[f"slip_{way}_{wheel}"] for way in ("lat", "long") for wheel in WHEELS]
    np.testing.assert_allclose(shown, expected, atol=1e-13)


def test_contacts_take_power_and_never_more_than_friction_allows(core: Any, posture: Array) -> None:
    for exponent in range(-8, 3):
        instance = random_instance(core, posture, 3, slip=10.0**exponent)
        held = instance.copy()
        held.set(friction_limit_fl=1e-9, friction_limit_rl=1e-9, friction_limit_fr=1e-9, friction_limit_rr=1e-9)
        difference = instance.derivatives()[:9] - held.derivatives()[:9]
        prior = core.vehicle.prior
        masses = [prior["m_ch"], prior["m_ch"], sum(prior[name] for name in ("C_ch", "C_l", "C_r"))]
        floor = np.array([*masses, prior["C_l"], prior["C_r"], *[prior["B_w"]] * 4]) * difference
        along = floor[5:] / core.vehicle.geometry.wheel_radius
        assert floor @ instance.x[:9] <= 0.0
        assert np.abs(along).max() <= core.vehicle.limits.floor_friction * prior["m_ch"] * GRAVITY / 4 * (1 + 1e-9)


@pytest.mark.parametrize(
    ("mode", "angles", "names"),
    [
        (Mode.ALIGNMENT, (0.4, -0.9), ("Q_alpha_l", "Q_alpha_r")),
        (Mode.LATERAL, (-np.pi / 2, np.pi / 2), ("Q_y",)),
        (Mode.ROTATION, None, ("Q_gamma",)),
    ],
)
def test_generalized_torques_are_those_of_the_reduced_model(
    core: Any, mode: Mode, angles: tuple[float, float] | None, names: tuple[str, ...]
) -> None:
    geometry = core.vehicle.geometry
    alpha = np.array(angles or (-geometry.rotation_angle, geometry.rotation_angle))
    instance = core.new(alpha_l=alpha[0], alpha_r=alpha[1])
    instance.u[:4] = [0.3, -0.2, 0.7, 0.1]
    instance.outputs()
    expected = dynamics.generalized_torques(mode, alpha, instance.u[None, :4], geometry)[0]
    np.testing.assert_allclose([instance[name] for name in names], expected, rtol=1e-12)


def test_in_steered_motion_the_reduced_torques_are_projections_of_the_outputs(core: Any) -> None:
    geometry = core.vehicle.geometry
    alpha = kinematics.steering_from_virtual([0.2], geometry)[0]
    instance = core.new(alpha_l=alpha[0], alpha_r=alpha[1])
    instance.u[:4] = [0.3, -0.2, 0.7, 0.1]
    instance.outputs()
    outputs = np.array([instance[f"Q_{name}"] for name in ("x", "y", "gamma", "alpha_l", "alpha_r")])
    columns = kinematics.complement(Mode.STEERED, alpha, geometry)[0, :5]
    expected = dynamics.generalized_torques(Mode.STEERED, alpha, instance.u[None, :4], geometry)[0]
    np.testing.assert_allclose(columns.T @ outputs, expected, rtol=1e-12)


def test_the_mode_is_that_of_the_record_analysis_at_every_pair_of_angles(core: Any) -> None:
    geometry, generator = core.vehicle.geometry, np.random.default_rng(5)
    curve = kinematics.steering_from_virtual(np.linspace(-0.9, 0.9, 60) * geometry.rotation_angle, geometry)
    corners = geometry.rotation_angle * np.array([[-1.0, 1.0]]), np.pi / 2 * np.array([[-1.0, 1.0]])
    near = np.repeat(np.vstack([curve, *corners]), 8, axis=0)
    near += generator.uniform(-0.04, 0.04, near.shape)
    anywhere = generator.uniform(-1.6, 1.6, (400, 2))
    modes = set()
    for alpha in np.vstack([near, anywhere, curve, *corners, np.zeros((1, 2))]):
        instance = core.new(alpha_l=alpha[0], alpha_r=alpha[1])
        instance.update_discrete()
        assert instance.mode == int(detect_mode(alpha, geometry)), alpha
        modes.add(instance.mode)
    assert modes == {1, 2, 3, 4}


def test_every_pair_of_steering_angles_has_finite_derivatives(core: Any) -> None:
    angles = np.linspace(-1.62, 1.62, 37)
    for left in angles:
        for right in angles:
            instance = random_instance(core, np.array([left, right]), 1)
            assert np.isfinite(instance.derivatives()).all()
            assert np.isfinite(instance.outputs()).all()
            assert np.isfinite(instance.indicators()).all()


def test_friction_without_memory_is_that_of_the_paper(core: Any) -> None:
    instance = core.new(alpha_l_dot=0.004)
    prior = core.vehicle.prior
    resisting = prior["d_vl"] * 0.004 + prior["d_cl"] * np.tanh(0.004 / COULOMB_EPSILON)
    rolling = core.new(creep_stiffness=1e-9, alpha_l_dot=0.004).derivatives()[3]
    assert rolling == pytest.approx(-resisting / prior["C_l"], rel=1e-6)
    assert instance["stick_alpha_l"] == 0.0
