"""What counts as a bus that is not well, found in the frames of a bench."""

from __future__ import annotations

from collections.abc import Iterator

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import Network, load_network
from hil.pytest_plugin.health import Symptom, examine
from ident.errors import BusError

READ_DEVICE_TYPE = bytes.fromhex("4000100000000000")
READ_NOTHING = bytes.fromhex("40ffff0000000000")


class Watched:
    """A bench whose frames are examined."""

    def __init__(self, bench: LockstepBench) -> None:
        self.bench = bench
        self.network: Network = load_network()
        self.master = Master(bench.bus, bench.clock, self.network)
        self._frames: list[can.Message] = []
        bench.listen(self._frames.append)

    def boot(self) -> None:
        self.master.boot()
        self.master.enable()

    def drive(self, cycles: int) -> None:
        for _ in range(cycles):
            self.master.exchange((0.0,) * 4)

    def drive_until_lost(self) -> None:
        with pytest.raises(BusError):
            self.drive(1000)

    def send(self, can_id: int, data: bytes) -> None:
        self.bench.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def wait(self, duration: float) -> None:
        self.bench.clock.wait_until(self.bench.clock.now() + duration)

    def symptoms(self) -> set[Symptom]:
        found = examine(self._frames, self.bench.load.peak, self.network, self.bench.clock.now())
        assert all(finding.what for finding in found)
        return {finding.symptom for finding in found}


@pytest.fixture
def watched() -> Iterator[Watched]:
    with LockstepBench(Flywheels()) as bench:
        yield Watched(bench)


def test_a_campaign_from_boot_to_shut_down_leaves_a_well_bus(watched: Watched) -> None:
    with watched.master:
        watched.boot()
        watched.drive(200)
    assert watched.symptoms() == set()


def test_error_frames_are_a_symptom(watched: Watched) -> None:
    watched.bench.faults.add("bus_off@encoder_left")
    assert watched.symptoms() == {Symptom.ERROR_FRAMES}


def test_a_request_without_an_answer_is_a_symptom(watched: Watched) -> None:
    watched.bench.faults.add("drop@0x581:count=1")
    watched.send(0x602, READ_DEVICE_TYPE)
    watched.send(0x601, READ_DEVICE_TYPE)
    assert watched.symptoms() == {Symptom.UNANSWERED_SDO}
    watched.send(0x601, READ_DEVICE_TYPE)
    assert watched.symptoms() == set()


def test_a_refused_request_is_a_symptom(watched: Watched) -> None:
    watched.send(0x601, READ_NOTHING)
    assert watched.symptoms() == {Symptom.SDO_ABORT}


def test_a_node_that_falls_silent_while_operational_is_a_symptom(watched: Watched) -> None:
    watched.boot()
    watched.drive(200)
    watched.bench.faults.add("heartbeat@drive_fl")
    watched.drive_until_lost()
    assert Symptom.LOST_HEARTBEAT in watched.symptoms()


def test_nodes_that_miss_the_heartbeat_of_the_master_are_a_symptom(watched: Watched) -> None:
    watched.boot()
    watched.drive(200)
    watched.wait(0.3)
    assert Symptom.LOST_HEARTBEAT in watched.symptoms()


def test_more_frames_than_the_bus_can_carry_are_a_symptom(watched: Watched) -> None:
    watched.bench.faults.add("babble@0x7ff:rate=12000,length=8")
    watched.wait(0.2)
    assert watched.symptoms() == {Symptom.OVERLOAD}
