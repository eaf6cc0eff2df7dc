from __future__ import annotations

from pathlib import Path

import pytest

from fmu.bus.packaging import build_bus_fmu, vehicle_plant
from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from hil.lsbus.system import vehicle_on_bus
from hil.network import DEFAULT_NETWORK
from ident.vehicle.description import load_vehicle
from tests.hil.lsbus.twins import silent_prototype


@pytest.fixture(scope="session")
def source() -> ModelSource:
    vehicle = load_vehicle()
    return ModelSource(vehicle, vehicle.prior, (), {}, {})


@pytest.fixture(scope="session")
def bus_fmu(source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The vehicle with its devices, without noise."""
    path = tmp_path_factory.mktemp("bus") / "bus.fmu"
    system = vehicle_on_bus(silent_prototype(), DEFAULT_NETWORK)
    path.write_bytes(build_bus_fmu(vehicle_plant(source), system, {}, (host_platform(),), find_compiler()))
    return path


@pytest.fixture(scope="session")
def platform(source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same vehicle alone."""
    path = tmp_path_factory.mktemp("platform") / "platform.fmu"
    path.write_bytes(build_fmu(source, Order(FmiVersion.FMI3, Inputs.TORQUE, (host_platform(),)), find_compiler()))
    return path
