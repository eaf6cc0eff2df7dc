"""Two entries of an effect become one exactly where the equations of both are those of one."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from ident.effects import EFFECTS, Effect, make_effect, terms_of
from ident.effects.combining import combined
from ident.effects.extended import ExtendedModel
from ident.plant import symbolic, terms
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

STEEPEST = 0.02
"""Slope [rad] whose sine is the angle, but for a hundredth of a percent."""
KEPT = {
    "stribeck": {"velocity": 0.4},
    "torque_ripple": {"order": 3.0},
    "presliding": {"angle": 0.2},
    "wheel_eccentricity": {"warp": 0.5},
}
"""What two entries of one effect have in common."""
MEMORIES = ("time_delay", "torque_filter", "elasticity", "backlash")


def everything(effects: tuple[Effect, ...], vehicle: VehicleDescription) -> Array:
    """All that effects are in the equations, one number behind the other."""
    generator = np.random.default_rng(3)
    alpha, beta, rates, accelerations = (generator.normal(size=count) for count in (2, 4, 9, 9))
    loads = generator.normal(size=4)
    bent = {("wheels", row): float(generator.uniform(-1, 1)) for row in range(5, 9)}
    state = terms.State(0.3, alpha, beta, rates, accelerations, 100.0, loads, bent)
    there = terms_of(effects)
    parts = (
        terms.added_forces(there, state, vehicle.prior.values),
        terms.changed_parameters(there, vehicle.prior.values, state),
        terms.shaft_torques(there, np.array([1.0, -2.0, 3.0, 0.5]), beta),
        terms.rolling_radii(there, beta),
        terms.true_steering(there, alpha),
    )
    column = ca.densify(ca.vertcat(*parts))
    function = ca.Function("f", [symbolic.GEOMETRY, symbolic.EPSILON], [column])
    return np.asarray(function(vehicle.geometry.as_vector(), 0.01)).ravel()


def pair(name: str) -> tuple[Effect, Effect]:
    generator, spec = np.random.default_rng(5), EFFECTS[name]
    kept = KEPT.get(name, {})

    def one() -> Effect:
        values = {entry.name: float(generator.uniform(0.1, 0.9)) for entry in spec.parameters}
        values[spec.size.name] *= STEEPEST if name == "slope" else 1.0
        return make_effect(name, spec.places[-1], values | kept, dict.fromkeys(values, 0.1))

    return one(), one()


@pytest.mark.parametrize("name", sorted(EFFECTS.keys() - {*MEMORIES, "slip"}))
def test_the_one_does_what_the_two_did(name: str, vehicle: VehicleDescription) -> None:
    known, found = pair(name)
    one = combined([known], [found])
    assert len(one) == 1
    plain, summed, separate = (everything(each, vehicle) for each in ((), one, (known, found)))
    change = np.abs(separate - plain).max()
    assert change > 0
    np.testing.assert_allclose(summed, separate, atol=(1e-4 if name == "slope" else 1e-10) * change, rtol=0)


@pytest.mark.parametrize("name", MEMORIES)
def test_dead_times_time_constants_plays_and_compliances_add(name: str, vehicle: VehicleDescription) -> None:
    known, found = pair(name)
    together = combined([known], [found])
    assert len(together) == 1
    one, separate = (ExtendedModel(vehicle.prior, effects) for effects in (together, (known, found)))
    for of in (ExtendedModel.encoder_delays, ExtendedModel.drive_delays, ExtendedModel.drive_lags):
        np.testing.assert_allclose(of(one), of(separate))
    assert one.springs == separate.springs


def test_a_sum_is_as_sure_as_what_was_found_beside_the_known_part() -> None:
    generator = np.random.default_rng(1)
    known, found = pair("wheel_eccentricity")
    std = {"amplitude": 0.01 * found["amplitude"], "phase": 0.02}
    values = {name: found[name] for name in found.parameters}
    (one,) = combined([known], [make_effect(found.name, found.where, values, std)])
    amplitudes, phases = (values[name] + std[name] * generator.normal(size=200_000) for name in ("amplitude", "phase"))
    drawn = known["amplitude"] * np.exp(1j * known["phase"]) + amplitudes * np.exp(1j * phases)
    assert one.parameters["amplitude"].std == pytest.approx(np.abs(drawn).std(), rel=0.02)
    assert one.parameters["phase"].std == pytest.approx(np.angle(drawn).std(), rel=0.02)


def test_what_takes_all_of_an_effect_away_leaves_no_direction() -> None:
    ahead, back = (make_effect("slope", "chassis", {"angle": a}, {"angle": 0.1}) for a in (0.02, -0.02))
    (none,) = combined([ahead], [back])
    assert none["angle"] == 0
    assert none.parameters["direction"].std == pytest.approx(np.pi)


@pytest.mark.parametrize("name", ["stribeck", "torque_ripple", "wheel_eccentricity", "slip"])
def test_what_is_not_one_stays_two(name: str) -> None:
    """Friction that falls off elsewhere, a ripple of another order, another tyre; friction of floors is never added."""
    known, found = pair(name)
    other = {"velocity": 0.9, "order": 7.0, "warp": 1.0}
    values = {key: other.get(key, found[key]) for key in found.parameters}
    changed = make_effect(name, found.where, values)
    assert combined([known], [changed]) == (known, changed)


def test_estimates_of_one_number_that_agree_are_that_of_the_model() -> None:
    size = {"amplitude": 3.0, "velocity": 0.3}
    known = make_effect("stribeck", "steering_left", size, {"velocity": 0.004})
    found = make_effect("stribeck", "steering_left", size | {"velocity": 0.31}, {"velocity": 0.006})
    (one,) = combined([known], [found])
    assert (one["amplitude"], one["velocity"]) == (6.0, 0.3)
    surer = make_effect("stribeck", "steering_left", size | {"velocity": 0.31}, {"velocity": 0.001})
    assert len(combined([replace_std(known, 0.001)], [surer])) == 2


def replace_std(effect: Effect, velocity: float) -> Effect:
    return make_effect(effect.name, effect.where, {n: effect[n] for n in effect.parameters}, {"velocity": velocity})


def test_what_a_model_has_twice_is_left_to_whoever_wrote_it() -> None:
    two = tuple(make_effect("torque_bias", "drive_fl", {"bias": bias}) for bias in (0.1, 0.2))
    assert combined(two, []) == two


def test_other_places_and_names_are_left_alone() -> None:
    known, found = (make_effect("torque_bias", f"drive_{wheel}", {"bias": 0.1}) for wheel in ("fl", "rr"))
    assert combined([known], [found]) == (known, found)
