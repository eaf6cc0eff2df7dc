"""A master drives the devices inside an FMU as it drives any others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from emulator.prototype import load_prototype
from fmu.bus.packaging import build_bus_fmu, vehicle_plant
from fmu.compiling import find_compiler
from fmu.platforms import host_platform
from fmu.source import ModelSource
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import read_run
from hil.campaign.runner import CampaignRunner
from hil.cosimulation.instance import FmuError
from hil.frames.recorder import Recorder
from hil.lsbus.bench import bus_fmu_bench, bus_plant_path
from hil.lsbus.system import vehicle_on_bus
from hil.master import Master
from hil.network import DEFAULT_NETWORK, load_network
from ident.campaign.plan import make_plan
from ident.estimate.identify import identify
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES


def test_a_master_boots_it_and_drives_it_as_any_other_vehicle(bus_fmu: Path) -> None:
    with (
        bus_fmu_bench(bus_fmu, 1, DEFAULT_NETWORK) as bench,
        Master(bench.bus, bench.clock, load_network()) as master,
    ):
        master.boot()
        master.enable()
        first = master.exchange((0.0,) * 4)
        for _ in range(250):
            sample = master.exchange((0.6,) * 4)
    turned = np.array(sample.wheel_angles) - first.wheel_angles
    assert np.all(turned > 0.02)
    assert np.ptp(turned) < 0.02 * np.mean(turned)


def test_lifted_wheels_run_free(bus_fmu: Path) -> None:
    turned = []
    for lifted in (False, True):
        with (
            bus_fmu_bench(bus_fmu, 1, DEFAULT_NETWORK) as bench,
            Master(bench.bus, bench.clock, load_network()) as master,
        ):
            if lifted:
                bench.operator.lift()
            master.boot()
            master.enable()
            first = master.exchange((0.0,) * 4)
            for _ in range(100):
                sample = master.exchange((0.6,) * 4)
            turned.append(float(np.mean(np.array(sample.wheel_angles) - first.wheel_angles)))
    assert turned[1] > 5 * turned[0]


def test_a_plant_that_cannot_be_is_refused_with_a_remedy(platform: Path) -> None:
    with pytest.raises(FmuError, match="fmu-bus:FILE"):
        bus_plant_path("fmu:platform.fmu")
    with pytest.raises(FmuError, match="no CAN bus terminal"), bus_fmu_bench(platform, 1, DEFAULT_NETWORK):
        pass


@pytest.mark.slow
def test_a_campaign_over_the_bus_terminal_finds_the_parameters_of_the_fmu(source: ModelSource, tmp_path: Path) -> None:
    """The same master, controller and estimator, noise as on the emulator; every parameter to half a per cent."""
    fmu, described, network = tmp_path / "noisy.fmu", load_vehicle(), load_network()
    system = vehicle_on_bus(load_prototype(), DEFAULT_NETWORK)
    fmu.write_bytes(build_bus_fmu(vehicle_plant(source), system, {}, (host_platform(),), find_compiler()))
    steps = (Step.WHEEL_LIFTED, Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
    plan = make_plan(described, np.random.default_rng(1), steps=steps, periods=4, cycle=network.cycle_period)
    run = Run(RunFolder(tmp_path / "run"), plan, network, 1, f"fmu-bus:{fmu}", "", None)
    create_run(run, find_data_file("ident.vehicle", "prototype"))
    with bus_fmu_bench(fmu, 1, DEFAULT_NETWORK) as bench:
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None).drive()
        recorder.close()
    result = identify(read_run(run.folder.path), described.geometry)
    errors = {one.name: one.value / described.prior[one.name] - 1 for one in result.estimates}
    assert errors.keys() == set(PARAMETER_NAMES)
    assert max(abs(error) for error in errors.values()) < 5e-3, errors
