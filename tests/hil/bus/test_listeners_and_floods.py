"""Clients that do not read, or send without end, and those beside them."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from hil.bus.listener import ROOM
from hil.bus.pacing import TURN
from hil.bus.packets import FRAME
from hil.bus.unix import UnixBus, UnixHub

WIRE = 1e6 / 111
"""Frames of 8 bytes a second on a wire of 1 Mbit/s."""


class Clock:
    """Monotonic time that the test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def hub(tmp_path: Path, clock: Clock) -> Iterator[UnixHub]:
    with UnixHub(tmp_path / "bus", room=100, monotonic=clock) as hub:
        yield hub


def join(hub: UnixHub, tmp_path: Path) -> UnixBus:
    known, bus = hub.clients, UnixBus(tmp_path / "bus")
    while hub.clients == known:
        assert hub.recv(0.0) is None
    return bus


def numbered(number: int) -> can.Message:
    return can.Message(arbitration_id=0x100, is_extended_id=False, data=number.to_bytes(4, "little"))


def numbers(bus: UnixBus, hub: UnixHub) -> list[int]:
    """What a client reads until nothing comes any more, the hub flushing what waits."""
    found: list[int] = []
    while True:
        hub.recv(0.0)
        message = bus.recv(0.0)
        if message is None:
            return found
        found.append(int.from_bytes(message.data, "little"))


def test_whoever_does_not_read_loses_its_own_frames_and_nobody_waits(hub: UnixHub, tmp_path: Path) -> None:
    sleeper, reader = join(hub, tmp_path), join(hub, tmp_path)
    longest = 0.0
    for number in range(20_000):
        start = time.perf_counter()
        hub.send(numbered(number))
        longest = max(longest, time.perf_counter() - start)
        received = reader.recv(1.0)
        assert received is not None
        assert int.from_bytes(received.data, "little") == number
    lost, kept = hub.listeners
    assert (kept.dropped, kept.waiting) == (0, 0)
    assert lost.waiting == 100
    read = numbers(sleeper, hub)
    # The first ones were kept, in their order; every other one is counted.
    assert read == list(range(len(read)))
    assert len(read) + lost.dropped == 20_000
    assert longest < 0.5
    sleeper.shutdown()
    reader.shutdown()


def test_a_client_that_reads_again_is_told_how_many_frames_it_has_lost(hub: UnixHub, tmp_path: Path) -> None:
    with join(hub, tmp_path) as bus:
        for number in range(5000):
            hub.send(numbered(number))
        read = numbers(bus, hub)
        assert bus.dropped == 5000 - len(read) > 0
        hub.send(numbered(5000))
        assert numbers(bus, hub) == [5000]
        assert bus.dropped == 5000 - len(read)


