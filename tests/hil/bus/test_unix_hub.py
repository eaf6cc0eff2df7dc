"""What clients of a hub ask for, and get: filters, error frames, own frames, bursts."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.bus.frame_kinds import ERROR_FRAME, EXTENDED, REMOTE
from hil.bus.packets import FRAME, FRAME_SIZE, INVERTED, Hello, pack_frame, unpack_frame, unpack_hello
from hil.bus.unix import UnixBus, UnixHub

WORD = st.integers(0, 2**32 - 1)
FILTERS = st.lists(st.tuples(WORD, WORD), max_size=5)


@given(filters=FILTERS, mask=WORD, flags=st.tuples(*[st.booleans()] * 4))
def test_a_hello_reads_back_as_it_was_said_and_is_never_taken_for_frames(filters, mask, flags) -> None:
    hello = Hello(tuple(filters), mask, *flags)
    packet = hello.pack()
    assert unpack_hello(packet) == hello
    assert len(packet) % FRAME_SIZE != 0


@given(packet=st.binary(max_size=100))
def test_what_is_no_hello_is_not_taken_for_one(packet: bytes) -> None:
    hello = unpack_hello(packet)
    assert hello is None or hello.pack()[:4] == packet[:4]


def kernel_lets_through(can_id: int, filters: list[tuple[int, int]]) -> bool:
    """<linux/can.h>: received_can_id & mask == can_id & mask, inverted where CAN_INV_FILTER is set; any suffices."""
    for wanted, mask in filters:
        same = (can_id & mask) == (wanted & 0xDFFFFFFF & mask)
        if same != bool(wanted & 0x20000000):
            return True
    return False


@given(can_id=st.one_of(st.integers(0, 0x7FF), st.integers(0, 0x1FFFFFFF).map(lambda i: i | EXTENDED)), filters=FILTERS)
def test_filters_let_through_what_the_kernel_would(can_id: int, filters: list[tuple[int, int]]) -> None:
    assert Hello(tuple(filters)).passes(can_id) == kernel_lets_through(can_id, filters)


def test_joined_filters_must_all_agree() -> None:
    both = Hello(((0x180, 0x780), (0x185 | INVERTED, 0x7FF)), join_filters=True)
    assert [can_id for can_id in (0x184, 0x185, 0x186, 0x201) if both.passes(can_id)] == [0x184, 0x186]


def test_error_frames_pass_by_their_class_and_not_by_the_filters() -> None:
    keen = Hello((), error_mask=0x08)
    assert keen.passes(ERROR_FRAME | 0x08)
    assert not keen.passes(ERROR_FRAME | 0x40)
    assert not keen.passes(0x181)


@given(
    can_id=st.integers(0, 0x1FFFFFFF),
    data=st.binary(max_size=8),
    kind=st.sampled_from(["data", "extended", "remote", "error"]),
)
def test_a_frame_reads_back_as_it_was_packed(can_id: int, data: bytes, kind: str) -> None:
    message = can.Message(
        arbitration_id=can_id if kind in ("extended", "error") else can_id & 0x7FF,
        is_extended_id=kind == "extended",
        is_remote_frame=kind == "remote",
        is_error_frame=kind == "error",
        dlc=len(data),
        data=b"" if kind == "remote" else data,
    )
    read = unpack_frame(pack_frame(message), 0.0)
    assert read.equals(message, timestamp_delta=None, check_channel=False)


class Client:
    """A client at the level of packets."""

    def __init__(self, hub: UnixHub, path: Path, hello: Hello) -> None:
        self.hub = hub
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(str(path))
        self.socket.send(hello.pack())
        assert hub.recv(0.0) is None

    def packets(self) -> list[bytes]:
        self.hub.recv(0.0)
        found = []
        self.socket.settimeout(0.05)
        try:
            while True:
                found.append(self.socket.recv(4096))
        except TimeoutError:
            return found


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[UnixHub]:
    with UnixHub(tmp_path / "bus") as hub:
        yield hub


def frames(*can_ids: int) -> list[can.Message]:
    return [can.Message(arbitration_id=can_id, is_extended_id=False) for can_id in can_ids]


def ids(packet: bytes) -> list[int]:
    return [FRAME.unpack_from(packet, begin)[0] for begin in range(0, len(packet), FRAME_SIZE)]


def test_a_burst_comes_in_one_packet_to_those_who_take_it_and_frame_by_frame_to_others(
    hub: UnixHub, tmp_path: Path
) -> None:
    keen, plain = (Client(hub, tmp_path / "bus", Hello(bursts=bursts)) for bursts in (True, False))
    choosy = Client(hub, tmp_path / "bus", Hello(((0x182, 0x7FF),), bursts=True))
    with hub.burst():
        for frame in frames(0x181, 0x182, 0x183):
            hub.send(frame)
        assert keen.packets() == []
    assert [ids(packet) for packet in keen.packets()] == [[0x181, 0x182, 0x183]]
    assert [ids(packet) for packet in plain.packets()] == [[0x181], [0x182], [0x183]]
    assert [ids(packet) for packet in choosy.packets()] == [[0x182]]
    for client in (keen, plain, choosy):
        client.socket.close()


def test_a_long_burst_is_split_and_stays_in_order(hub: UnixHub, tmp_path: Path) -> None:
    with UnixBus(tmp_path / "bus") as bus:
        hub.recv(0.0)
        with hub.burst():
            for can_id in range(200):
                hub.send(frames(can_id)[0])
        assert [bus.recv(1.0).arbitration_id for _ in range(200)] == list(range(200))


def test_own_frames_come_back_marked_to_those_who_asked(hub: UnixHub, tmp_path: Path) -> None:
    proud, modest = (Client(hub, tmp_path / "bus", Hello(own_frames=own)) for own in (True, False))
    for client in (proud, modest):
        client.socket.send(pack_frame(frames(0x123)[0]))
    marks = {client: sorted(FRAME.unpack(packet)[2] for packet in client.packets()) for client in (proud, modest)}
    assert marks == {proud: [0, 1], modest: [0]}
    for client in (proud, modest):
        client.socket.close()


def test_whoever_asks_is_told_that_it_is_heard_of(hub: UnixHub, tmp_path: Path) -> None:
    client = Client(hub, tmp_path / "bus", Hello(acknowledge=True))
    assert client.packets() == [b"QCAN"]
    assert hub.clients == 1
    client.socket.close()
    hub.recv(0.0)
    assert hub.clients == 0


def test_a_client_that_sends_rubbish_is_cut_off_and_the_others_go_on(hub: UnixHub, tmp_path: Path) -> None:
    rude, polite = (Client(hub, tmp_path / "bus", Hello()) for _ in range(2))
    rude.socket.send(b"hello, is there anybody?")
    assert hub.recv(0.0) is None
    assert hub.clients == 1
    hub.send(frames(0x123)[0])
    assert [ids(packet) for packet in polite.packets()] == [[0x123]]
    for client in (rude, polite):
        client.socket.close()


def test_frames_without_messages_are_the_same_frames(hub: UnixHub, tmp_path: Path) -> None:
    with UnixBus(tmp_path / "bus") as bus:
        hub.recv(0.0)
        hub.send_data(0x181, b"\x01\x02")
        received = bus.recv(1.0)
        assert received is not None
        assert (received.arbitration_id, bytes(received.data)) == (0x181, b"\x01\x02")
        bus.send(can.Message(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=1))
        taken = hub.take(1.0)
        assert taken is not None
        assert taken[0] == 0x701 | REMOTE
        assert hub.take(0.0) is None


def test_the_last_frames_of_a_client_that_closes_without_having_read_are_not_lost(hub: UnixHub, tmp_path: Path) -> None:
    hasty = Client(hub, tmp_path / "bus", Hello())
    for number in range(10):
        hub.send(frames(0x100 + number)[0])
    hasty.socket.send(pack_frame(frames(0x555)[0]))
    hasty.socket.close()
    received = hub.recv(1.0)
    assert received is not None
    assert received.arbitration_id == 0x555
    assert hub.recv(0.05) is None
    assert hub.clients == 0
