"""No bad state: whatever comes on the bus, under the sanitizers of the compiler."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fmu.bus.packaging import BusPlant, bus_sources, vehicle_plant
from fmu.bus.shaft_plant import shaft_plant
from fmu.bus.system import BusSystem
from fmu.compiling import HEADERS
from fmu.source import ModelSource
from hil.lsbus.system import drive_on_bus, vehicle_on_bus
from hil.network import DEFAULT_NETWORK
from tests.hil.lsbus.twins import silent_prototype

DRIVER = Path(__file__).parent / "drivers" / "fuzz_bus.c"
CHUNK = 250_000

Fuzz = Callable[[int, int, str], str]


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
    compiler, folder = need("gcc"), tmp_path_factory.mktemp("fuzz_bus")
    plant, system = request.param(source)
    for name, text in bus_sources(plant, system, "token").items():
        (folder / name).write_bytes(text)
    units = sorted(path.name for path in folder.glob("*.c"))
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    warnings = ["-Wall", "-Wextra", "-Werror"]

    def run(seed: int, count: int, level: str) -> str:
        program = folder / f"fuzz{level}"
        if not program.exists():
            flags = ["-g", level, "-std=gnu11", *sanitizers, *warnings, "-I", str(HEADERS), "-I", "."]
            subprocess.run([compiler, *flags, "-o", program, *units, str(DRIVER), "-lm"], cwd=folder, check=True)
        done = subprocess.run([program, str(seed), str(count)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_a_sample_of_random_frames_crashes_nothing(fuzz: Fuzz) -> None:
    assert "frames given" in fuzz(1, 5_000, "-O0")


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(4))
def test_a_million_random_frames(fuzz: Fuzz, chunk: int) -> None:
    assert "frames given" in fuzz(1_000 + chunk, CHUNK, "-O1")
