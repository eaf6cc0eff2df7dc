from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.effects import make_effect
from ident.vehicle.description import load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Build = Callable[[FmiVersion, Inputs], Path]

VARIANTS = [(version, inputs) for version in FmiVersion for inputs in Inputs]


@pytest.fixture(scope="session")
def source() -> ModelSource:
    """The prototype with its prior parameters, and an effect of each kind: without states of its own, and with them."""
    vehicle = load_vehicle()
    parameters = Parameters(vehicle.prior.values, np.full(len(PARAMETER_NAMES), 0.01))
    effects = (
        make_effect("stribeck", "steering_left", {"amplitude": 2.0}, {"amplitude": 0.1}),
        make_effect("backlash", "drive_fl", {"gap": 0.001}),
    )
    return ModelSource(vehicle, parameters, effects, {"run": "monday"}, {"parameters.toml": b"# as identified\n"})


@pytest.fixture(scope="session")
def build(source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Builds an FMU for this computer, once for each variant."""
    folder, made = tmp_path_factory.mktemp("fmus"), {}

    def build_once(version: FmiVersion, inputs: Inputs) -> Path:
        if (version, inputs) not in made:
            path = folder / f"{inputs}{version}.fmu"
            path.write_bytes(build_fmu(source, Order(version, inputs, (host_platform(),)), find_compiler()))
            made[version, inputs] = path
        return made[version, inputs]

    return build_once


@pytest.fixture(params=VARIANTS, ids=lambda variant: f"fmi{variant[0]}-{variant[1]}")
def variant(request: pytest.FixtureRequest, build: Build) -> Path:
    """Every FMU that can be built: both versions, both kinds of inputs."""
    return build(*request.param)


@pytest.fixture(params=list(FmiVersion), ids=lambda version: f"fmi{version}")
def torque_fmu(request: pytest.FixtureRequest, build: Build) -> Path:
    """With torque inputs, both versions."""
    return build(request.param, Inputs.TORQUE)
