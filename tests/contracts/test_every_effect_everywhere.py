"""Every effect, at every place, through everything that takes effects: nothing is skipped in silence.

What does not take an effect says so, and is listed here with the reason.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.effects import INJECTORS, inject
from emulator.prototype import load_prototype
from fmu.model.equations import equations
from fmu.parameter_rows import parameters_of
from fmu.table import neutral_effects, variable_table
from fmu.variables import Block, Inputs
from hil.exam.cases import Injected
from hil.exam.sealing import effect_of
from ident.campaign.feed_forward import Course, feed_forward
from ident.diagnosis.names import MEMORIES, EffectName, places_of, refuse_strangers
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.causes.bending import BristleCause
from ident.diagnosis.vehicle.records.inputs import INPUTS
from ident.diagnosis.vehicle.records.rows import Formulas, kinematic_coordinates
from ident.diagnosis.vehicle.records.sliding import sliding_cause
from ident.diagnosis.vehicle.records.transforms import transform_cause
from ident.effects import EFFECTS, Effect, at_single_places, make_effect
from ident.effects.combining import combined
from ident.effects.extended import ExtendedModel, simulation_of
from ident.effects.text import effects_text, parse_effect, read_effects
from ident.errors import UserError
from ident.estimate.equations import ROWS
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.plant.simulation import Motion
from ident.vehicle.description import load_vehicle

Array = NDArray[np.float64]

VEHICLE = load_vehicle()
ROOT = Path(__file__).parents[2]
DT = 0.002
EVERYWHERE = [(kind.name, where) for kind in EFFECTS.values() for where in kind.places]
every_effect_everywhere = pytest.mark.parametrize(("name", "where"), EVERYWHERE)

NOT_MADE_UP: Mapping[tuple[str, str], str] = {
    ("slip", ""): "no torque makes up for wheels that slide",
    ("time_delay", "encoder"): "encoders are the controller's business",
    ("steering_offset", "steering"): "encoders are the controller's business",
    ("elasticity", "steering"): "the inertia of a rear unit asks for less than a thousandth of what the steering needs",
    ("backlash", "steering"): "the same",
}
"""What a feed-forward leaves alone, as its documentation says."""


def effect_at(name: str, where: str) -> Effect:
    """As large as one meets it."""
    kind = EFFECTS[name]
    return make_effect(name, where, {kind.size.name: kind.usual(VEHICLE, at_single(name, where))})


def at_single(name: str, where: str) -> str:
    kind = EFFECTS[name]
    [first, *_] = at_single_places([make_effect(name, where, {kind.size.name: 1.0})])
    return first.where


def test_model_and_emulator_have_the_same_effects() -> None:
    assert set(EFFECTS) == {name for name, injector in INJECTORS.items() if injector.known}


@pytest.mark.parametrize("name", EFFECTS)
def test_model_and_emulator_agree_on_places_and_units(name: str) -> None:
    kind, injector = EFFECTS[name], INJECTORS[name]
    assert sorted(kind.places) == sorted(injector.places)
    assert {entry.name: entry.unit for entry in kind.parameters} == injector.units
    assert [kind.unit(kind.size.name, where) for where in kind.places] == [injector.unit(each) for each in kind.places]
    assert kind.size.name == injector.size


@pytest.mark.parametrize("name", EFFECTS)
def test_whatever_can_be_at_one_can_be_at_all_of_its_kind(name: str) -> None:
    places = EFFECTS[name].places
    for member, group in (
        ("steering_left", "steering"),
        ("wheel_fl", "wheels"),
        ("drive_rr", "drives"),
        ("encoder_left", "encoders"),
    ):
        assert (member in places) == (group in places)


@every_effect_everywhere
def test_written_on_a_command_line_and_in_a_file_it_comes_back(name: str, where: str) -> None:
    effect, kind = effect_at(name, where), EFFECTS[name]
    numbers = [
        f"{effect[entry.name]!r}{kind.unit(entry.name, where)}".removesuffix("1" if entry.unit == "1" else "")
        for entry in kind.parameters
    ]
    others = [f"{entry.name}={number}" for entry, number in zip(kind.parameters[1:], numbers[1:], strict=True)]
    typed = ",".join([numbers[0], *others])
    assert parse_effect(f"{name}@{where}={typed}") == effect
    [read] = read_effects(tomllib.loads(effects_text([effect])), "file")
    assert (read.name, read.where) == (name, where)
    assert [read[entry.name] for entry in kind.parameters] == pytest.approx(
        [effect[entry.name] for entry in kind.parameters]
    )


@every_effect_everywhere
def test_the_emulator_has_it_or_says_why_not(name: str, where: str) -> None:
    prototype = load_prototype()
    assert repr(inject(prototype, [effect_at(name, where)], 1e-3)) != repr(inject(prototype, [], 1e-3))


@every_effect_everywhere
def test_an_exam_injects_it_as_it_is(name: str, where: str) -> None:
    effect = effect_at(name, where)
    size = EFFECTS[name].size.name
    assert effect_of(Injected(name, where, size, effect[size])) == effect


@every_effect_everywhere
def test_found_twice_it_is_one_or_stays_two(name: str, where: str) -> None:
    effect, kind = effect_at(name, where), EFFECTS[name]
    together = combined([effect], [effect])
    if not kind.sums:
        assert together == (effect, effect)
        return
    assert len(together) == 1
    assert together[0].size == pytest.approx(2 * effect.size)


@every_effect_everywhere
def test_every_number_of_it_is_in_the_equations_of_the_fmu(name: str, where: str) -> None:
    effect = effect_at(name, where)
    table = variable_table(VEHICLE, VEHICLE.prior, [effect])
    rows = {row.name: row for row in table.block(Block.PARAMETER)}
    of_size = parameters_of(effect, EFFECTS[name].size.name)
    assert all(rows[parameter].start == effect.size for parameter in of_size)
    named = [parameter for entry in EFFECTS[name].parameters for parameter in parameters_of(effect, entry.name)]
    model = equations(table, [effect], Inputs.TORQUE)
    places = [list(rows).index(parameter) for parameter in named]
    pattern = ca.jacobian_sparsity(ca.vertcat(model.xd, model.y), model.p)
    used = set(np.array(pattern.get_triplet()[1]).tolist())
    assert set(places) <= used


def test_a_model_always_has_what_says_so() -> None:
    there = {effect.name for effect in neutral_effects()}
    assert there == {kind.name for kind in EFFECTS.values() if kind.always}


@cache
def course() -> Course:
    """A steered motion, slow and forward all the time, a minute after the start."""
    time = np.arange(0, 0.06, DT)
    velocities = np.stack([0.4 + 0.2 * np.sin(20 * time), 0.05 + 0.02 * np.cos(15 * time)], axis=1)
    accelerations = np.stack([4 * np.cos(20 * time), -0.3 * np.sin(15 * time)], axis=1)
    alpha = kinematics.steering_from_virtual(0.1 + 0.4 * time, VEHICLE.geometry)
    beta = np.tile(0.5 * time[:, None], 4) + 0.3
    return Course(Mode.STEERED, 0.2 + 0 * time, alpha, beta, velocities, accelerations, 60.0 + time)


@cache
def plain_torques() -> Array:
    of, g = course(), VEHICLE.geometry
    return dynamics.feed_forward(of.mode, of.alpha, of.velocities, of.accelerations, VEHICLE.prior.values, g)


def asked(*effects: Effect) -> Array:
    return feed_forward(ExtendedModel(VEHICLE.prior, effects), course(), plain_torques(), VEHICLE.geometry, DT).torques


def reason_for(name: str, where: str, listed: Mapping[tuple[str, str], str]) -> str | None:
    family = "encoder" if where.startswith("encoder") else "steering" if where.startswith("steering") else ""
    return listed.get((name, family)) or listed.get((name, ""))


@every_effect_everywhere
def test_torques_are_asked_for_it_or_it_is_known_why_not(name: str, where: str) -> None:
    change = np.abs(asked(effect_at(name, where)) - asked()).max()
    assert (change > 1e-9) == (reason_for(name, where, NOT_MADE_UP) is None)


def simulated(*effects: Effect) -> Array:
    model, of = ExtendedModel(VEHICLE.prior, effects), course()
    start = Motion(np.array([0.2]), of.alpha[:1], of.beta[:1], of.velocities[:1])
    run = simulation_of(model, Mode.STEERED, VEHICLE.geometry).run(start, plain_torques()[None, :12], DT, 60.0)
    read = run.readings
    late = [model.encoder_delays(), model.encoder_offsets()]
    return np.concatenate([read.steering_rates.ravel(), read.wheel_rates.ravel(), *late])


@cache
def plain_motion() -> Array:
    return simulated()


@every_effect_everywhere
def test_a_simulation_moves_otherwise_with_it(name: str, where: str) -> None:
    change = np.abs(simulated(effect_at(name, where)) - plain_motion()).max()
    # The reduced simulation takes wheels as rolling, and says so.
    assert (change > 1e-9) == (name != "slip")


@every_effect_everywhere
def test_rows_of_a_diagnosis_have_it_or_the_model_is_refused(name: str, where: str) -> None:
    effect = effect_at(name, where)
    if name not in set(EffectName):
        with pytest.raises(UserError, match="diagnosis cannot take into account"):
            refuse_strangers([effect])
        return
    refuse_strangers([effect])
    if EffectName(name) in MEMORIES:
        for single in at_single_places([effect]):
            assert memory_of(name, single.where)
        return
    assert any(_in_rows(name, where, channel, step) for channel in _CHANNELS for step in ROWS)


def memory_of(name: str, where: str) -> object:
    match EffectName(name):
        case EffectName.SLIP:
            return sliding_cause(where)
        case EffectName.PRESLIDING:
            return BristleCause(where).joints
        case known:
            return transform_cause(known, where)


_CHANNELS = (Channel.DYNAMIC, Channel.KINEMATIC)


def _in_rows(name: str, where: str, channel: Channel, step: str) -> bool:
    spec = ROWS[step]
    if channel is Channel.KINEMATIC and not kinematic_coordinates(spec):
        return False
    names = [entry.name for entry in EFFECTS[name].parameters]
    rows = Formulas().exact(channel, spec, EffectName(name), where)
    generator = np.random.default_rng(1)
    z = generator.normal(size=(3, INPUTS))
    constants = (VEHICLE.geometry.as_vector(), np.array([0.01]), VEHICLE.prior.values)
    size = np.array([effect_at(name, where)[entry] for entry in names])
    none = np.array([EFFECTS[name].neutral()[entry] for entry in names])
    return bool(np.abs(rows(z, *constants, size) - rows(z, *constants, none)).max() > 1e-9)


@pytest.mark.parametrize("name", EffectName)
def test_the_diagnosis_looks_for_its_causes_where_they_can_be(name: EffectName) -> None:
    assert set(places_of(name)) <= set(EFFECTS[name].places)


def test_terms_at_a_group_are_those_at_its_members() -> None:
    """Of every effect that can be at a group: what it adds is the sum of what it adds at each member."""
    for name, where in EVERYWHERE:
        effect = effect_at(name, where)
        singles = at_single_places([effect])
        if len(singles) > 1 and reason_for(name, where, NOT_MADE_UP) is None:
            np.testing.assert_allclose(asked(effect), asked(*singles), rtol=1e-9, err_msg=f"{name}@{where}")


@pytest.mark.parametrize("side", ["ident", "emulator"])
def test_the_effect_shown_as_an_example_is_the_one_in_the_code(side: str) -> None:
    code = (ROOT / side / "effects" / "library" / "friction_warming.py").read_text().rstrip()
    shown = "\n".join(f"+{line}" for line in code.splitlines())
    assert shown in (ROOT / "docs" / "extending.md").read_text()
