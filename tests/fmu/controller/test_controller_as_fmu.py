"""The controller in C is the controller of a campaign: same torques for the same measurements, at its own instants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import fmpy.validation
import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.compiling import find_compiler
from fmu.controller.packaging import build_controller
from fmu.controller.table import ControllerSource
from fmu.platforms import host_platform
from ident.campaign.controller import Controller, FollowingError
from ident.campaign.optimise import Excitation
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

CYCLE = 2e-3
MEASURED = (*(f"beta_{wheel}" for wheel in WHEELS), *STEERING_LOOPS)
TORQUES = tuple(f"torque_{wheel}" for wheel in WHEELS)


@pytest.fixture(scope="module")
def plan() -> Plan:
    excitations: dict[str, Excitation] = {}
    return assemble_plan(load_vehicle(), excitations, steps=(Step.LANE_CHANGE,), periods=4, cycle=CYCLE)


@pytest.fixture(scope="module")
def reference(plan: Plan) -> Reference:
    return plan.reference(Step.LANE_CHANGE, plan.vehicle.prior)


@pytest.fixture(scope="module")
def controller_fmu(plan: Plan, reference: Reference, tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = ControllerSource(plan.vehicle, reference, Mode.STEERED, plan.designs, plan.limits, {"run": "monday"})
    path = tmp_path_factory.mktemp("controllers") / "controller.fmu"
    path.write_bytes(build_controller(source, (host_platform(),), find_compiler()))
    return path


class Instance:
    """One of the FMU, and what it said."""

    def __init__(self, path: Path) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.messages: list[str] = []
        self.fmu: Any = fmpy.simulation.instantiate_fmu(
            fmpy.extract(str(path)), self.description, "CoSimulation", logger=lambda *said: self.hear(said[-1])
        )
        self.references = {row.name: row.valueReference for row in self.description.modelVariables}
        self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.time = 0.0

    def hear(self, said: bytes) -> None:
        self.messages.append(said.decode())

    def write(self, names: tuple[str, ...], values: Array) -> None:
        self.fmu.setReal([self.references[name] for name in names], values.tolist())

    def read(self, names: tuple[str, ...]) -> Array:
        return np.array(self.fmu.getReal([self.references[name] for name in names]))

    def step(self, measured: Array, size: float = CYCLE) -> Array:
        self.write(MEASURED, measured)
        self.fmu.doStep(self.time, size)
        self.time += size
        return self.read(TORQUES)


@pytest.fixture
def opened(controller_fmu: Path) -> Iterator[Callable[[], Instance]]:
    instances: list[Instance] = []

    def open_one() -> Instance:
        instances.append(Instance(controller_fmu))
        return instances[-1]

    yield open_one
    for instance in instances:
        instance.fmu.freeInstance()


def in_python(plan: Plan, reference: Reference) -> Controller:
    return Controller(
        reference,
        plan.designs,
        plan.limits,
        gear_ratio=plan.vehicle.geometry.gear_ratio,
        peak_torque=plan.vehicle.limits.peak_torque,
    )


def measurements(reference: Reference, noise: float) -> Array:
    """Angles (N, 6) of a vehicle that follows its reference, give or take some noise [rad], from anywhere."""
    rates = np.zeros((len(reference), 4))
    for track in reference.tracks.values():
        rates += track.wheels * track.velocity[:, None]
    wheels = np.cumsum(rates, axis=0) * CYCLE + np.array([0.3, -0.2, 0.1, 7.0])
    steering = np.stack([reference.tracks[loop].position for loop in STEERING_LOOPS], axis=1)
    drift = np.random.default_rng(5).normal(0.0, noise, (len(reference), 6))
    return np.hstack([wheels, steering]) + drift


def test_the_description_is_valid(controller_fmu: Path) -> None:
    assert fmpy.validation.validate_fmu(str(controller_fmu)) == []


@pytest.mark.parametrize("noise", [0.0, 1e-4, 3e-3])
def test_it_asks_for_the_torques_of_the_campaign(
    plan: Plan, reference: Reference, opened: Callable[[], Instance], noise: float
) -> None:
    """All of the lane change: at rest, where integrators leak or hurry; in motion; and at the limit of the motors."""
    controller, instance = in_python(plan, reference), opened()
    found, expected = [], []
    for index, measured in enumerate(measurements(reference, noise)):
        expected.append(controller.torques(index, measured[:4].tolist(), measured[4:].tolist()))
        found.append(instance.step(measured))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    assert np.abs(expected).max() > 0.1
    assert (np.abs(expected).max() == plan.vehicle.limits.peak_torque) == (noise == 3e-3)


def test_shorter_communication_steps_change_nothing(reference: Reference, opened: Callable[[], Instance]) -> None:
    """Between two samples nothing is measured, whatever the inputs do."""
    whole, parted = opened(), opened()
    for measured in measurements(reference, 1e-4)[:600]:
        expected = whole.step(measured)
        np.testing.assert_array_equal(parted.step(measured, CYCLE / 4), expected)
        for part in (CYCLE / 2, CYCLE / 4):
            np.testing.assert_array_equal(parted.step(measured + 0.01, part), expected)


def test_a_coordinate_far_from_its_reference_stops_both(
    plan: Plan, reference: Reference, opened: Callable[[], Instance]
) -> None:
    controller, instance = in_python(plan, reference), opened()
    measured = measurements(reference, 0.0)
    measured[200:, 5] += 0.5
    for index in range(200):
        controller.torques(index, measured[index, :4].tolist(), measured[index, 4:].tolist())
        instance.step(measured[index])
    before = instance.read(TORQUES)
    with pytest.raises(FollowingError, match="alpha_r"):
        controller.torques(200, measured[200, :4].tolist(), measured[200, 4:].tolist())
    with pytest.raises(Exception, match="failed with status 3"):
        instance.step(measured[200])
    assert "alpha_r is further from its reference" in instance.messages[-1]
    np.testing.assert_array_equal(instance.read(TORQUES), before)


def test_communication_steps_longer_than_its_sample_time_are_refused(opened: Callable[[], Instance]) -> None:
    instance = opened()
    with pytest.raises(Exception, match="failed with status 3"):
        instance.step(np.zeros(6), 2 * CYCLE)
    assert "longer than the sample time" in instance.messages[-1]
    instance.step(np.zeros(6))


def test_it_is_no_model_to_exchange(controller_fmu: Path) -> None:
    """Its description says so, and an importer that asks nevertheless gets none."""
    description = fmpy.read_model_description(str(controller_fmu))
    assert description.modelExchange is None
    description.modelExchange = description.coSimulation
    said: list[str] = []
    with pytest.raises(Exception, match="nstantiate"):
        fmpy.simulation.instantiate_fmu(
            fmpy.extract(str(controller_fmu)), description, "ModelExchange", logger=lambda *what: said.append(what[-1])
        )


def test_a_saved_state_goes_on_as_if_nothing_had_been(reference: Reference, opened: Callable[[], Instance]) -> None:
    first, second = opened(), opened()
    measured = measurements(reference, 1e-4)
    for row in measured[:1500]:
        first.step(row)
    content = first.fmu.serializeFMUstate(first.fmu.getFMUstate())
    second.fmu.setFMUstate(second.fmu.deSerializeFMUstate(content))
    second.time = first.time
    for row in measured[1500:1600]:
        np.testing.assert_array_equal(second.step(row), first.step(row))
