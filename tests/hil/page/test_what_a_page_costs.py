"""What the page costs the loop that moves the vehicle: processor time of a look, and cycles that come late."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench import emulation
from hil.bench.lockstep import LockstepBench
from hil.bench.real_time import Trial, drive_bench
from hil.master import Master
from hil.network import DEFAULT_NETWORK
from hil.page.channel import Channel, make_pair
from hil.page.emulated import Around, EmulatedView
from hil.page.shown import BusNow
from hil.page.watch import PERIOD, Watch

pytestmark = pytest.mark.bench

CYCLES = 10_000
BUSY = 0.7
"""Load of the machine, in processes that want a core, from which on lateness says nothing about us."""
LOOKS = 2000


def test_a_look_takes_less_than_a_per_cent_of_the_processor(capsys: pytest.CaptureFixture[str]) -> None:
    spent = look_time()
    with capsys.disabled():
        print(f"\na look: {spent * 1e6:.0f} us of processor time, {100 * spent / PERIOD:.2f} % of the loop's")
    assert spent / PERIOD < 0.01


def look_time() -> float:
    """Processor time of the loop for one look, reading and sending [s]."""
    network = emulation.complete_network("prototype", DEFAULT_NETWORK)
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle) as bench:
        around = Around(lambda: BusNow(bench.load.frames, (bench.load.bits,) * 2))
        ours, theirs = map(Channel, make_pair())
        view = EmulatedView("title", vehicle, bench.devices, network, around)
        watch = Watch(ours, view, bench.faults, count(step=2 * PERIOD).__next__)
        spent = 0.0
        with Master(bench.bus, bench.clock, network) as master:
            master.boot()
            master.enable()
            for _ in range(LOOKS):
                master.exchange((0.1,) * 4)
                begin = time.thread_time()
                watch.attend()
                spent += time.thread_time() - begin
                theirs.receive()
    return spent / LOOKS


def test_with_a_page_that_somebody_reads_no_more_cycles_are_late(capsys: pytest.CaptureFixture[str]) -> None:
    """The reader draws nothing: drawing in software would take a core of its own."""
    load = os.getloadavg()[0]
    if load > BUSY:
        pytest.skip(f"the machine is busy (load {load:.1f}): lateness would be that of other programs")
    without, served = compare(rounds=2)
    with capsys.disabled():
        print(f"\nlate by more than 1 ms: {100 * without:.2f} % without a page, {100 * served:.2f} % with one")
    assert served < without + 0.002


def compare(rounds: int, cycles: int = CYCLES) -> tuple[float, float]:
    """Shares of late cycles without and with a page, by turns, so that both meet the same machine."""
    emulate = (sys.executable, "-m", "quasiomni", "emulate")
    alone = Trial(emulate, cycles)
    shown = Trial((*emulate, "--web", "--web-port", "0"), cycles, beside=read_by_nobody)
    shares = [[len(drive_bench(one, cycles).cycles) / cycles for one in (alone, shown)] for _ in range(rounds)]
    without, served = np.mean(shares, axis=0)
    return float(without), float(served)


@contextmanager
def read_by_nobody(said: str) -> Iterator[None]:
    """A client of the page that a server has told of, in a process of its own: reads all it gets and draws nothing."""
    found = re.search(r"The page is http://(\S+)", said)
    assert found
    with subprocess.Popen([sys.executable, __file__, found.group(1)], stdout=subprocess.PIPE) as reader:
        try:
            assert reader.stdout is not None
            assert reader.stdout.readline() == b"reading\n"
            yield
        finally:
            reader.kill()


def read(address: str) -> None:
    """Read until the page ends."""
    from viser import __version__

    with connect(f"ws://{address}", subprotocols=[f"viser-v{__version__}"], max_size=None) as page:  # type: ignore[list-item]
        page.recv()
        print("reading", flush=True)
        try:
            while True:
                page.recv()
        except ConnectionClosed:
            return


if __name__ == "__main__":
    read(sys.argv[1])
