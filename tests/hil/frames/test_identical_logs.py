"""One seed, one log, to the last bit: with faults, with bit times, in every format."""

from __future__ import annotations

from pathlib import Path

import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.frames.recorder import LogFormat, Recorder
from hil.master import Master
from hil.network import load_network

FAULTS = (
    "delay@0x180-0x1ff:time=0.1ms,jitter=0.3ms,rate=30%",
    "duplicate@0x281-0x2ff:rate=20%",
    "corrupt@0x7ff:rate=5%",
)


def log(folder: Path, log_format: LogFormat, seed: int, delays: bool) -> bytes:
    recorder = Recorder(folder, log_format)
    network = load_network()
    with (
        EmulatedVehicle(load_prototype(), seed=seed) as vehicle,
        LockstepBench(vehicle, seed=seed, delays=delays) as bench,
    ):
        for fault in FAULTS:
            bench.faults.add(fault)
        with Master(bench.bus, bench.clock, network, recorder) as master, recorder.step("straight") as path:
            master.boot()
            master.enable()
            for k in range(100):
                master.exchange((0.3, 0.4, 0.5, 0.01 * k))
            master.shut_down()
    recorder.settle()
    return path.read_bytes()


@pytest.mark.parametrize("delays", [False, True])
@pytest.mark.parametrize("log_format", [LogFormat.BLF, LogFormat.CANDUMP])
def test_a_rerun_with_the_same_seed_gives_the_same_file(tmp_path: Path, log_format: LogFormat, delays: bool) -> None:
    first, second = (log(tmp_path / name, log_format, 7, delays) for name in ("first", "second"))
    assert first == second


def test_another_seed_gives_another_file(tmp_path: Path) -> None:
    one, other = (log(tmp_path / str(seed), LogFormat.CANDUMP, seed, False) for seed in (7, 8))
    assert one != other
