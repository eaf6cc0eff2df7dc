"""Masses, wheels and floor that differ from the file, against balances of force and moment and plain geometry."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from ident.extras import EngineName
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY

Make = Callable[..., object]


def acceleration(moving: object, torque: float) -> float:
    """Of the chassis, under a wheel torque of all four [m/s^2], from the distance of half a second from rest."""
    moving.torque([torque] * 4, 0.5)
    first = moving.vehicle.ground_truth()
    moving.torque([torque] * 4, 0.01)
    return (moving.vehicle.ground_truth().twist[0] - first.twist[0]) / 0.01


def expected_acceleration(moving: object, torque: float, mass: float, pull: float = 0.0) -> float:
    """Newton for four rolling wheels, friction by the speed that was measured."""
    p, r = moving.prototype.truth, moving.prototype.geometry.wheel_radius
    rate = moving.vehicle.ground_truth().wheel_rates[0]
    force = 4 * (torque - p["d_cw"] - p["d_vw"] * rate) / r - pull
    return force / (mass + 4 * p["B_w"] / r**2)


@pytest.mark.parametrize(
    ("text", "sign"), [("slope@chassis=0.5deg", 1.0), ("slope@chassis=0.5deg,direction=180deg", -1)]
)
def test_a_slope_pulls_with_the_weight_along_it(make: Make, text: str, sign: float) -> None:
    moving = make(text)
    mass = moving.prototype.truth["m_ch"]
    measured = acceleration(moving, 15.0)
    pull = sign * mass * GRAVITY * math.sin(math.radians(0.5))
    assert measured == pytest.approx(expected_acceleration(moving, 15.0, mass, pull), rel=2e-3)


def test_a_payload_is_a_mass_that_has_to_be_accelerated(make: Make) -> None:
    moving = make("payload@chassis=80kg,inertia=9kg m^2")
    measured = acceleration(moving, 15.0)
    assert measured == pytest.approx(expected_acceleration(moving, 15.0, moving.prototype.truth["m_ch"] + 80), rel=2e-3)


def test_a_changed_parameter_is_the_true_one(make: Make) -> None:
    moving = make("parameter_change@m_ch=-12%")
    measured = acceleration(moving, 15.0)
    assert measured == pytest.approx(
        expected_acceleration(moving, 15.0, 0.88 * moving.prototype.truth["m_ch"]), rel=2e-3
    )


def inertias(vehicle: object) -> tuple[float, np.ndarray, float]:
    """Mass [kg], centre of mass (2,) [m] and yaw inertia about the centre [kg m^2], summed over the engine's bodies."""
    mass, first, second = 0.0, np.zeros(2), 0.0
    for body in vehicle.engine.bodies().values():
        place = np.array(body.centre[:2])
        mass += body.mass
        first += body.mass * place
        second += body.inertia[2] + body.mass * place @ place
    return mass, first / mass, second


@pytest.mark.parametrize("symbol", ["C_l", "C_r", "m_ch", "C_ch", "B_w"])
@pytest.mark.parametrize("change", [0.2, -0.15])
def test_changed_inertias_are_read_back_from_the_engine(make: Make, symbol: str, change: float) -> None:
    moving = make(f"parameter_change@{symbol}={change}")
    p = {name: moving.prototype.truth[name] for name in PARAMETER_NAMES}
    p[symbol] *= 1 + change
    mass, _, yaw = inertias(moving.vehicle)
    assert mass == pytest.approx(p["m_ch"], rel=1e-6)
    assert yaw == pytest.approx(p["C_ch"] + p["C_l"] + p["C_r"], rel=1e-5)


def test_the_centre_of_mass_is_where_it_was_put_and_the_yaw_inertia_about_it_stays(make: Make) -> None:
    moving = make("com_offset@chassis=0.08m,y=-0.05m")
    p = moving.prototype.truth
    mass, centre, yaw = inertias(moving.vehicle)
    assert centre == pytest.approx([0.08, -0.05], abs=1e-5)
    assert yaw - mass * centre @ centre == pytest.approx(p["C_ch"] + p["C_l"] + p["C_r"], rel=1e-4)
    assert moving.vehicle.ground_truth().pose[:2] == pytest.approx([0.0, 0.0], abs=1e-4)


def test_a_load_stands_over_the_centre_wherever_the_centre_of_mass_is(make: Make) -> None:
    moving = make("com_offset@chassis=0.08m,y=-0.05m")
    before, centre, yaw = inertias(moving.vehicle)
    moving.vehicle.load(200.0)
    mass, loaded, with_it = inertias(moving.vehicle)
    assert mass == pytest.approx(before + 200.0)
    assert mass * loaded == pytest.approx(before * centre, rel=1e-3)
    assert with_it == pytest.approx(yaw, rel=1e-4)


def test_a_centre_of_mass_ahead_loads_the_front_wheels(make: Make) -> None:
    moving = make("com_offset@chassis=0.08m")
    fl, _, fr, _ = moving.vehicle.engine.floor_forces()
    front = fl[0] + fr[0]
    weight, wheelbase = moving.prototype.truth["m_ch"] * GRAVITY, moving.prototype.geometry.wheelbase
    assert front == pytest.approx(weight * (0.5 + 0.08 / wheelbase), rel=1e-3)


