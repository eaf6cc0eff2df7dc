"""No bad state: whatever comes on the bus, under the sanitizers of the compiler."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fmu.bus.packaging import BusPlant, bus_sources, vehicle_plant
from fmu.bus.shaft_plant import shaft_plant
from fmu.bus.system import BusSystem
from fmu.source import ModelSource
from hil.lsbus.system import drive_on_bus, vehicle_on_bus
from hil.network import DEFAULT_NETWORK
from tests.hil.lsbus.twins import silent_prototype
from tests.sanitizing import Fuzz, sanitized

DRIVER = Path(__file__).parent / "drivers" / "fuzz_bus.c"
CHUNK = 250_000


def whole(source: ModelSource) -> tuple[BusPlant, BusSystem]:
    return vehicle_plant(source), vehicle_on_bus(silent_prototype(), DEFAULT_NETWORK)


def alone(_source: ModelSource) -> tuple[BusPlant, BusSystem]:
    return shaft_plant("drive_fl"), drive_on_bus(silent_prototype(), DEFAULT_NETWORK, "drive_fl")


@pytest.fixture(scope="module", params=[whole, alone])
def fuzz(
    request: pytest.FixtureRequest,
    source: ModelSource,
    need: Callable[[str], str],
    tmp_path_factory: pytest.TempPathFactory,
) -> Fuzz:
    """Gives frames from a seed on; compiled once a level."""
    plant, system = request.param(source)
    sources = bus_sources(plant, system, "token")
    return sanitized(need("gcc"), sources, DRIVER, tmp_path_factory.mktemp("fuzz_bus"))


def test_a_sample_of_random_frames_crashes_nothing(fuzz: Fuzz) -> None:
    assert "frames given" in fuzz(1, 5_000, "-O0")


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(4))
def test_a_million_random_frames(fuzz: Fuzz, chunk: int) -> None:
    assert "frames given" in fuzz(1_000 + chunk, CHUNK, "-O1")
