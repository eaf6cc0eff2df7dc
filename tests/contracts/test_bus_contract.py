"""What every bus must do, whatever it is made of (after python-can's back-to-back test)."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from hil.bus.lockstep import LockstepHub
from hil.bus.unix import UnixBus, UnixHub

Pair = tuple[can.BusABC, can.BusABC]


def lockstep_pair(tmp_path: Path) -> Iterator[Pair]:
    hub = LockstepHub(cycle_period=0.002, bit_rate=1e6)
    yield hub.open(), hub.open()


def unix_pair(tmp_path: Path) -> Iterator[Pair]:
    hub = UnixHub(tmp_path / "bus")
    client = UnixBus(tmp_path / "bus")
    # The hub learns of its client when it looks at its socket.
    assert hub.recv(0.0) is None
    yield hub, client


def unix_clients(tmp_path: Path) -> Iterator[Pair]:
    hub = UnixHub(tmp_path / "bus")
    stop = threading.Event()

    def forward() -> None:
        while not stop.is_set():
            hub.recv(0.01)

    thread = threading.Thread(target=forward)
    thread.start()
    one, two = UnixBus(tmp_path / "bus"), UnixBus(tmp_path / "bus")
    # A frame that has gone around proves that the hub knows both clients.
    while two.recv(0.01) is None:
        one.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
    while two.recv(0.02) is not None:
        pass
    yield one, two
    stop.set()
    thread.join()
    hub.shutdown()


def virtual_pair(tmp_path: Path) -> Iterator[Pair]:
    yield can.Bus(str(tmp_path), interface="virtual"), can.Bus(str(tmp_path), interface="virtual")


PAIRS = {
    "lockstep": lockstep_pair,
    "unix hub and client": unix_pair,
    "unix clients": unix_clients,
    "python-can virtual": virtual_pair,
}


@pytest.fixture(params=PAIRS)
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Pair]:
    made = PAIRS[request.param](tmp_path)
    buses = next(made)
    yield buses
    for bus in buses:
        bus.shutdown()
    assert next(made, None) is None


FRAMES = {
    "SYNC": can.Message(arbitration_id=0x80, is_extended_id=False),
    "eight bytes": can.Message(arbitration_id=0x181, is_extended_id=False, data=bytes(range(8))),
    "highest identifier": can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"\xff"),
    "extended identifier": can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b"\x01\x02"),
    "extended with a small number": can.Message(arbitration_id=0x80, is_extended_id=True, data=b"\x01"),
    "remote": can.Message(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=1),
}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
@pytest.mark.parametrize("backwards", [False, True], ids=["forth", "back"])
def test_a_frame_arrives_as_it_was_sent(pair: Pair, frame: can.Message, backwards: bool) -> None:
    sender, receiver = reversed(pair) if backwards else pair
    sender.send(frame)
    received = receiver.recv(1.0)
    assert received is not None
    assert received.equals(frame, timestamp_delta=None, check_channel=False, check_direction=False)


def test_nobody_hears_himself(pair: Pair) -> None:
    one, _ = pair
    one.send(FRAMES["eight bytes"])
    assert one.recv(0.0) is None


def test_frames_keep_their_order_and_none_is_lost(pair: Pair) -> None:
    one, two = pair
    for number in range(500):
        one.send(can.Message(arbitration_id=0x100, is_extended_id=False, data=number.to_bytes(2, "little")))
    received = [message.data for _ in range(500) if (message := two.recv(1.0)) is not None]
    assert received == [number.to_bytes(2, "little") for number in range(500)]


def test_what_the_sender_does_to_its_message_afterwards_does_not_change_what_was_sent(pair: Pair) -> None:
    one, two = pair
    message = can.Message(arbitration_id=0x201, is_extended_id=False, data=bytearray(b"\x0f\x00"))
    one.send(message)
    message.data[0] = 0
    received = two.recv(1.0)
    assert received is not None
    assert bytes(received.data) == b"\x0f\x00"


def test_stamps_do_not_run_backwards(pair: Pair) -> None:
    one, two = pair
    for _ in range(20):
        one.send(FRAMES["eight bytes"])
    stamps = [message.timestamp for _ in range(20) if (message := two.recv(1.0)) is not None]
    assert len(stamps) == 20
    assert stamps == sorted(stamps)


def test_filters_let_only_their_frames_through(pair: Pair) -> None:
    one, two = pair
    two.set_filters([{"can_id": 0x180, "can_mask": 0x780, "extended": False}])
    for can_id in (0x080, 0x181, 0x201, 0x182):
        one.send(can.Message(arbitration_id=can_id, is_extended_id=False))
    received = [message.arbitration_id for _ in range(2) if (message := two.recv(1.0)) is not None]
    assert received == [0x181, 0x182]


def test_looking_without_waiting_returns_at_once(pair: Pair) -> None:
    start = time.perf_counter()
    assert pair[1].recv(0.0) is None
    assert time.perf_counter() - start < 0.5


def test_a_bus_that_was_shut_down_refuses_to_work(pair: Pair) -> None:
    one, _ = pair
    one.shutdown()
    with pytest.raises((can.CanOperationError, OSError)):
        one.send(FRAMES["SYNC"])
    with pytest.raises((can.CanOperationError, OSError, ValueError)):
        one.recv(0.0)


def test_a_bus_works_as_a_context_manager_and_shuts_down_twice_without_harm(pair: Pair) -> None:
    with pair[0] as bus:
        bus.send(FRAMES["SYNC"])
    bus.shutdown()
