"""What an instance does with calls in and out of order, with values that cannot be, with derivatives and events."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
import pytest

from fmu.description import FmiVersion
from fmu.variables import Inputs

Build = Callable[[FmiVersion, Inputs], Path]

STEP = 2e-3
MODES = {
    "aligning": (0.3, -0.2),
    "straight": (0.0, 0.0),
    "lateral": (-math.pi / 2, math.pi / 2),
    "rotation": (-math.atan2(1.2, 0.8), math.atan2(1.2, 0.8)),
}
"""Steering angles of the prototype."""


class Vehicle:
    """An instance with the same functions in both versions, and what it said."""

    def __init__(self, path: Path, kind: str, **settings: Any) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.messages: list[str] = []
        self.instance = fmpy.simulation.instantiate_fmu(
            fmpy.extract(str(path)), self.description, kind, logger=self.hear, **settings
        )
        self.is_new = self.description.fmiVersion != "2.0"
        self.references = {row.name: row.valueReference for row in self.description.modelVariables}

    def hear(self, *arguments: Any) -> None:
        self.messages.append(arguments[-1].decode())

    def begin(self, stop: float | None = None, **start: float) -> Vehicle:
        if self.is_new:
            self.instance.enterInitializationMode(stopTime=stop)
        else:
            self.instance.setupExperiment(stopTime=stop)
            self.instance.enterInitializationMode()
        for name, value in start.items():
            self.write(name, value)
        self.instance.exitInitializationMode()
        return self

    def write(self, name: str, value: float) -> None:
        (self.instance.setFloat64 if self.is_new else self.instance.setReal)([self.references[name]], [value])

    def read(self, *names: str) -> list[float]:
        getter = self.instance.getFloat64 if self.is_new else self.instance.getReal
        return list(getter([self.references[name] for name in names]))

    def mode(self) -> int:
        getter = self.instance.getInt32 if self.is_new else self.instance.getInteger
        return int(getter([self.references["mode"]])[0])

    def refused(self, call: Callable[[], object]) -> str:
        """What is said while a call is refused."""
        count = len(self.messages)
        with pytest.raises(Exception, match=r"failed with status [23] "):
            call()
        assert len(self.messages) > count
        return self.messages[-1]

    def names(self, causality: str) -> list[str]:
        return [row.name for row in self.description.modelVariables if row.causality == causality]

    def states(self) -> list[str]:
        return [row.variable.derivative.name for row in self.description.derivatives]


@pytest.fixture
def opened() -> Iterator[Callable[..., Vehicle]]:
    vehicles: list[Vehicle] = []

    def open_one(path: Path, kind: str = "CoSimulation", **settings: Any) -> Vehicle:
        vehicles.append(Vehicle(path, kind, **settings))
        return vehicles[-1]

    yield open_one
    for vehicle in vehicles:
        vehicle.instance.freeInstance()


Open = Callable[..., Vehicle]


def test_values_that_are_not_finite_are_refused_by_name_and_change_nothing(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin()
    for name in ("torque_rl", "m_ch", "payload", "epsilon"):
        (before,) = vehicle.read(name)
        for value in (math.nan, math.inf, -math.inf):
            assert name in vehicle.refused(lambda name=name, value=value: vehicle.write(name, value))
        assert vehicle.read(name) == [before]


def test_parameters_that_cannot_be_are_refused_by_name(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin()
    for name, value in (("m_ch", 0.0), ("wheel_radius", -0.1), ("d_cw", -1.0), ("creep_stiffness", 0.0)):
        assert name in vehicle.refused(lambda name=name, value=value: vehicle.write(name, value))


def test_of_a_call_with_one_bad_value_none_is_taken(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin()
    names = ("torque_fl", "torque_rl")
    setter = vehicle.instance.setFloat64 if vehicle.is_new else vehicle.instance.setReal
    vehicle.refused(lambda: setter([vehicle.references[name] for name in names], [1.0, math.nan]))
    assert vehicle.read(*names) == [0.0, 0.0]


def test_what_is_computed_cannot_be_set(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin()
    for name in ("slip_lat_fl", "der(x_dot)", "pose_x", "time"):
        assert name in vehicle.refused(lambda name=name: vehicle.write(name, 1.0))


def test_calls_out_of_order_are_refused_and_say_when(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu)
    assert "before initialization" in vehicle.refused(lambda: vehicle.instance.doStep(0.0, STEP))
    vehicle.begin()
    assert "in step mode" in vehicle.refused(vehicle.instance.enterInitializationMode)
    vehicle.instance.doStep(0.0, STEP)
    vehicle.instance.terminate()
    assert "after termination" in vehicle.refused(lambda: vehicle.instance.doStep(STEP, STEP))
    assert len(vehicle.read("pose_x")) == 1
    vehicle.instance.reset()
    vehicle.begin()
    vehicle.instance.doStep(0.0, STEP)


def test_steps_that_cannot_be_are_refused(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin(stop=0.01)
    for size in (0.0, -1e-3, math.nan, math.inf):
        assert "communicationStepSize" in vehicle.refused(lambda size=size: vehicle.instance.doStep(0.0, size))
    assert "currentCommunicationPoint" in vehicle.refused(lambda: vehicle.instance.doStep(0.5, STEP))
    assert "stopTime" in vehicle.refused(lambda: vehicle.instance.doStep(0.0, 0.02))
    vehicle.instance.doStep(0.0, 0.01)


def test_a_description_of_another_fmu_is_refused(torque_fmu: Path) -> None:
    description = fmpy.read_model_description(str(torque_fmu))
    if description.fmiVersion == "2.0":
        description.guid = "another"
    else:
        description.guid = description.instantiationToken = "another"
    with pytest.raises(Exception, match="nstantiate"):
        fmpy.simulation.instantiate_fmu(
            fmpy.extract(str(torque_fmu)), description, "CoSimulation", logger=lambda *_: None
        )


def _serialized(vehicle: Vehicle) -> bytes:
    instance = vehicle.instance
    state = (instance.getFMUState if vehicle.is_new else instance.getFMUstate)()
    return bytes((instance.serializeFMUState if vehicle.is_new else instance.serializeFMUstate)(state))


def _restored(vehicle: Vehicle, content: bytes) -> None:
    instance = vehicle.instance
    state = (instance.deserializeFMUState if vehicle.is_new else instance.deSerializeFMUstate)(content)
    (instance.setFMUState if vehicle.is_new else instance.setFMUstate)(state)


def _with_checksum(content: bytes) -> bytes:
    """A saved state that somebody has changed and summed up again (FNV-1a)."""
    total = 14695981039346656037
    for byte in content[:-8]:
        total = (total ^ byte) * 1099511628211 % 2**64
    return content[:-8] + struct.pack("Q", total)


def test_a_bit_that_flips_anywhere_in_a_saved_state_is_noticed(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin(x_dot=0.1)
    vehicle.instance.doStep(0.0, STEP)
    content, before = _serialized(vehicle), vehicle.read("x_dot", "beta_fl")
    assert len(content) > 1000
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        said = vehicle.refused(lambda changed=changed: _restored(vehicle, bytes(changed)))
        assert ("another model" if place < 16 else "damaged") in said
    _restored(vehicle, content)
    assert vehicle.read("x_dot", "beta_fl") == before


def test_the_saved_state_of_another_fmu_or_of_another_size_is_refused(build: Build, opened: Open) -> None:
    vehicle, other = (opened(build(version, Inputs.TORQUE)).begin() for version in FmiVersion)
    content = _serialized(other)
    assert "another model" in vehicle.refused(lambda: _restored(vehicle, content))
    assert f"{len(content)} bytes, these are 100" in other.refused(lambda: _restored(other, content[:100]))


def test_saved_bytes_cannot_bring_in_results_that_are_not_finite(torque_fmu: Path, opened: Open) -> None:
    """Every number of a saved state that is an output is replaced by one that is not finite."""
    vehicle = opened(torque_fmu).begin(x_dot=0.1)
    vehicle.instance.doStep(0.0, STEP)
    (output,) = vehicle.read("slip_long_fl")
    content = _serialized(vehicle)
    assert struct.pack("d", output) in content
    _restored(vehicle, _with_checksum(content.replace(struct.pack("d", output), struct.pack("d", math.nan))))
    assert vehicle.read("slip_long_fl") == [output]


def test_saved_bytes_that_no_instance_can_have_written_are_refused(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin(x_dot=0.125)
    content = _serialized(vehicle)
    broken = _with_checksum(content.replace(struct.pack("d", 0.125), struct.pack("d", math.inf)))
    assert "can have had" in vehicle.refused(lambda: _restored(vehicle, broken))


def test_a_state_saved_in_co_simulation_is_refused_in_model_exchange(torque_fmu: Path, opened: Open) -> None:
    """There it would leave the instance in a mode that model exchange does not have."""
    saving, other = opened(torque_fmu).begin().instance, opened(torque_fmu, "ModelExchange")
    state = (saving.getFMUState if other.is_new else saving.getFMUstate)()
    restore = other.instance.setFMUState if other.is_new else other.instance.setFMUstate
    assert "co-simulation" in other.refused(lambda: restore(state))
    other.begin()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("inputs", list(Inputs))
def test_directional_derivatives_are_those_of_finite_differences(
    build: Build, opened: Open, mode: str, inputs: Inputs
) -> None:
    """In a random direction of states, inputs and parameters at once, at a moving vehicle."""
    vehicle, unknowns, knowns, values = moving(build(FmiVersion.FMI2, inputs), opened, MODES[mode])
    random = np.random.default_rng(4)
    direction = random.standard_normal(len(knowns)) * np.maximum(np.abs(values), 1e-3)
    exact = np.array(
        vehicle.instance.getDirectionalDerivative(
            [vehicle.references[name] for name in unknowns],
            [vehicle.references[name] for name in knowns],
            list(direction),
        )
    )
    found = richardson(lambda share: evaluate(vehicle, unknowns, knowns, values + share * direction))
    scale = np.maximum(np.abs(exact), 1e-3 * np.max(np.abs(exact)))
    assert np.max(np.abs(found - exact) / scale) < 1e-6


def moving(path: Path, opened: Open, angles: tuple[float, float]) -> tuple[Vehicle, list[str], list[str], Any]:
    """In event mode of model exchange, where states, inputs and parameters can all be set."""
    vehicle = opened(path, "ModelExchange")
    speeds = {"x_dot": 0.02, "y_dot": -0.01, "gamma_dot": 0.03, "alpha_l_dot": 0.05, "beta_fl_dot": 0.4}
    vehicle.instance.setupExperiment()
    vehicle.instance.enterInitializationMode()
    for name, value in {"alpha_l": angles[0], "alpha_r": angles[1], "payload": 10.0, **speeds}.items():
        vehicle.write(name, value)
    states, inputs = vehicle.states(), vehicle.names("input")
    parameters = ["C_l", "d_vl", "m_ch", "C_ch", "d_vw", "B_w", "wheelbase", "wheel_radius"]
    knowns = [*states, *inputs, *parameters]
    unknowns = [*(f"der({name})" for name in states), "slip_long_fl", "slip_lat_rr", "Q_x", "Q_gamma"]
    return vehicle, unknowns, knowns, np.array(vehicle.read(*knowns))


def evaluate(vehicle: Vehicle, unknowns: list[str], knowns: list[str], values: Any) -> Any:
    vehicle.instance.setReal([vehicle.references[name] for name in knowns], list(values))
    return np.array(vehicle.read(*unknowns))


def richardson(function: Callable[[float], Any], step: float = 1e-5) -> Any:
    """Central differences of order four; the contact is stiff, so the step is small."""
    coarse, fine = ((function(h) - function(-h)) / (2 * h) for h in (step, step / 2))
    return (4 * fine - coarse) / 3


def test_adjoint_derivatives_are_the_transposed_directional_ones(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI3, Inputs.TORQUE), "ModelExchange")
    vehicle.instance.enterInitializationMode()
    vehicle.write("x_dot", 0.1)
    knowns = [vehicle.references[name] for name in (*vehicle.states(), *vehicle.names("input"), "m_ch", "d_cw")]
    unknowns = [vehicle.references[f"der({name})"] for name in vehicle.states()] + [vehicle.references["slip_lat_fl"]]
    random = np.random.default_rng(1)
    direction, weights = random.standard_normal(len(knowns)), random.standard_normal(len(unknowns))
    forward = np.array(vehicle.instance.getDirectionalDerivative(unknowns, knowns, direction))
    backward = np.array(vehicle.instance.getAdjointDerivative(unknowns, knowns, weights, len(knowns)))
    assert weights @ forward == pytest.approx(direction @ backward, rel=1e-9)


def test_output_derivatives_are_rates_of_change(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu).begin()
    for wheel in ("fl", "rl", "fr", "rr"):
        vehicle.write(f"torque_{wheel}", 1.0)
    for cycle in range(200):
        vehicle.instance.doStep(cycle * STEP, STEP)
    names = ("pose_x", "x_dot", "beta_fl")
    if vehicle.is_new:
        rates = vehicle.instance.getOutputDerivatives([vehicle.references[name] for name in names], [1, 1, 1])
    else:
        references = (ctypes.c_uint * 3)(*(vehicle.references[name] for name in names))
        values = (ctypes.c_double * 3)()
        vehicle.instance.fmi2GetRealOutputDerivatives(
            vehicle.instance.component, references, 3, (ctypes.c_int * 3)(1, 1, 1), values
        )
        rates = list(values)
    before = vehicle.read(*names)
    vehicle.instance.doStep(200 * STEP, 1e-4)
    after = vehicle.read(*names)
    assert rates == pytest.approx((np.array(after) - before) / 1e-4, rel=1e-2)


def test_tunable_parameters_act_from_the_next_step_on(torque_fmu: Path, opened: Open) -> None:
    def speed_after(mass: float) -> float:
        vehicle = opened(torque_fmu).begin()
        vehicle.write("m_ch", mass)
        for wheel in ("fl", "rl", "fr", "rr"):
            vehicle.write(f"torque_{wheel}", 1.5)
        for cycle in range(500):
            vehicle.instance.doStep(cycle * STEP, STEP)
        return vehicle.read("x_dot")[0]

    light, heavy = speed_after(400.0), speed_after(1600.0)
    assert light > 1.5 * heavy > 0


def test_the_mode_follows_the_steering_angles(torque_fmu: Path, opened: Open) -> None:
    expected = {"aligning": 1, "straight": 2, "lateral": 3, "rotation": 4}
    for name, (left, right) in MODES.items():
        vehicle = opened(torque_fmu).begin(alpha_l=left, alpha_r=right)
        assert vehicle.mode() == expected[name]
        vehicle.instance.doStep(0.0, STEP)
        assert vehicle.mode() == expected[name]


def test_the_mode_can_be_read_while_initializing_whenever_the_angles_were_set(torque_fmu: Path, opened: Open) -> None:
    vehicle = opened(torque_fmu)
    vehicle.write("alpha_l", MODES["lateral"][0])
    vehicle.write("alpha_r", MODES["lateral"][1])
    assert vehicle.mode() == 3
    if not vehicle.is_new:
        vehicle.instance.setupExperiment()
    vehicle.instance.enterInitializationMode()
    assert vehicle.mode() == 3


def turn_left_side(vehicle: Vehicle) -> None:
    vehicle.write("torque_fl", -1.2)
    vehicle.write("torque_rl", 1.2)


@pytest.mark.parametrize("logging", [True, False])
def test_a_change_of_the_mode_is_told_where_logging_is_on(torque_fmu: Path, opened: Open, logging: bool) -> None:
    vehicle = opened(torque_fmu, debug_logging=logging).begin()
    turn_left_side(vehicle)
    vehicle.instance.doStep(0.0, 0.5)
    assert vehicle.mode() == 1
    assert vehicle.messages == (["The motion mode is 1 from 0.5 s on."] if logging else [])


def test_a_step_ends_at_the_event_where_early_return_is_allowed(build: Build, opened: Open) -> None:
    """Straight wheels that turn leave mode 2 when the angle passes the tolerance; found to a microsecond."""
    path = build(FmiVersion.FMI3, Inputs.TORQUE)
    vehicle = opened(path, event_mode_used=True, early_return_allowed=True)
    vehicle.instance.enterInitializationMode()
    vehicle.instance.exitInitializationMode()
    vehicle.instance.updateDiscreteStates()
    vehicle.instance.enterStepMode()
    turn_left_side(vehicle)
    assert vehicle.mode() == 2
    event, _, early, time = vehicle.instance.doStep(0.0, 1.0)
    assert event
    assert early
    assert 0 < time < 1.0
    assert vehicle.mode() == 2
    (indicator,) = vehicle.read("mode_indicator[3]")
    (rate,) = vehicle.read("alpha_l_dot")
    assert abs(indicator) < 2e-6 * abs(rate)
    vehicle.instance.enterEventMode()
    vehicle.instance.updateDiscreteStates()
    assert vehicle.mode() == 1
    vehicle.instance.enterStepMode()
    vehicle.instance.doStep(time, STEP)


def test_a_step_goes_on_past_an_event_where_early_return_is_not_allowed(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI3, Inputs.TORQUE), event_mode_used=True)
    vehicle.instance.enterInitializationMode()
    vehicle.instance.exitInitializationMode()
    vehicle.instance.enterStepMode()
    turn_left_side(vehicle)
    event, _, early, time = vehicle.instance.doStep(0.0, 0.5)
    assert (event, early, time) == (True, False, 0.5)


def test_intermediate_updates_offer_every_internal_step_and_may_end_the_step(build: Build, opened: Open) -> None:
    seen: list[float] = []

    def update(_: Any, time: float, *flags: Any) -> None:
        seen.append(time)
        flags[4][0] = len(seen) == 3

    vehicle = opened(
        build(FmiVersion.FMI3, Inputs.TORQUE), early_return_allowed=True, intermediate_update=update
    ).begin()
    turn_left_side(vehicle)
    _, _, early, time = vehicle.instance.doStep(0.0, 1.0)
    assert early
    assert len(seen) == 3
    assert time == seen[-1]
    assert seen == sorted(seen)


def test_model_exchange_events_change_the_mode(torque_fmu: Path) -> None:
    """FMPy finds the event by the indicators and lets the mode change there."""
    time = np.array([0.0, 1.0])
    signals = np.zeros(2, dtype=[("time", float), ("torque_fl", float), ("torque_rl", float)])
    signals["time"], signals["torque_fl"], signals["torque_rl"] = time, -1.2, 1.2
    result = fmpy.simulate_fmu(
        str(torque_fmu),
        fmi_type="ModelExchange",
        input=signals,
        stop_time=1.0,
        output_interval=0.01,
        output=["alpha_l", "mode"],
        relative_tolerance=1e-7,
    )
    assert result["mode"][0] == 2
    assert result["mode"][-1] == 1
    changed = int(np.argmax(result["mode"] == 1))
    assert abs(result["alpha_l"][changed]) == pytest.approx(0.02, rel=0.5)
