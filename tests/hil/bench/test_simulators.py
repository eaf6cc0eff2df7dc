"""An identified model as the emulated vehicle: its parameters in the bodies, its effects in the physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from emulator.effects import INJECTORS
from emulator.prototype import load_prototype
from hil.bench import emulation
from hil.bench.simulators import load_simulated, read_simulator
from hil.bench.truth import truth_of
from hil.network import network_file_of
from ident.effects import EFFECTS, Effect, make_effect
from ident.effects.extended import ExtendedModel
from ident.effects.text import parse_effect
from ident.errors import DataFileError, UserError
from ident.parameters_file import write_model
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

NETWORK = network_file_of("prototype")


def model_file(
    path: Path,
    effects: Sequence[Effect] = (),
    geometry: Geometry | None = None,
    parameters: Parameters | None = None,
) -> Path:
    values = parameters or truth_of("prototype").replaced(m_ch=900.0, C_l=0.31, d_cw=4.4)
    write_model(ExtendedModel(values, tuple(effects)), path, {"run": "test"}, geometry=geometry)
    return path


def test_the_bodies_add_up_to_the_parameters_of_the_file(tmp_path: Path) -> None:
    """Totals, by a sum of their own: m_ch of all bodies, C_l of two units about their axes."""
    simulator = read_simulator(model_file(tmp_path / "model.toml"))
    prototype = load_simulated("prototype", NETWORK, simulator).prototype
    assert prototype.truth.values == pytest.approx(simulator.model.parameters.values)
    bodies, offset = prototype.rigid_bodies, prototype.geometry.wheel_offset
    units = sum(knuckle.mass for knuckle in bodies.knuckles) + 4 * bodies.wheel.mass
    assert bodies.chassis.mass + units == pytest.approx(900.0)
    knuckle, wheel = bodies.knuckles[0], bodies.wheel
    about = knuckle.inertia[2] + knuckle.mass * knuckle.centre[1] ** 2 + wheel.inertia[2] + wheel.mass * offset**2
    assert 2 * about == pytest.approx(0.31)
    assert wheel.inertia[1] == pytest.approx(prototype.truth["B_w"])


def test_all_else_stays_that_of_the_prototype(tmp_path: Path) -> None:
    simulator = read_simulator(model_file(tmp_path / "model.toml"))
    made, own = load_simulated("prototype", NETWORK, simulator).prototype, load_prototype()
    for name in ("geometry", "tyre", "drive", "power_stage", "encoder", "noise", "floor_friction"):
        assert getattr(made, name) == getattr(own, name)


def test_a_vehicle_of_ones_own_gets_them_as_well(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(find_data_file("ident.vehicle", "prototype").read_text())
    simulator = read_simulator(model_file(tmp_path / "model.toml", geometry=load_vehicle("prototype").geometry))
    prototype = load_simulated(own, NETWORK, simulator).prototype
    assert prototype.truth["m_ch"] == 900.0


def test_no_model_is_the_prototype_as_it_is() -> None:
    prototype = load_simulated("prototype", NETWORK, None).prototype
    assert prototype.rigid_bodies == load_prototype().rigid_bodies
    assert prototype.truth.values.tolist() == load_prototype().truth.values.tolist()


def test_a_model_of_another_vehicle_is_refused_with_both_lengths(tmp_path: Path) -> None:
    compact = load_vehicle("compact").geometry
    simulator = read_simulator(model_file(tmp_path / "model.toml", geometry=compact))
    with pytest.raises(DataFileError, match=f"another vehicle than prototype: wheelbase {compact.wheelbase:.6g}"):
        load_simulated("prototype", NETWORK, simulator)


@pytest.mark.parametrize(
    ("changed", "words"),
    [({"C_l": 0.05}, "knuckle"), ({"m_ch": 3.0}, "weigh"), ({"d_cw": -1.0}, "d_cw = -1"), ({"B_w": 0.0}, "B_w = 0")],
)
def test_what_no_body_can_have_is_refused_and_the_file_is_named(
    tmp_path: Path, changed: dict[str, float], words: str
) -> None:
    path = model_file(tmp_path / "model.toml", parameters=truth_of("prototype").replaced(**changed))
    with pytest.raises(DataFileError, match=words) as caught:
        load_simulated("prototype", NETWORK, read_simulator(path))
    assert str(path) in caught.value.what


def test_what_was_assessed_as_unusable_is_taken_by_force_alone(tmp_path: Path) -> None:
    path = model_file(tmp_path / "model.toml")
    path.write_text(path.read_text() + '\n[assessment]\nverdict = "unusable"\n')
    with pytest.raises(UserError, match="unusable"):
        read_simulator(path)
    assert read_simulator(path, force=True).model.effects == ()


def test_more_of_an_effect_adds_up_and_another_one_comes_beside(tmp_path: Path) -> None:
    effects = [make_effect("torque_bias", "drive_fl", {"bias": 0.05}), parse_effect("slope@chassis=0.2deg")]
    simulator = read_simulator(model_file(tmp_path / "model.toml", effects))
    more = (parse_effect("torque_bias@drive_fl=0.02Nm"), parse_effect("payload@chassis=20kg"))
    sizes = {str(effect): effect.size for effect in simulator.with_more(more)}
    assert sizes["torque_bias@drive_fl"] == pytest.approx(0.07)
    assert sizes["payload@chassis"] == pytest.approx(20.0)
    assert len(sizes) == 3


def test_every_parameter_of_every_effect_reaches_the_emulated_vehicle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not its size alone: what the file says is what the injector is asked for."""
    seen: dict[str, dict[str, float]] = {}
    slope = make_effect("slope", "chassis", {"angle": 0.003, "direction": 1.1})
    stribeck = make_effect("stribeck", "steering_left", {"amplitude": 4.0, "velocity": 0.17})
    group = make_effect("asymmetric_coulomb", "wheels", {"imbalance": 0.5})
    path = model_file(tmp_path / "model.toml", [slope, stribeck, group])
    for name in ("slope", "stribeck", "asymmetric_coulomb"):
        known = INJECTORS[name]

        def noted(injection: object, effect: object, known: object = known) -> object:
            seen[f"{effect.effect.name}@{effect.where}"] = {unit: effect[unit] for unit in known.units}  # type: ignore[attr-defined]
            return known.inject(injection, effect)  # type: ignore[attr-defined]

        monkeypatch.setattr(
            "emulator.effects.INJECTORS", {**_injectors(), name: replace(known, inject=noted)}, raising=True
        )
    with emulation.vehicle("prototype", 1, False, NETWORK, simulator=read_simulator(path)):
        pass
    assert seen["asymmetric_coulomb@wheel_rr"] == {"imbalance": 0.5}
    assert len([key for key in seen if key.startswith("asymmetric_coulomb@")]) == 4
    assert seen["slope@chassis"] == pytest.approx({"angle": 0.003, "direction": 1.1})
    assert seen["stribeck@steering_left"] == pytest.approx({"amplitude": 4.0, "velocity": 0.17})


