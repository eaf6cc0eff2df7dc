"""How real the real time of this computer is: a loop that only sleeps, and the bench, measured by turns."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from hil.bench.explaining import explain
from hil.bench.lateness import LATE, Floats, LateCycle, Lateness, Reason
from hil.bench.tracing import TracedClock, tap_of_sync
from hil.bus.clock import Clock, WallClock
from hil.bus.opening import open_bus
from hil.bus.realtime import steady_memory
from hil.bus.stamps import Moment, Stamped, Stamps, read_stamps
from hil.bus.urgency import Urgency, urgent
from hil.master import Master
from hil.network import load_network
from ident.errors import BusError

_TORQUE: Final = (0.05,) * 4
"""[Nm]; the wheels turn slowly."""

_FAREWELL: Final = 120.0
"""Longest wait for the end of a server, which writes its stamps then [s]."""

QUANTILES: Final = (0.5, 0.99, 0.999, 1.0)


@dataclass(frozen=True)
class Trial:
    """What is measured.

    Attributes:
        server: command of a server of the emulated vehicle, to which `--bus NAME --trace FILE` is added; it says when
            it is up.
        cycles: of the bench and of the bare loop, each [-].
        rounds: by turns, so that both meet the same computer.
        priority: whether loop and master may have real-time priority; for the server the command says so.
        beside: called with what the server has said when it is up; what it gives is open while the master drives.
    """

    server: Sequence[str]
    cycles: int
    rounds: int = 2
    priority: bool = True
    beside: Callable[[str], AbstractContextManager[object]] = nullcontext


@dataclass(frozen=True)
class Measured:
    """What came of it.

    Attributes:
        bare: lateness of each turn of the loop that only sleeps [s].
        bench: lateness of each cycle [s].
        cycles: of the bench, that were late.
        urgency: what loop and master got.
        load: of the computer when it began, in processes that want a core.
    """

    bare: Floats
    bench: Floats
    cycles: tuple[LateCycle, ...]
    urgency: Urgency
    load: float

    @property
    def shares(self) -> tuple[float, float]:
        """Of what is later than a millisecond, of the loop that only sleeps and of the bench."""
        return float((self.bare > LATE).mean()), float((self.bench > LATE).mean())

    @property
    def reasons(self) -> Counter[Reason]:
        """How often each made a cycle late."""
        return Counter(cycle.reason for cycle in self.cycles)

    @property
    def unexplained(self) -> int:
        """Late cycles without a reason."""
        return self.reasons[Reason.UNKNOWN]

    def quantiles(self) -> list[tuple[float, float, float]]:
        """Of some shares, the lateness [s] that so many of the loop and of the bench do not exceed."""
        return [
            (share, float(np.quantile(self.bare, share)), float(np.quantile(self.bench, share))) for share in QUANTILES
        ]


def measure(trial: Trial, told: Callable[[int, int], None] = lambda *_: None) -> Measured:
    """Measure by turns; takes twice the time of the cycles, and some seconds a round.

    Args:
        trial: what.
        told: turns that are done, and turns in all.

    Raises:
        BusError: the server does not come up.
    """
    load = os.getloadavg()[0]
    period = load_network().cycle_period
    cycles = math.ceil(trial.cycles / trial.rounds)
    bare: list[Floats] = []
    bench: list[Lateness] = []
    for turn in range(trial.rounds):
        told(2 * turn, 2 * trial.rounds)
        with steady_memory(), urgent(trial.priority) as got:
            bare.append(bare_loop(WallClock(), period, cycles))
        told(2 * turn + 1, 2 * trial.rounds)
        bench.append(drive_bench(trial, cycles))
    told(2 * trial.rounds, 2 * trial.rounds)
    late = tuple(cycle for one in bench for cycle in one.cycles)
    return Measured(np.concatenate(bare), np.concatenate([one.late for one in bench]), late, got, load)


def bare_loop(clock: Clock, period: float, cycles: int) -> Floats:
    """A loop that does nothing but wait for its next turn, as the master does: lateness of each (n,) [s]."""
    late = np.empty(cycles)
    instant = clock.now()
    for turn in range(cycles):
        instant += period
        late[turn] = clock.wait_until(instant)
        if late[turn] > period:
            instant += math.ceil(late[turn] / period) * period
    return late


def drive_bench(trial: Trial, cycles: int) -> Lateness:
    """A server in a process of its own, and a master in this one, that leave stamps.

    Raises:
        BusError: the server does not come up, or does not end.
    """
    with tempfile.TemporaryDirectory() as folder:
        bus, trace = f"unix:{folder}/bus", Path(folder, "server.csv")
        command = [*trial.server, "--bus", bus, "--trace", str(trace)]
        with _serving(command) as said, trial.beside(said):
            master = _drive(bus, cycles, trial.priority)
        return explain(master, read_stamps(trace))


def _drive(name: str, cycles: int, priority: bool) -> Stamped:
    network, stamps = load_network(), Stamps()
    with (
        steady_memory(),
        stamps.collections(),
        urgent(priority),
        open_bus(name) as bus,
        Master(bus, TracedClock(stamps), network, tap_of_sync(stamps, network.sync_cob_id)) as master,
    ):
        master.boot()
        master.enable()
        # The first says when the second may begin.
        for _ in range(cycles + 1):
            master.exchange(_TORQUE)
            stamps.stamp(Moment.HEARD)
    return stamps.table()


@contextmanager
def _serving(command: Sequence[str]) -> Iterator[str]:
    """A server that is up; gives what it has said so far."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            said = ""
            while "is up on" not in said:
                line = process.stdout.readline()
                if not line:
                    raise BusError(f"The server does not come up: {said.strip()}", "Try `quasiomni doctor emulator`.")
                said += line
            yield said
            process.send_signal(signal.SIGINT)
            try:
                process.communicate(timeout=_FAREWELL)
            except subprocess.TimeoutExpired as error:
                raise BusError("The server does not end.", "Close other programs, and measure again.") from error
        finally:
            process.kill()
