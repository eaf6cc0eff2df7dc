"""The emulated nodes in a process of their own, a master in this one, frames and nothing else between them."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.serving import VehicleServer
from hil.bus.clock import FreeRunningClock, WallClock
from hil.bus.opening import open_bus
from hil.master import Master
from hil.network import Network
from ident.errors import BusError

SERVER = """
import sys
from pathlib import Path
from emulator.firmware.flywheels import Flywheels
from hil.bus.unix import UnixHub
from hil.bus.clock import WallClock
from hil.bench.serving import VehicleServer
with UnixHub(Path(sys.argv[1])) as hub:
    lockstep, delays = sys.argv[2].startswith("lockstep"), sys.argv[2].endswith("bit times")
    server = VehicleServer(Flywheels(), hub, WallClock(), lockstep=lockstep, delays=delays)
    print("ready", flush=True)
    server.serve(lambda: False)
"""


@contextmanager
def emulator(path: Path, pacing: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER, str(path), pacing], stdout=subprocess.PIPE, text=True, stderr=subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.kill()
        process.communicate()


PATIENCE = [
    ("sample_timeout = { value = 0.1,", "sample_timeout = { value = 5.0,"),
    ("heartbeat_timeout = { value = 0.25,", "heartbeat_timeout = { value = 5.0,"),
    ("heartbeat_period = { value = 0.1,", "heartbeat_period = { value = 2.0,"),
]
"""A computer that runs other things besides must not fail these tests."""


def test_the_same_master_works_over_a_bus_of_python_can(rewritten_network) -> None:
    """Two endpoints of `virtual` in two threads stand for any interface that python-can knows."""
    done = threading.Event()
    network = rewritten_network(*PATIENCE)
    served = can.Bus("vehicle", interface="virtual")
    server = VehicleServer(Flywheels(), served, WallClock())
    thread = threading.Thread(target=server.serve, args=(done.is_set,))
    thread.start()
    try:
        with open_bus("virtual:vehicle") as bus, Master(bus, WallClock(), network) as master:
            master.boot()
            master.enable()
            angles = [master.exchange((0.2,) * 4).wheel_angles[0] for _ in range(100)]
    finally:
        done.set()
        thread.join()
        served.shutdown()
    assert all(after > before for before, after in pairwise(angles[5:]))
    assert server.report.syncs > 100


def drive_for_ever(master: Master) -> None:
    while True:
        master.exchange((0.0,) * 4)


@pytest.mark.parametrize("pacing", ["lockstep", "lockstep with bit times"])
def test_in_lockstep_simulated_seconds_pass_as_fast_as_the_machine_allows(
    tmp_path: Path, rewritten_network, pacing: str
) -> None:
    network = rewritten_network(*PATIENCE)
    with (
        emulator(tmp_path / "bus", pacing),
        open_bus(f"unix:{tmp_path / 'bus'}") as bus,
        Master(bus, FreeRunningClock(), network) as master,
    ):
        master.boot()
        master.enable()
        first = master.exchange((0.1,) * 4)
        start = time.perf_counter()
        for _ in range(1000):
            sample = master.exchange((0.1,) * 4)
        real = time.perf_counter() - start
    assert sample.time - first.time == pytest.approx(2.0)
    assert pacing != "lockstep" or real < 2.0
    torque, t = round(100 / 1.27) * 1.27e-3, 2.0
    expected = torque / 1e-3 * (t - (1 - 2.718281828459045 ** (-t)) / 1.0) / 20
    assert sample.wheel_angles[0] - first.wheel_angles[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("pacing", ["realtime", "realtime with bit times"])
def test_in_real_time_a_simulated_second_takes_a_second(tmp_path: Path, rewritten_network, pacing: str) -> None:
    network = rewritten_network(*PATIENCE)
    with (
        emulator(tmp_path / "bus", pacing),
        open_bus(f"unix:{tmp_path / 'bus'}") as bus,
        Master(bus, WallClock(), network) as master,
    ):
        master.boot()
        master.enable()
        start, first = time.perf_counter(), master.exchange((0.1,) * 4)
        for _ in range(500):
            sample = master.exchange((0.1,) * 4)
        real = time.perf_counter() - start
    assert real > 0.99
    torque, t = round(100 / 1.27) * 1.27e-3, sample.time - first.time
    assert t == pytest.approx(real, rel=0.1)
    expected = torque / 1e-3 * (t - (1 - 2.718281828459045 ** (-t)) / 1.0) / 20
    assert sample.wheel_angles[0] - first.wheel_angles[0] == pytest.approx(expected, rel=0.1)


def test_the_death_of_the_other_side_is_an_error_and_not_a_hang(tmp_path: Path, network: Network) -> None:
    with emulator(tmp_path / "bus", "lockstep") as process, open_bus(f"unix:{tmp_path / 'bus'}") as bus:
        master = Master(bus, FreeRunningClock(), network)
        master.boot()
        master.enable()
        process.kill()
        process.wait()
        start = time.perf_counter()
        with pytest.raises(BusError):
            drive_for_ever(master)
        assert time.perf_counter() - start < 2.0
