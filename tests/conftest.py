from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from hil import emulation
from hil.campaign.folder import Run, RunFolder, create_run, network_file_of
from hil.campaign.runner import CampaignRunner
from hil.network import load_network
from hil.recorder import LogFormat, Recorder
from ident.campaign.plan import make_plan
from ident.estimate.identify import KnownInertia
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle

Drive = Callable[..., Run]


@pytest.fixture(scope="session")
def drive() -> Drive:
    """Drives a campaign on the emulator, over CAN, into a folder."""

    def drive_into(
        folder: Path,
        steps: Sequence[Step],
        *,
        vehicle: str = "prototype",
        seed: int = 1,
        known_inertia: KnownInertia | None = None,
        log_format: LogFormat = LogFormat.BLF,
    ) -> Run:
        network_file = network_file_of(vehicle)
        network = load_network(network_file)
        plan = make_plan(
            load_vehicle(vehicle), np.random.default_rng(seed), steps=steps, periods=4, cycle=network.cycle_period
        )
        run = Run(RunFolder(folder), plan, network, seed, "emulator, in lockstep", vehicle, known_inertia)
        create_run(run, find_data_file("ident.vehicle", vehicle))
        with emulation.bench(vehicle, seed, False, network_file) as bench:
            recorder = Recorder(run.folder.frames, log_format)
            runner = CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None)
            runner.drive()
            recorder.close()
        return run

    return drive_into
