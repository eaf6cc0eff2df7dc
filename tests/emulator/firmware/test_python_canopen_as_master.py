"""Python canopen, an independent master, on the nodes: NMT, PDO remapping, SYNC, emergencies, SDO, heartbeat.

Its network gets frames handed over in the instant they are sent: simulated time passes only where the tests say so.
"""

from __future__ import annotations

import queue
import struct
from pathlib import Path

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

DATA = Path(__file__).parents[3] / "hil" / "data"
DRIVE, ENCODER = 1, 5


class Answers(queue.Queue):
    """The answers are there when the request returns: an empty queue is a node that does not answer."""

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        return super().get(block=False)


class Network(canopen.Network):
    """canopen's network on the wire of the devices."""

    def __init__(self, wire) -> None:
        super().__init__()
        self.wire = wire

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.hand_over(self.wire.remote(can_id) if remote else self.wire.send(can_id, bytes(data)))

    def let_pass(self, seconds: float) -> None:
        self.hand_over(self.wire.wait(seconds))

    def hand_over(self, frames: list[tuple[int, bytes]]) -> None:
        for can_id, data in frames:
            self.notify(can_id, bytearray(data), self.wire.devices.time)


@pytest.fixture
def network(wire):
    return Network(wire)


@pytest.fixture
def drive(network):
    node = BaseNode402(DRIVE, canopen.import_od(str(DATA / "drive.eds"), DRIVE))
    network.add_node(node)
    node.sdo.responses = Answers()
    return node


@pytest.fixture
def encoder(network):
    node = canopen.RemoteNode(ENCODER, canopen.import_od(str(DATA / "encoder.eds"), ENCODER))
    network.add_node(node)
    node.sdo.responses = Answers()
    return node


def test_it_reads_the_identity_through_the_eds(drive) -> None:
    assert drive.sdo["Identity object"]["Vendor-ID"].raw == 0x7FFF0001
    assert drive.sdo["Manufacturer device name"].raw == "quasiomni wheel drive"


def test_it_follows_the_nmt_state_by_heartbeats(network, drive) -> None:
    drive.sdo["Producer heartbeat time"].raw = 50
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        drive.nmt.state = state
        network.let_pass(0.051)
        assert drive.nmt.state == state


def test_it_reads_the_pdo_configuration_of_a_node(drive) -> None:
    drive.tpdo.read()
    drive.rpdo.read()
    assert [entry.name for entry in drive.rpdo[1].map] == ["Controlword", "Target torque"]
    assert [entry.index for entry in drive.tpdo[1].map] == [0x6041, 0x6077, 0x6064]
    assert (drive.tpdo[1].cob_id, drive.rpdo[1].cob_id) == (0x181, 0x201)


def test_it_remaps_a_tpdo_and_receives_it_with_the_sync(network, drive) -> None:
    drive.tpdo.read()
    tpdo = drive.tpdo[2]
    tpdo.clear()
    tpdo.add_variable(0x6079)
    tpdo.add_variable("Velocity actual value")
    tpdo.trans_type = 2
    tpdo.cob_id = 0x1C1
    tpdo.enabled = True
    tpdo.save()
    drive.nmt.state = "OPERATIONAL"
    received = []
    tpdo.add_callback(lambda pdo: received.append(pdo.timestamp))
    for _ in range(6):
        network.let_pass(0.002)
        network.sync.transmit()
    assert len(received) == 3
    assert tpdo["Velocity actual value"].raw == 0
    assert tpdo.map[0].raw == drive.sdo[0x6079].raw


def test_it_moves_a_shaft_by_rpdo(network, drive) -> None:
    drive.tpdo.read()
    drive.rpdo.read()
    for pdo in (drive.tpdo[1], drive.rpdo[1]):
        pdo.trans_type = 1
        pdo.save()
    drive.nmt.state = "OPERATIONAL"
    drive.sdo["Modes of operation"].raw = 10
    for controlword in (0x06, 0x07, 0x0F):
        drive.rpdo[1]["Controlword"].raw = controlword
        drive.rpdo[1]["Target torque"].raw = 300
        drive.rpdo[1].transmit()
        network.let_pass(0.002)
        network.sync.transmit()
    first = drive.tpdo[1]["Position actual value"].raw
    for _ in range(50):
        network.let_pass(0.002)
        network.sync.transmit()
    assert drive.tpdo[1]["Statusword"].raw & 0x6F == 0x27
    assert drive.tpdo[1]["Torque actual value"].raw == 300
    assert drive.tpdo[1]["Position actual value"].raw > first


def test_it_receives_emergencies_and_their_end(network, encoder) -> None:
    network.subscribe(0x080 + ENCODER, encoder.emcy.on_emcy)
    encoder.sdo["Consumer heartbeat time"][1].raw = 0x7F << 16 | 100
    network.send_message(0x77F, b"\x05")
    network.let_pass(0.2)
    assert [(error.code, error.register) for error in encoder.emcy.active] == [(0x8130, 0x11)]
    network.send_message(0x77F, b"\x05")
    assert [error.code for error in encoder.emcy.log] == [0x8130, 0]
    assert encoder.emcy.active == []


def test_it_saves_and_restores_parameters(network, encoder) -> None:
    encoder.sdo["Producer heartbeat time"].raw = 77
    encoder.store()
    encoder.nmt.send_command(0x81)
    assert encoder.sdo["Producer heartbeat time"].raw == 77
    encoder.restore()
    encoder.nmt.send_command(0x81)
    assert encoder.sdo["Producer heartbeat time"].raw == 0


def test_it_asks_for_a_tpdo_by_remote_frame(network, encoder) -> None:
    encoder.tpdo.read()
    encoder.tpdo[1].rtr_allowed = True
    encoder.tpdo[1].save()
    encoder.nmt.state = "OPERATIONAL"
    encoder.tpdo[1].remote_request()
    assert encoder.tpdo[1]["Position value"].raw == encoder.sdo["Position value"].raw


def test_it_guards_a_node(network, encoder) -> None:
    network.send_message(0x700 + ENCODER, b"", remote=True)
    assert encoder.nmt.state == "PRE-OPERATIONAL"


def test_it_reads_a_domain_in_blocks_and_in_segments(drive) -> None:
    eds = (DATA / "drive.eds").read_bytes()
    for block in (False, True):
        with drive.sdo.open(0x1021, 0, "rb", block_transfer=block) as stream:
            assert stream.read() == eds


def test_a_time_out_of_the_node_is_an_abort_to_it(network, drive) -> None:
    network.send_message(0x600 + DRIVE, struct.pack("<BHB4x", 0x40, 0x1008, 0))
    network.let_pass(1.1)
    answers = []
    while not drive.sdo.responses.empty():
        answers.append(bytes(drive.sdo.responses.get()))
    assert answers[-1] == bytes.fromhex("8008100000000405")
