"""Effects that the diagnosis has confirmed are part of the FMU, and no parameter of an FMU is without effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import fmpy.simulation
import numpy as np
import pytest

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.effects import EFFECTS, Effect, make_effect

STATE_ONLY = {"mode_tolerance"}
"""Parameters that act on the mode alone."""

SIZES = {"slip": 0.4}
"""Where a hundredth in SI units is no size that such an effect has."""


def every_effect() -> tuple[Effect, ...]:
    """One of each name at each place, of a small size."""
    return tuple(
        make_effect(name, where, {spec.size.name: SIZES.get(name, 0.01)})
        for name, spec in EFFECTS.items()
        for where in spec.places
    )


@pytest.fixture(scope="module")
def burdened(source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU of a vehicle with every effect there is."""
    order = Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),))
    path = tmp_path_factory.mktemp("burdened") / "all.fmu"
    path.write_bytes(build_fmu(replace(source, effects=every_effect()), order, find_compiler()))
    return path


@pytest.fixture
def vehicle(burdened: Path) -> Any:
    """In initialization mode, all of it in motion, on a slope with a load."""
    description = fmpy.read_model_description(str(burdened))
    instance = fmpy.simulation.instantiate_fmu(fmpy.extract(str(burdened)), description, "ModelExchange")
    instance.setupExperiment()
    instance.enterInitializationMode()
    instance.rows = description.modelVariables
    instance.references = {row.name: row.valueReference for row in description.modelVariables}
    random = np.random.default_rng(3)
    for row in description.modelVariables:
        if row.causality == "input" or (row.causality in ("output", "local") and row.start is not None):
            instance.setReal([row.valueReference], [float(random.uniform(0.05, 0.4))])
    return instance


def test_every_effect_is_there_with_its_numbers(vehicle: Any) -> None:
    for effect in every_effect():
        if effect.name != "slip":
            for name in effect.parameters:
                reference = vehicle.references[f"{effect.name}.{effect.where}.{name}"]
                assert vehicle.getReal([reference]) == [effect[name]]


def test_slip_is_the_friction_limit_of_its_wheels(vehicle: Any) -> None:
    limits = [vehicle.references[f"friction_limit_{wheel}"] for wheel in ("fl", "rl", "fr", "rr")]
    assert vehicle.getReal(limits) == [SIZES["slip"]] * 4


def test_every_parameter_acts_on_something(vehicle: Any) -> None:
    """The derivative of all derivatives and outputs with respect to it is not zero everywhere."""
    unknowns = [
        row.valueReference
        for row in vehicle.rows
        if row.name.startswith("der(") or (row.causality == "output" and row.start is None and row.name != "mode")
    ]
    idle = [
        row.name
        for row in vehicle.rows
        if row.causality == "parameter"
        and not np.any(vehicle.getDirectionalDerivative(unknowns, [row.valueReference], [1.0]))
    ]
    assert set(idle) == STATE_ONLY


def test_a_vehicle_with_every_effect_drives(burdened: Path) -> None:
    signals = np.array(
        [(0.0, 1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0, 1.0)],
        dtype=[("time", float), *((f"torque_{wheel}", float) for wheel in ("fl", "rl", "fr", "rr"))],
    )
    result = fmpy.simulate_fmu(
        str(burdened), fmi_type="CoSimulation", input=signals, stop_time=1.0, output_interval=2e-3
    )
    assert result["pose_x"][-1] > 0.01
    assert all(np.all(np.isfinite(result[name])) for name in result.dtype.names)
