"""How a server of emulated nodes lets time pass, told by a clock that the test owns."""

from __future__ import annotations

from collections.abc import Callable

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.serving import VehicleServer
from hil.bus.lockstep import LockstepHub

SYNC = can.Message(arbitration_id=0x80, is_extended_id=False)


class Served:
    """A server on a bus whose clock moves only while the server waits for frames."""

    def __init__(self, lockstep: bool) -> None:
        # A SYNC identifier that nobody uses: this bus must not move time by itself.
        hub = LockstepHub(cycle_period=0.002, bit_rate=1e9, sync_cob_id=0x7FF)
        self.clock = hub.clock
        self.master = hub.open()
        self.vehicle = Flywheels()
        self.server = VehicleServer(self.vehicle, hub.open(), hub.clock, lockstep=lockstep)

    def run(self, duration: float) -> float:
        """Serve for a while; how far simulated time went meanwhile."""
        before, end = self.vehicle.time, self.clock.now() + duration
        self.server.serve(self._after(end))
        return self.vehicle.time - before

    def _after(self, end: float) -> Callable[[], bool]:
        return lambda: self.clock.now() >= end - 1e-9


@pytest.mark.parametrize("lockstep", [False, True])
def test_before_the_first_sync_time_follows_the_clock(lockstep: bool) -> None:
    assert Served(lockstep).run(1.0) == pytest.approx(1.0, abs=0.0011)


def test_in_real_time_a_sync_moves_nothing_but_is_answered_at_its_instant() -> None:
    served = Served(lockstep=False)
    for _ in range(10):
        served.master.send(SYNC)
    assert served.run(0.1) == pytest.approx(0.1, abs=0.0011)
    assert served.server.report.syncs == 10


def test_in_lockstep_each_sync_but_the_first_moves_one_cycle_period() -> None:
    served = Served(lockstep=True)
    served.run(0.05)
    for _ in range(100):
        served.master.send(SYNC)
    assert served.run(0.001) == pytest.approx(99 * 0.002, abs=1e-9)


def test_a_short_pause_of_the_master_stops_time_and_a_long_one_gives_it_back_to_the_clock() -> None:
    served = Served(lockstep=True)
    served.master.send(SYNC)
    served.master.send(SYNC)
    assert served.run(0.19) == pytest.approx(0.002, abs=1e-9)
    assert served.run(1.01) == pytest.approx(1.0, abs=0.003)


def test_falling_behind_the_clock_is_counted() -> None:
    served = Served(lockstep=False)
    served.run(0.1)
    served.clock.wait_until(served.clock.now() + 0.5)
    served.run(0.1)
    assert served.server.report.overruns == 1
    assert served.server.report.worst_lag == pytest.approx(0.5, abs=0.003)
    assert served.vehicle.time == pytest.approx(served.clock.now(), abs=0.0011)


def test_a_machine_too_slow_for_the_clock_answers_in_lockstep_and_leaves_the_rest_of_the_time_out() -> None:
    served = Served(lockstep=True)
    served.run(0.1)
    before = served.vehicle.time
    # A step of the vehicle that took half a second of the processor, and a master that has asked meanwhile.
    served.clock.wait_until(served.clock.now() + 0.5)
    served.run(0.001)
    assert served.vehicle.time - before <= 0.002 + 0.0011
    assert served.server.report.overruns == 0
    assert served.run(1.0) == pytest.approx(1.0, abs=0.0031)