def _injectors() -> dict[str, object]:
    import emulator.effects

    return dict(emulator.effects.INJECTORS)


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ("slope@chassis=4deg", "roll away"),
        ("elasticity@drive_fl=1e-9rad/Nm", "stiffer than a step"),
        ("asymmetric_coulomb@steering_left=50Nm", "more than the friction"),
    ],
)
def test_an_effect_that_this_vehicle_cannot_have_is_refused_and_the_file_is_named(
    tmp_path: Path, effect: str, words: str
) -> None:
    path = model_file(tmp_path / "model.toml", [parse_effect(effect)])
    with (
        pytest.raises(UserError, match=words) as caught,
        emulation.vehicle("prototype", 1, False, NETWORK, simulator=read_simulator(path)),
    ):
        pass
    assert caught.value.what.startswith(str(path))
    assert "[[effects]]" in caught.value.remedy


def test_every_effect_of_a_model_has_its_injector_at_every_place() -> None:
    for kind in EFFECTS.values():
        assert set(kind.places) <= set(INJECTORS[kind.name].places)


def test_the_written_lengths_are_those_that_are_read(tmp_path: Path) -> None:
    geometry = load_vehicle("compact").geometry
    simulator = read_simulator(model_file(tmp_path / "model.toml", geometry=geometry))
    assert simulator.geometry == geometry
    assert np.all([simulator.model.parameters[name] > 0 for name in PARAMETER_NAMES])