def test_heavy_wheel_units_keep_mass_and_yaw_inertia_and_leave_their_axes(make: Make) -> None:
    moving = make("steering_unit_mass@chassis=5kg")
    p, g = moving.prototype.truth, moving.prototype.geometry
    mass, centre, yaw = inertias(moving.vehicle)
    outward = g.track_width * g.wheel_offset + g.wheel_offset**2
    assert mass == pytest.approx(p["m_ch"], rel=1e-6)
    assert centre == pytest.approx([0.0, 0.0], abs=1e-6)
    # Wheels straight ahead: each extra mass stands at (l/2, b/2 + a) instead of its axis at (l/2, b/2).
    assert yaw - (p["C_ch"] + p["C_l"] + p["C_r"]) == pytest.approx(4 * 5 * outward, rel=1e-3)


def test_a_larger_wheel_rolls_further_a_turn(make: Make) -> None:
    moving = make("wheel_radius@wheel_fr=1.5mm")
    moving.torque([10.0] * 4, 1.5)
    truth = moving.vehicle.ground_truth()
    r = moving.prototype.geometry.wheel_radius
    radii = truth.pose[0] / np.array(truth.wheel_angles)
    assert radii == pytest.approx([r, r, r + 1.5e-3, r], abs=2e-6)


def test_an_eccentric_wheel_rolls_on_a_radius_that_changes_with_its_angle(make: Make) -> None:
    """x' = (r + e cos(beta + phase)) beta', integrated in closed form.

    An engine may let the point of contact move by half of what the tyre gives way: 1e-4 of the radius.
    """
    e, phase = 1.5e-4, 0.7
    moving = make(f"wheel_eccentricity@wheel_rl={e}m,phase={phase}rad")
    r = moving.prototype.geometry.wheel_radius
    for _ in range(13):
        moving.torque([8.0] * 4, 0.25)
        truth = moving.vehicle.ground_truth()
        beta = truth.wheel_angles[1]
        rolled = r * beta + e * (math.sin(beta + phase) - math.sin(phase))
        assert truth.pose[0] == pytest.approx(rolled, abs=2e-5 + 1e-4 * rolled)
    assert beta > 2 * math.pi


ROLLED_ON: dict[EngineName, list[float]] = {
    EngineName.PYBULLET: [0, 1, 0, 0],
    EngineName.MUJOCO: [1 / 8, 7 / 8, -1 / 8, 1 / 8],
}
"""First harmonic of the radii over the eccentricity of the rear left wheel: MuJoCo has its contacts half-way in."""


def test_wheels_roll_on_what_the_warp_leaves_them_as_far_as_contacts_of_the_engine_do(
    make: Make, engine_name: EngineName
) -> None:
    e, phase = 1.5e-4, 0.7
    moving = make(f"wheel_eccentricity@wheel_rl={e}m,phase={phase}rad")
    seen = []
    for _ in range(40):
        moving.torque([8.0] * 4, 0.1)
        truth = moving.vehicle.ground_truth()
        seen.append([truth.pose[0], *truth.wheel_angles])
    travel, beta = np.array(seen)[:, 0], np.array(seen)[:, 1:]
    assert beta.max() > 2.5 * np.pi
    turn = np.sin(beta[:, 1] + phase)
    harmonics = [
        np.linalg.lstsq(np.column_stack([turn, own, np.ones_like(own)]), travel, rcond=None)[0][0] for own in beta.T
    ]
    assert np.array(harmonics) / e == pytest.approx(ROLLED_ON[engine_name], abs=0.03)


def test_an_eccentric_wheel_works_against_its_load(make: Make) -> None:
    """Its axle stands at h = r + e cos(beta + phase): under a load N the torque on it is N e sin(beta + phase)."""
    e, phase = 1.5e-4, math.pi / 2
    eccentric, plain = make(f"wheel_eccentricity@wheel_fl={e}m,phase={phase}rad"), make()
    load, _ = eccentric.vehicle.engine.floor_forces()[0]
    for moving in (eccentric, plain):
        moving.torque([12.0] * 4, 0.05)
    p, r = plain.prototype.truth, plain.prototype.geometry.wheel_radius
    gained = eccentric.vehicle.ground_truth().twist[0] - plain.vehicle.ground_truth().twist[0]
    assert gained == pytest.approx(load * e / r / (p["m_ch"] + 4 * p["B_w"] / r**2) * 0.05, rel=0.1)


@pytest.mark.parametrize("text", ["slip@chassis=0.04", "slip@wheel_fl=0.04"])
def test_a_slippery_wheel_pulls_with_its_adhesion_and_spins(make: Make, text: str) -> None:
    moving = make(text)
    moving.torque([25.0] * 4, 0.2)
    load, friction = moving.vehicle.engine.floor_forces()[0]
    assert friction == pytest.approx(0.04 * load, rel=1e-3)
    truth = moving.vehicle.ground_truth()
    assert truth.wheel_rates[0] > 2 * truth.twist[0] / moving.prototype.geometry.wheel_radius
