"""What the connector costs beside the physics, as ratios in one run."""

from __future__ import annotations

import math
import time
from pathlib import Path

import pytest

from emulator.firmware.flywheels import Flywheels
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.frames import decode_log
from hil.frames.recorder import Recorder
from hil.master import Master
from hil.network import Network

CYCLES = 5000


def seconds_per_call(call, repetitions: int) -> float:
    """CPU time of one call, the best of three batches."""
    best = math.inf
    for _ in range(3):
        start = time.process_time()
        for number in range(repetitions):
            call(number)
        best = min(best, (time.process_time() - start) / repetitions)
    return best


@pytest.mark.bench
def test_master_bus_firmware_and_recorder_cost_less_than_the_physics(
    tmp_path: Path, network: Network, capsys: pytest.CaptureFixture[str]
) -> None:
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle:
        physics = seconds_per_call(lambda _: vehicle.advance(0.002), 1000)
    recorder = Recorder(tmp_path)
    with LockstepBench(Flywheels()) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        connector = seconds_per_call(
            lambda k: master.exchange([0.3 * math.sin(0.05 * k + wheel) for wheel in range(4)]), CYCLES
        )
    with capsys.disabled():
        print(f"\nconnector {connector * 1e6:.0f} us a cycle, physics {physics * 1e6:.0f} us a cycle")
    assert connector < physics


@pytest.mark.bench
def test_two_hundred_seconds_of_frames_decode_in_two_seconds_of_cpu(
    tmp_path: Path, network: Network, capsys: pytest.CaptureFixture[str]
) -> None:
    recorder = Recorder(tmp_path)
    with LockstepBench(Flywheels()) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            for k in range(100_000):
                master.exchange([0.3 * math.sin(0.05 * k + wheel) for wheel in range(4)])
    recorder.settle()
    start = time.process_time()
    decoded = decode_log(path, network)
    spent = time.process_time() - start
    with capsys.disabled():
        print(f"\n{len(decoded.time)} cycles decoded in {spent:.2f} s")  # the numbers are what `make bench` is for
    assert len(decoded.time) == 100_000
    assert spent < 2.0
