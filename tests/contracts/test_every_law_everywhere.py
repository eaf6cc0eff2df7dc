"""Every law without a name, at every place, through everything that takes effects."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Any, Final

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.effects import MEASURED, inject
from emulator.effects.laws import Moment
from emulator.prototype import load_prototype
from fmu.model.equations import equations
from fmu.table import variable_table
from fmu.variables import Block, Inputs
from ident.campaign.feed_forward import Course, feed_forward
from ident.diagnosis.names import refuse_strangers
from ident.effects import LAWS, Effect, at_single_places, make_effect, terms_of
from ident.effects.combining import combined
from ident.effects.extended import ExtendedModel, simulation_of
from ident.effects.laws import COUNT, coefficient
from ident.effects.text import effects_text, read_effects
from ident.errors import UserError
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.plant.places import CHASSIS, rows_of
from ident.plant.simulation import Motion
from ident.plant.terms import State
from ident.vehicle.description import load_vehicle

Array = NDArray[np.float64]

VEHICLE: Final = load_vehicle()
DT: Final = 0.002
NOT_EMULATED: Final = ("law_angle_acceleration",)
"""An inertia that changes with the angle would need other bodies at every step."""

EVERYWHERE: Final = [(kind.name, where) for kind in LAWS.values() for where in kind.places]
every_law_everywhere = pytest.mark.parametrize(("name", "where"), EVERYWHERE)


def law_at(name: str, where: str) -> Effect:
    """A wave over what a campaign goes through, around for wheels."""
    waves = {coefficient(index): 1.5 + np.sin(1.3 * index) for index in range(COUNT)}
    around = name.startswith("law_angle") and where.startswith("wheel")
    numbers = {"scale": 0.7, "start": -1.1, "step": 0.1, "period": 0.1 * COUNT if around else 0.0}
    if name == "law_time_direction":
        numbers |= {"start": 50.0, "step": 1.0}
    return make_effect(name, where, numbers | waves)


@every_law_everywhere
def test_in_a_file_it_comes_back(name: str, where: str) -> None:
    effect = law_at(name, where)
    [read] = read_effects(tomllib.loads(effects_text([effect])), "file")
    assert (read.name, read.where) == (name, where)
    assert [read[key] for key in effect.parameters] == pytest.approx([effect[key] for key in effect.parameters])


@pytest.mark.parametrize("name", LAWS)
def test_at_a_place_that_it_cannot_have_the_place_is_refused_and_not_its_units(name: str) -> None:
    text = effects_text([law_at(name, "wheel_rl")]).replace("wheel_rl", "encoder_left")
    with pytest.raises(UserError, match="encoder_left"):
        read_effects(tomllib.loads(text), "file")


@every_law_everywhere
def test_found_twice_it_stays_two(name: str, where: str) -> None:
    effect = law_at(name, where)
    assert combined([effect], [effect]) == (effect, effect)


@every_law_everywhere
def test_every_number_of_it_is_in_the_equations_of_the_fmu(name: str, where: str) -> None:
    effect = law_at(name, where)
    table = variable_table(VEHICLE, VEHICLE.prior, [effect])
    rows = [row.name for row in table.block(Block.PARAMETER)]
    model = equations(table, [effect], Inputs.TORQUE)
    pattern = ca.jacobian_sparsity(ca.vertcat(model.xd, model.y), model.p)
    used = {rows[place] for place in set(np.array(pattern.get_triplet()[1]).tolist())}
    assert {f"{name}.{where}.{parameter}" for parameter in effect.parameters} <= used


@every_law_everywhere
def test_the_emulator_has_the_same_torque_or_says_why_not(name: str, where: str) -> None:
    effect, generator = law_at(name, where), np.random.default_rng(3)
    if name in NOT_EMULATED:
        with pytest.raises(UserError, match="no such effect"):
            inject(load_prototype(), [effect], 1e-3)
        return
    assert list(effect.parameters) == list(MEASURED[name].units)
    injection = inject(load_prototype(), [effect], 1e-3)
    for _ in range(20):
        alpha, beta, rates = generator.uniform(-1.5, 1.5, 2), generator.uniform(-9, 9, 4), generator.uniform(-1, 1, 9)
        chassis = Floor((rates[0], rates[1], rates[2]))
        moment = _moment(chassis, alpha, beta, rates[3:], 60.0 + generator.uniform(-20, 20))
        for law in injection.laws:
            law(moment)
        expected = _resisting(effect, alpha, beta, rates, moment.time)
        np.testing.assert_allclose([-chassis.ahead, 0.0, 0.0], expected[:3], atol=1e-9)
        np.testing.assert_allclose(_at_joints(moment, rates[3:]), expected[3:], atol=1e-9)


@dataclass
class Floor:
    """A chassis that moves as it is told, and knows how it is pushed."""

    moving: tuple[float, float, float]
    ahead: float = 0.0

    def twist(self) -> tuple[float, float, float]:
        """How it moves."""
        return self.moving

    def push(self, force: tuple[float, float, float]) -> None:
        """Ahead alone."""
        self.ahead += force[0]
        assert force[1:] == (0.0, 0.0)


def _moment(engine: Any, alpha: Array, beta: Array, rates: Array, time: float) -> Moment:
    """Eight joints that move as the six of the model do: rear units turn against the front ones."""
    steering = [alpha[0], -alpha[0], alpha[1], -alpha[1]]
    turning = [rates[0], -rates[0], rates[1], -rates[1]]
    return Moment(time, engine, [*steering, *beta], [*turning, *rates[2:]], [0.0] * 8, [0.0] * 4, [10.0] * 8)


def _at_joints(moment: Moment, rates: Array) -> Array:
    """What resists at the six joints (6,) beyond the friction of 10 Nm that every joint has."""
    torques, dry = -np.array(moment.torques), np.array(moment.coulomb) - 10.0
    braked = dry * np.sign([rates[0], -rates[0], rates[1], -rates[1], *rates[2:]])
    total = torques + braked
    return np.array([total[0] - total[1], total[2] - total[3], *total[4:]])


def _resisting(effect: Effect, alpha: Array, beta: Array, rates: Array, time: float) -> Array:
    """The same and what resists the chassis (9,), by the terms of the model, a direction being a sign."""
    found = np.zeros(9)
    for term in terms_of([effect]):
        state = State(0.0, ca.DM(alpha), ca.DM(beta), ca.DM(rates), ca.DM.zeros(9), time)
        rows = term.forces(state, None, None) + term.dry_friction(state, None)  # type: ignore[arg-type]
        epsilon = ca.symvar(ca.SX(rows))
        function = ca.Function("rows", [ca.vertcat(*epsilon)], [rows])
        found += np.array(function(np.full(len(epsilon), 1e-6))).ravel()
    return found


def _course() -> Course:
    time = np.arange(0, 0.06, DT)
    velocities = np.stack([0.4 + 0.2 * np.sin(20 * time), 0.05 + 0.02 * np.cos(15 * time)], axis=1)
    accelerations = np.stack([4 * np.cos(20 * time), -0.3 * np.sin(15 * time)], axis=1)
    alpha = kinematics.steering_from_virtual(0.1 + 0.4 * time, VEHICLE.geometry)
    beta = np.tile(0.5 * time[:, None], 4) + 0.3
    return Course(Mode.STEERED, 0.2 + 0 * time, alpha, beta, velocities, accelerations, 60.0 + time)


COURSE: Final = _course()
PLAIN: Final = dynamics.feed_forward(
    COURSE.mode, COURSE.alpha, COURSE.velocities, COURSE.accelerations, VEHICLE.prior.values, VEHICLE.geometry
)


def _asked(*effects: Effect) -> Array:
    return feed_forward(ExtendedModel(VEHICLE.prior, effects), COURSE, PLAIN, VEHICLE.geometry, DT).torques


def _simulated(*effects: Effect) -> Array:
    start = Motion(np.array([0.2]), COURSE.alpha[:1], COURSE.beta[:1], COURSE.velocities[:1])
    model = ExtendedModel(VEHICLE.prior, effects)
    run = simulation_of(model, Mode.STEERED, VEHICLE.geometry).run(start, PLAIN[None, :12], DT, 60.0)
    return np.concatenate([run.readings.steering_rates.ravel(), run.readings.wheel_rates.ravel()])


@every_law_everywhere
def test_torques_are_asked_for_it_and_a_simulation_moves_otherwise_with_it(name: str, where: str) -> None:
    effect = law_at(name, where)
    assert np.abs(_asked(effect) - _asked()).max() > 1e-9
    assert np.abs(_simulated(effect) - _simulated()).max() > 1e-9
    singles = at_single_places([effect])
    np.testing.assert_allclose(_asked(effect), _asked(*singles), rtol=1e-9)


@every_law_everywhere
def test_a_diagnosis_judges_a_model_that_has_it_or_refuses_it(name: str, where: str) -> None:
    effect = law_at(name, where)
    assert rows_of(where) or where in CHASSIS
    if name == "law_time_direction":
        with pytest.raises(UserError, match="averages over repeats"):
            refuse_strangers([effect])
    else:
        refuse_strangers([effect])
