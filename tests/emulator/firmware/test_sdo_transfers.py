"""SDO of the emulated nodes against python canopen's client: expedited, segmented, block, and the aborts."""

from __future__ import annotations

import queue
import struct
from pathlib import Path

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

NETWORK_FILE = Path(__file__).parents[3] / "hil" / "data" / "network.toml"
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


TRANSFERS = {
    "expedited": {},
    "segmented": {"force_segment": True},
    "block": {"block_transfer": True, "request_crc_support": False},
    "block with checksum": {"block_transfer": True},
}


def transfer(client, index: int, subindex: int, data: bytes, kind: str) -> None:
    if "block" in kind:
        with client.open(index, subindex, "wb", size=len(data), **TRANSFERS[kind]) as stream:
            stream.write(data)
    else:
        client.download(index, subindex, data, **TRANSFERS[kind])


@pytest.mark.parametrize("kind", TRANSFERS)
def test_guard_time_is_written_in_every_kind_of_transfer(client, kind: str) -> None:
    transfer(client, 0x100C, 0, struct.pack("<H", 500), kind)
    assert client.upload(0x100C, 0) == struct.pack("<H", 500)


@pytest.mark.parametrize("kind", ["segmented", "block", "block with checksum"])
@pytest.mark.parametrize("length", [1, 2, 6, 7, 8, 13, 14, 15, 63, 200, 255, 256])
def test_text_of_any_length_goes_both_ways(client, kind: str, length: int) -> None:
    text = bytes(32 + k % 90 for k in range(length))
    transfer(client, 0x2000, 0, text, kind)
    assert client.upload(0x2000, 0) == text
    with client.open(0x2000, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == text


def test_text_longer_than_the_memory_of_the_device_is_refused(client) -> None:
    with pytest.raises(SdoAbortedError) as caught:
        transfer(client, 0x2000, 0, bytes(257), "segmented")
    assert caught.value.code == 0x06070012


def test_a_node_carries_its_own_eds(client, tmp_path: Path) -> None:
    with client.open(0x1021, 0, "rb", block_transfer=True) as stream:
        read = stream.read()
    eds = NETWORK_FILE.with_name("drive.eds").read_bytes()
    assert read == eds
    (path := tmp_path / "read.eds").write_bytes(read)
    assert canopen.import_od(str(path), 3)[0x1018][1].default == 0x7FFF0001


class Client:
    """Bare frames, for what a well-behaved client never sends."""

    def __init__(self, wire) -> None:
        self.wire = wire

    def ask(self, frame: str) -> list[str]:
        return [data.hex() for can_id, data in self.wire.send(0x601, bytes.fromhex(frame)) if can_id == 0x581]


@pytest.fixture
def bare(wire) -> Client:
    return Client(wire)


def abort(code: int, multiplexor: str = "000000") -> list[str]:
    return ["80" + multiplexor + code.to_bytes(4, "little").hex()]


BLOCK_WRITE = "c000200000000000"
"""Block download to 2000h without checksum and size."""

MISBEHAVIOUR = {
    "unknown command": (["e000100000000000"], abort(0x05040001, "001000")),
    "segment of nothing, download": (["0000000000000000"], abort(0x05040001)),
    "segment of nothing, upload": (["6000000000000000"], abort(0x05040001)),
    "end of no block": (["c100000000000000"], abort(0x05040001)),
    "toggle bit not altered, upload": (
        ["4008100000000000", "60" + "00" * 7, "60" + "00" * 7],
        abort(0x05030000, "081000"),
    ),
    "toggle bit not altered, download": (
        ["2000200000000000", "00" + "41" * 7, "00" + "41" * 7],
        abort(0x05030000, "002000"),
    ),
    "block of 0 segments": (["a008100000000000"], abort(0x05040002, "081000")),
    "block of 128 segments": (["a008100080000000"], abort(0x05040002, "081000")),
    "next block of 0 segments": (
        ["a008100001000000", "a3" + "00" * 7, "a20100" + "00" * 5],
        abort(0x05040002, "081000"),
    ),
    "more confirmed than sent": (
        ["a008100001000000", "a3" + "00" * 7, "a20201" + "00" * 5],
        abort(0x05040003, "081000"),
    ),
    "end before the data": (["a008100001000000", "a1" + "00" * 7], abort(0x05040001, "081000")),
    "another command in a block upload": (["a008100001000000", "60" + "00" * 7], abort(0x05040001, "081000")),
    "segment number 0": ([BLOCK_WRITE, "00" + "41" * 7], abort(0x05040003, "002000")),
    "no end after the last segment": ([BLOCK_WRITE, "81" + "41" * 7, "02" + "41" * 7], abort(0x05040001, "002000")),
    "wrong checksum": (["c600200007000000", "81" + "41" * 7, "c1ffff" + "00" * 5], abort(0x05040004, "002000")),
    "size not as announced": (["2100200005000000", "01" + "41" * 7], abort(0x06070010, "002000")),
    "size too large at once": (["2117100003000000"], abort(0x06070012, "171000")),
    "size too small at once": (["2117100001000000"], abort(0x06070013, "171000")),
    "segments longer than the object": (["2017100000000000", "00" + "41" * 7], abort(0x06070012, "171000")),
    "segments shorter than the object": (["2017100000000000", "0d" + "41" * 7], abort(0x06070013, "171000")),
    "block longer than the object": (
        ["c017100000000000", "81" + "41" * 7, "c1" + "00" * 7],
        abort(0x06070012, "171000"),
    ),
    "read-only object in segments": (["2108100004000000"], abort(0x06010002, "081000")),
    "read-only object in blocks": (["c208100004000000"], abort(0x06010002, "081000")),
    "no such object in blocks": (["a055550010000000"], abort(0x06020000, "555500")),
    "sub-index of a plain variable": (["4000100100000000"], abort(0x06090011, "001001")),
}


@pytest.mark.parametrize(("frames", "answer"), MISBEHAVIOUR.values(), ids=MISBEHAVIOUR)
def test_misbehaviour_ends_in_the_abort_of_the_standard_and_the_next_transfer_works(bare, frames, answer) -> None:
    for frame in frames[:-1]:
        bare.ask(frame)
    assert bare.ask(frames[-1])[-1:] == answer
    assert bare.ask("4000100000000000") == ["4300100092010200"]


def test_segments_that_are_lost_on_the_way_down_are_asked_for_again(bare) -> None:
    """The server confirms the last segment that came in order; the client goes back to the one after it."""
    bare.ask("c200200015000000")
    bare.ask("01" + "41" * 7)
    assert bare.ask("83" + "43" * 7) == ["a2017f0000000000"]
    bare.ask("01" + "42" * 7)
    assert bare.ask("82" + "43" * 7) == ["a2027f0000000000"]
    assert bare.ask("c100000000000000") == ["a100000000000000"]
    bare.ask("a000200014000000")
    segments = bare.ask("a300000000000000")
    assert [bytes.fromhex(segment)[1:] for segment in segments] == [b"A" * 7, b"B" * 7, b"C" * 7]


def test_segments_that_are_lost_on_the_way_up_are_sent_again(bare) -> None:
    bare.ask("a008100003000000")
    first = bare.ask("a300000000000000")
    assert bare.ask("a20103" + "00" * 5)[0][2:] == first[1][2:]
    assert bare.ask("a20003" + "00" * 5)[0][2:] == first[1][2:]
    assert bare.ask("a20203" + "00" * 5) == ["c100000000000000"]


def test_short_data_come_in_the_simpler_way_when_the_client_says_so(bare) -> None:
    """Protocol switch threshold of the block upload (CiA 301, 7.2.4.3.13)."""
    assert bare.ask("a0001000 10040000") == ["4300100092010200"]
    assert bare.ask("a0081000 10150000") == ["4108100015000000"]
    assert bare.ask("a0081000 10140000") == ["c608100015000000"]


@pytest.mark.parametrize("begin", ["2100200015000000", "4008100000000000", "a008100014000000", BLOCK_WRITE])
def test_a_transfer_that_is_left_alone_is_given_up(wire, bare, begin: str) -> None:
    bare.ask(begin)
    assert wire.wait(0.999) == []
    multiplexor = "002000" if begin[0] in "2c" else "081000"
    assert [data.hex() for can_id, data in wire.wait(0.002) if can_id == 0x581] == abort(0x05040000, multiplexor)
    assert wire.wait(10.0) == []


def test_a_node_that_is_stopped_in_a_transfer_stays_silent(wire, bare) -> None:
    bare.ask("4008100000000000")
    wire.nmt(0x02, 1)
    assert wire.wait(10.0) == []
    wire.nmt(0x80, 1)
    assert bare.ask("60" + "00" * 7) == abort(0x05040001)


def test_a_slow_client_is_not_given_up(wire, bare) -> None:
    bare.ask("4008100000000000")
    for toggle in (0x60, 0x70, 0x60):
        assert wire.wait(0.9) == []
        assert bare.ask(f"{toggle:02x}" + "00" * 7)[0][0] in "01"
    assert wire.wait(10.0) == []


def test_an_abort_of_the_client_ends_the_transfer_without_an_answer(wire, bare) -> None:
    bare.ask(BLOCK_WRITE)
    assert bare.ask("8000200000000405") == []
    assert bare.ask("4000100000000000") == ["4300100092010200"]
    assert wire.wait(10.0) == []


@pytest.mark.parametrize("length", range(8))
def test_a_frame_that_has_not_eight_bytes_is_no_sdo(wire, length: int) -> None:
    assert wire.send(0x601, bytes.fromhex("4000100000000000")[:length]) == []


def test_an_expedited_download_may_leave_the_size_out(bare) -> None:
    assert bare.ask("22171000fa000000") == ["6017100000000000"]
    assert bare.ask("4017100000000000") == ["4b171000fa000000"]


def test_nodes_have_transfers_of_their_own(wire) -> None:
    for node_id in (1, 2):
        wire.send(0x600 + node_id, bytes.fromhex("4008100000000000"))
    for toggle in (0x60, 0x70):
        for node_id in (1, 2):
            ((can_id, data),) = wire.send(0x600 + node_id, bytes((toggle,)) + bytes(7))
            assert (can_id, data[0]) == (0x580 + node_id, toggle & 0x10)