def test_a_client_that_has_caught_up_is_told_even_when_nothing_comes_any_more(
    hub: UnixHub, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with join(hub, tmp_path) as bus:
        for number in range(5000):
            hub.send(numbered(number))
        read = numbers(bus, hub)
        assert numbers(bus, hub) == []
        assert bus.dropped == 5000 - len(read) > 0
        assert f"{bus.dropped} frames are lost" in caplog.text
        for number in range(3):
            hub.send(numbered(number))
        assert numbers(bus, hub) == [0, 1, 2]
        assert caplog.text.count("lost") == 1


def test_who_has_lost_frames_and_left_is_remembered(hub: UnixHub, tmp_path: Path) -> None:
    sleeper, reader = join(hub, tmp_path), join(hub, tmp_path)
    for number in range(5000):
        hub.send(numbered(number))
        assert reader.recv(1.0) is not None
    lost = hub.listeners[0]
    sleeper.shutdown()
    reader.shutdown()
    while hub.listeners:
        hub.recv(0.01)
    assert [(one.pid, one.dropped, one.gone) for one in hub.departed] == [(os.getpid(), lost.dropped, True)]
    assert lost.program == Path("/proc/self/comm").read_text().strip()


def test_a_second_of_a_full_bus_waits_for_a_client_that_pauses(tmp_path: Path) -> None:
    with UnixHub(tmp_path / "bus") as hub, join(hub, tmp_path) as bus:
        assert ROOM > 0.9 * WIRE
        for number in range(round(WIRE)):
            hub.send(numbered(number))
        assert numbers(bus, hub) == list(range(round(WIRE)))
        assert bus.dropped == 0


def test_frames_of_a_burst_wait_and_are_dropped_whole(hub: UnixHub, tmp_path: Path) -> None:
    with join(hub, tmp_path) as bus:
        for first in range(0, 200_000, 50):
            with hub.burst():
                for number in range(first, first + 50):
                    hub.send(numbered(number))
        (report,) = hub.listeners
        read = numbers(bus, hub)
        assert report.waiting == 100
        assert len(read) + report.dropped == 200_000
        assert len(read) % 50 == 0


def test_a_client_that_goes_with_frames_waiting_takes_nothing_with_it(hub: UnixHub, tmp_path: Path) -> None:
    bus = join(hub, tmp_path)
    for number in range(5000):
        hub.send(numbered(number))
    bus.send(can.Message(arbitration_id=0x555, is_extended_id=False))
    bus.shutdown()
    hub.send(numbered(0))
    received = hub.recv(1.0)
    assert received is not None
    assert received.arbitration_id == 0x555
    assert hub.recv(0.0) is None
    assert hub.listeners == ()


def flood(bus: UnixBus, frames: int) -> int:
    """Send without waiting; how many frames found room in the socket."""
    bus._socket.setblocking(False)
    for sent in range(frames):
        try:
            bus._socket.send(FRAME.pack(0x7FF, 8, 0, bytes(8)))
        except BlockingIOError:
            return sent
    return frames


def test_a_sync_waits_for_one_turn_of_a_flood_and_no_longer(hub: UnixHub, tmp_path: Path) -> None:
    with join(hub, tmp_path) as noisy, join(hub, tmp_path) as master:
        flood(noisy, 1000)
        master.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        before = 0
        while (message := hub.recv(0.0)) is not None and message.arbitration_id != 0x80:
            before += 1
        assert message is not None
        assert before <= TURN


def test_a_flood_fills_the_socket_of_its_sender_and_not_the_memory_of_the_hub(hub: UnixHub, tmp_path: Path) -> None:
    with join(hub, tmp_path) as noisy:
        sent = flood(noisy, 100_000)
        assert sent < 10_000
        hub.recv(0.0)
        assert len(hub._received) < TURN


def served(hub: UnixHub, clock: Clock, noisy: tuple[UnixBus, ...], seconds: float) -> int:
    """Frames that the hub takes from clients that always have more to send."""
    taken, end = 0, clock.now + seconds
    while clock.now < end:
        for bus in noisy:
            flood(bus, 200)
        while hub.recv(0.0) is not None:
            taken += 1
        clock.now += 1e-3
    return taken


@pytest.mark.parametrize("number", [1, 2])
def test_floods_share_the_speed_of_the_wire_until_they_end(
    hub: UnixHub, tmp_path: Path, clock: Clock, number: int
) -> None:
    noisy = tuple(join(hub, tmp_path) for _ in range(number))
    served(hub, clock, noisy, 0.15)
    assert served(hub, clock, noisy, 0.5) == pytest.approx(0.5 * WIRE, rel=0.15)
    quiet_since = clock.now
    while clock.now < quiet_since + 0.1:
        clock.now += 2e-3
        if hub.recv(0.0) is not None:
            quiet_since = clock.now
    # What it sends after a tenth of a second is served at once.
    noisy[0].send(numbered(1))
    assert hub.recv(0.0) is not None
    for bus in noisy:
        bus.shutdown()


def test_a_master_that_waits_for_answers_may_be_faster_than_the_wire(
    hub: UnixHub, tmp_path: Path, clock: Clock
) -> None:
    """Five frames and their answer in 0.2 ms, which is three times what a wire carries."""
    waited = 0.0
    with join(hub, tmp_path) as master:
        for cycle in range(6000):
            for number in range(5):
                master.send(numbered(number))
            taken = 0
            while taken < 5:
                if hub.recv(0.0) is None:
                    waited += 1e-4
                    clock.now += 1e-4
                else:
                    taken += 1
            hub.send(numbered(cycle))
            assert master.recv(0.0) is not None
            clock.now += 2e-4
    # Held once a second, for as long as the wire takes for a turn.
    assert 0.0 < waited < 0.005
