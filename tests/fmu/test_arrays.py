"""Arrays of the four wheels in FMI 3.0: other names for the scalars, in every call that takes variables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import fmpy.validation
import numpy as np
import pytest

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.errors import UserError
from ident.vehicle.geometry import WHEELS

STEP = 2e-3
ARRAYS = ("beta", "beta_dot", "drive_torque", "slip_long", "slip_lat")


@pytest.fixture(scope="module", params=list(Inputs))
def fmu(request: pytest.FixtureRequest, source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arrays") / f"{request.param}.fmu"
    order = Order(FmiVersion.FMI3, request.param, (host_platform(),), arrays=True)
    path.write_bytes(build_fmu(source, order, find_compiler()))
    return path


class Opened:
    """An instance in step mode, and what it said."""

    def __init__(self, path: Path) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.messages: list[str] = []
        self.instance: Any = fmpy.simulation.instantiate_fmu(
            fmpy.extract(str(path)), self.description, "CoSimulation", logger=lambda *said: self.hear(said[-1])
        )
        self.references = {row.name: row.valueReference for row in self.description.modelVariables}
        self.instance.enterInitializationMode()
        self.instance.exitInitializationMode()

    def hear(self, said: bytes) -> None:
        self.messages.append(said.decode())

    def read(self, *names: str, count: int = 0) -> list[float]:
        references = [self.references[name] for name in names]
        return list(self.instance.getFloat64(references, count or len(names)))

    def write(self, values: list[float], *names: str) -> None:
        self.instance.setFloat64([self.references[name] for name in names], values)


@pytest.fixture
def opened(fmu: Path) -> Iterator[Opened]:
    made = Opened(fmu)
    yield made
    made.instance.freeInstance()


@pytest.fixture
def command(opened: Opened) -> str:
    return "torque" if "torque" in opened.references else "speed"


def of(name: str) -> list[str]:
    """Its scalars: `beta_dot` has `beta_fl_dot` and so on."""
    head, _, tail = name.partition("_dot")
    return [f"{head}_{wheel}{'_dot' if name.endswith('_dot') else ''}{tail}" for wheel in WHEELS]


def test_the_description_is_valid_and_has_an_array_for_all_that_each_wheel_has(fmu: Path) -> None:
    assert fmpy.validation.validate_fmu(str(fmu)) == []
    description = fmpy.read_model_description(str(fmu))
    found = {row.name: row for row in description.modelVariables if row.dimensions}
    assert set(ARRAYS) < found.keys()
    assert found.keys() - set(ARRAYS) in ({"torque"}, {"speed"})
    assert all(row.dimensions[0].start == "4" or int(row.dimensions[0].start) == 4 for row in found.values())
    scalars = {row.name: row for row in description.modelVariables if not row.dimensions}
    for name, row in found.items():
        assert all(scalars[one].causality == row.causality and scalars[one].unit == row.unit for one in of(name))


def test_an_array_sets_its_scalars_and_reads_what_they_have(opened: Opened, command: str) -> None:
    opened.write([0.1, -0.2, 0.3, -0.4], command)
    assert opened.read(*of(command)) == [0.1, -0.2, 0.3, -0.4]
    opened.write([0.5], of(command)[2])
    assert opened.read(command, count=4) == [0.1, -0.2, 0.5, -0.4]
    for _ in range(100):
        opened.instance.doStep(opened.read("time")[0], STEP)
    for name in ARRAYS:
        assert opened.read(name, count=4) == opened.read(*of(name))
    assert len(set(opened.read("beta", count=4))) == 4


def test_arrays_and_scalars_mix_in_one_call(opened: Opened, command: str) -> None:
    opened.write([700.0, 0.1, 0.2, 0.3, 0.4, 0.01], "payload", command, "slope_x")
    expected = [700.0, 0.1, 0.2, 0.3, 0.4, 0.01]
    assert opened.read("payload", command, "slope_x", count=6) == expected


def test_what_fits_no_array_or_cannot_be_is_refused_whole(opened: Opened, command: str) -> None:
    opened.write([0.1, 0.2, 0.3, 0.4], command)
    refused = (
        ([0.5, 0.5, 0.5], (command,), "4 variables have 4 values, not 3"),
        ([0.5, 0.5, np.nan, 0.5], (command,), of(command)[2]),
        ([1.0, 1.0, 1.0, 1.0], ("beta",), "beta cannot be set: it is an output"),
    )
    for values, names, said in refused:
        with pytest.raises(Exception, match="failed with status 3"):
            opened.write(values, *names)
        assert said in opened.messages[-1]
        assert opened.read(command, count=4) == [0.1, 0.2, 0.3, 0.4]


def test_derivatives_of_arrays_are_those_of_their_scalars(opened: Opened, command: str) -> None:
    """Four torques are one direction; four rates are one answer; what comes back to the torques is transposed."""
    references, instance = opened.references, opened.instance
    rates = [references[f"der({name})"] for name in of("beta_dot")]
    scalars = [references[name] for name in of(command)]
    seed = [1.0, -2.0, 0.5, 3.0]
    expected = instance.getDirectionalDerivative(rates, scalars, seed)
    assert max(abs(value) for value in expected) > 0.1
    found = _directional(instance, rates, [references[command]], seed, 4)
    assert found == list(expected)
    torques = _directional(instance, [references["drive_torque"]], [references[command]], seed, 4)
    assert torques == _directional(instance, [references[name] for name in of("drive_torque")], scalars, seed, 4)


def _directional(instance: Any, unknowns: list[int], knowns: list[int], seed: list[float], count: int) -> list[float]:
    """FMPy takes the number of unknowns for that of their values, so its function is called below that."""
    from ctypes import c_double, c_size_t, c_uint32

    result = (c_double * count)()
    instance.fmi3GetDirectionalDerivative(
        instance.component,
        (c_uint32 * len(unknowns))(*unknowns),
        c_size_t(len(unknowns)),
        (c_uint32 * len(knowns))(*knowns),
        c_size_t(len(knowns)),
        (c_double * len(seed))(*seed),
        c_size_t(len(seed)),
        result,
        c_size_t(count),
    )
    return list(result)


def test_fmpy_drives_it_by_arrays_as_by_scalars(fmu: Path, command: str) -> None:
    names = of(command)
    size = 0.5 if command == "torque" else 2.0
    whole = np.zeros(2, dtype=[("time", float), (command, float, (4,))])
    parted = np.zeros(2, dtype=[("time", float), *((name, float) for name in names)])
    for signals in (whole, parted):
        signals["time"] = (0.0, 1.0)
    whole[command] = size * np.array([1.0, 2.0, 1.5, 0.5])
    for name, share in zip(names, (1.0, 2.0, 1.5, 0.5), strict=True):
        parted[name] = size * share
    common: dict[str, Any] = {"fmi_type": "CoSimulation", "stop_time": 1.0, "output_interval": STEP}
    outputs = ["pose_x", "gamma", "beta"]
    one = fmpy.simulate_fmu(str(fmu), input=whole, output=outputs, **common)
    other = fmpy.simulate_fmu(str(fmu), input=parted, output=outputs, **common)
    assert one["beta"].shape[1] == 4
    assert one.tobytes() == other.tobytes()
    assert abs(one["pose_x"][-1]) > 0.01


def test_fmi_2_has_no_arrays() -> None:
    with pytest.raises(UserError, match=r"FMI 2\.0 has no arrays"):
        Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),), arrays=True)
