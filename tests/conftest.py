from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.bench import emulation
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.runner import CampaignRunner
from hil.describing import check_measures
from hil.frames.recorder import LogFormat, Recorder
from hil.network import load_network, network_file_of
from ident.campaign.plan import make_plan
from ident.campaign.steps import PERIODS
from ident.errors import DataFileError
from ident.estimate.result import KnownInertia
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.geometry import check_geometry

Drive = Callable[..., Run]

MEASURE_RANGES = {
    "wheelbase": (0.7, 2.4),
    "track_width": (0.5, 1.8),
    "wheel_offset": (0.05, 0.25),
    "wheel_radius": (0.06, 0.25),
    "gear_ratio": (8.0, 50.0),
    "mass": (200.0, 3000.0),
    "rated_torque": (0.4, 6.0),
}
"""Where numbers are drawn; most draws make no vehicle, and `init` says so."""

LONGEST = (
    "hil/campaign/test_campaign_on_the_emulator.py",
    "cli/test_campaigns_in_processes.py",
    "ident/diagnosis/test_axis_diagnosis.py",
    "cli/test_describing_a_vehicle.py",
    "recipes/test_recipes.py",
    "hil/campaign/test_repeatability.py",
    "cli/test_printed_examples.py",
    "ident/diagnosis/vehicle/test_unseen.py",
    "ident/diagnosis/vehicle/test_sizes_found.py",
    "ident/diagnosis/vehicle/test_closing.py",
    "hil/pytest_plugin/test_example_suite.py",
    "cli/test_user_errors.py",
    "fmu/model/test_solver.py",
    "emulator/engine/test_engine_precision.py",
    "cli/test_diagnose_command.py",
    "hil/campaign/test_operator.py",
)
"""Files that take longest, longest first: a worker that began one of them last would be waited for."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    places = {Path(__file__).parent / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path, len(places)))


@pytest.fixture(scope="session")
def need() -> Callable[..., str]:
    """Path of a system program, of a Debian package; without it the test skips, but not in CI."""

    def find(program: str, package: str = "") -> str:
        path = shutil.which(program)
        if path is None:
            message = f"{program} is not installed" + (f" (Debian: {package})" if package else "")
            if os.environ.get("QUASIOMNI_CI"):
                pytest.fail(message)
            pytest.skip(message)
        return path

    return find


@pytest.fixture(scope="session")
def draw_measures() -> Callable[[int], dict[str, float]]:
    return _drawn


def _drawn(seed: int) -> dict[str, float]:
    """Measures of a vehicle that `init` takes."""
    generator = np.random.default_rng(seed)
    while True:
        given = {
            name: float(f"{np.exp(generator.uniform(*np.log(limits))):.3g}") for name, limits in MEASURE_RANGES.items()
        }
        try:
            check_geometry(check_measures(given).geometry, Path("drawn"))
            return given
        except DataFileError:
            continue


@pytest.fixture(scope="session")
def plan_run() -> Drive:
    """Plans a campaign on the emulator into a folder; `drive` drives it too."""

    def plan_into(
        folder: Path,
        steps: Sequence[Step],
        *,
        vehicle: str = "prototype",
        seed: int = 1,
        known_inertia: KnownInertia | None = None,
        periods: int = PERIODS,
    ) -> Run:
        network = load_network(network_file_of(vehicle))
        plan = make_plan(
            load_vehicle(vehicle), np.random.default_rng(seed), steps=steps, periods=PERIODS, cycle=network.cycle_period
        )
        # Fewer than a campaign may ask for will do where nothing is estimated.
        plan = replace(plan, periods=periods)
        run = Run(RunFolder(folder), plan, network, seed, "emulator, in lockstep", vehicle, known_inertia)
        create_run(run, find_data_file("ident.vehicle", vehicle))
        return run

    return plan_into


@pytest.fixture(scope="session")
def drive(plan_run: Drive) -> Drive:
    """Drives a campaign on the emulator, over CAN, into a folder."""

    def drive_into(
        folder: Path, steps: Sequence[Step], *, log_format: LogFormat = LogFormat.BLF, **options: Any
    ) -> Run:
        run = plan_run(folder, steps, **options)
        with emulation.bench(run.prototype, run.seed, False, run.network.path) as bench:
            recorder = Recorder(run.folder.frames, log_format)
            runner = CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None)
            runner.drive()
            recorder.close()
        return run

    return drive_into


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 KiB; who may not mount one has none."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(
        [*["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs"], str(place)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("mounting needs root")
    yield place
    subprocess.run(["umount", "--lazy", str(place)], check=True)
