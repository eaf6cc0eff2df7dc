"""SDO of the emulated nodes against python canopen's client: expedited, segmented, block, and the aborts."""

from __future__ import annotations

import queue
import struct

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

NAME = b"quasiomni wheel drive"


class Answers(queue.Queue):
    """The answers are there when the request returns: an empty queue is a node that does not answer."""

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        return super().get(block=False)


@pytest.fixture
def client(wire):
    network = canopen.Network()

    def send_message(can_id: int, data: bytes, remote: bool = False) -> None:
        for answer_id, answer in wire.send(can_id, bytes(data)):
            network.notify(answer_id, bytearray(answer), 0.0)

    network.send_message = send_message
    node = canopen.RemoteNode(1, canopen.ObjectDictionary())
    network.add_node(node)
    node.sdo.responses = Answers()
    return node.sdo


def test_expedited_upload_and_download(client) -> None:
    client.download(0x1017, 0, struct.pack("<H", 250))
    assert client.upload(0x1017, 0) == struct.pack("<H", 250)


def test_segmented_upload_of_a_string(client) -> None:
    assert client.upload(0x1008, 0) == NAME


def test_segmented_download(client) -> None:
    client.download(0x6087, 0, struct.pack("<I", 123456), force_segment=True)
    assert client.upload(0x6087, 0) == struct.pack("<I", 123456)


def test_block_upload(client) -> None:
    with client.open(0x1008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == NAME


@pytest.mark.parametrize("length", range(1, 30))
def test_block_upload_ends_right_whatever_the_length(wire, client, length: int) -> None:
    """A string of 7, 14, 21 ... bytes fills its last segment."""
    text = bytes(range(65, 65 + length))
    wire.devices.nodes[1].object_dictionary.lookup(0x1008, 0).value = text
    with client.open(0x1008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == text


def test_block_download(client) -> None:
    with client.open(0x6087, 0, "wb", block_transfer=True, size=4) as stream:
        stream.write(struct.pack("<I", 4321))
    assert client.upload(0x6087, 0) == struct.pack("<I", 4321)


ABORTS = {
    "no such object": (lambda sdo: sdo.upload(0x5555, 0), 0x06020000),
    "no such sub-index": (lambda sdo: sdo.upload(0x1018, 9), 0x06090011),
    "write to a read-only object": (lambda sdo: sdo.download(0x6041, 0, b"\x00\x00"), 0x06010002),
    "write to a constant": (lambda sdo: sdo.download(0x1018, 0, b"\x04"), 0x06010002),
    "too short": (lambda sdo: sdo.download(0x1017, 0, b"\x01"), 0x06070013),
    "too long": (lambda sdo: sdo.download(0x1017, 0, b"\x01\x00\x00"), 0x06070012),
    "too high": (lambda sdo: sdo.download(0x6007, 0, struct.pack("<h", 4)), 0x06090031),
    "too low": (lambda sdo: sdo.download(0x6007, 0, struct.pack("<h", -1)), 0x06090032),
    "error history set to anything but 0": (lambda sdo: sdo.download(0x1003, 0, b"\x01"), 0x06090030),
    "the same node in two heartbeat consumers": (
        lambda sdo: [sdo.download(0x1016, k, struct.pack("<I", 0x7F0064)) for k in (1, 2)],
        0x06040043,
    ),
}


@pytest.mark.parametrize(("access", "code"), ABORTS.values(), ids=ABORTS)
def test_aborts(client, access, code: int) -> None:
    with pytest.raises(SdoAbortedError) as caught:
        access(client)
    assert caught.value.code == code


def test_a_stopped_node_does_not_answer_sdo(wire, client) -> None:
    wire.nmt(0x02, 1)
    with pytest.raises(SdoCommunicationError):
        client.upload(0x1000, 0)
    wire.nmt(0x80, 1)
    assert client.upload(0x1000, 0) == struct.pack("<I", 0x00020192)


def test_a_transfer_that_is_begun_anew_starts_from_the_beginning(wire, client) -> None:
    wire.send(0x601, struct.pack("<BHB4x", 0x40, 0x1008, 0))
    wire.send(0x601, b"\x60" + bytes(7))
    assert client.upload(0x1008, 0) == NAME
