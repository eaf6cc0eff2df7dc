"""Commands to a running emulator: faults come and go while it serves."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.control import ControlServer, command, control_path
from hil.bench.lockstep import LockstepBench
from ident.errors import BusError, UserError


@contextmanager
def polled(server: ControlServer) -> Iterator[None]:
    done = threading.Event()

    def serve() -> None:
        while not done.wait(0.005):
            server.poll()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        server.close()


@pytest.fixture
def tell(tmp_path: Path) -> Iterator[Callable[[str], str]]:
    path = tmp_path / "control"
    with LockstepBench(Flywheels()) as bench, polled(ControlServer(path, bench.faults)):
        yield lambda text: command(path, text)


def test_faults_are_injected_listed_and_ended(tell: Callable[[str], str]) -> None:
    assert tell("list") == "no faults"
    assert tell("add drop@0x181:rate=10%") == "fault 0"
    assert tell("add power@drive_fl:from=1s,to=2s") == "fault 1"
    assert tell("list").splitlines() == [
        "0: drop@0x181:rate=0.1, from 0.000 s to inf s",
        "1: power@drive_fl:from=1.0,to=2.0, from 1.000 s to 2.000 s",
    ]
    assert tell("remove 0") == "fault 0 ended"
    assert tell("list").startswith("1: ")
    assert tell("clear") == "all faults ended"
    assert tell("list") == "no faults"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("dance", "dance"),
        ("add vanish@0x1", "vanish"),
        ("remove all", "number"),
        ("remove 7", "no fault 7"),
        ("", "no command"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_remedy(tell: Callable[[str], str], text: str, named: str) -> None:
    with pytest.raises(UserError) as caught:
        tell(text or " ")
    assert named in caught.value.what
    assert caught.value.remedy


def test_an_emulator_that_is_not_there_is_a_user_error(tmp_path: Path) -> None:
    with pytest.raises(BusError, match="No emulator takes commands"):
        command(tmp_path / "nobody", "list")


def test_the_socket_of_a_dead_emulator_is_replaced_and_that_of_a_closed_one_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "control"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as dead:
        dead.bind(str(path))
    with LockstepBench(Flywheels()) as bench:
        server = ControlServer(path, bench.faults)
        server.close()
    assert not path.exists()


def test_of_two_emulators_that_take_commands_at_one_place_the_first_goes_on(tmp_path: Path) -> None:
    with LockstepBench(Flywheels()) as bench, polled(ControlServer(tmp_path / "control", bench.faults)):
        with pytest.raises(BusError, match="another process serves it"):
            ControlServer(tmp_path / "control", bench.faults)
        assert command(tmp_path / "control", "list") == "no faults"


def test_commands_are_taken_beside_the_bus() -> None:
    assert control_path("unix:/tmp/can0") == Path("/tmp/can0.control")
    with pytest.raises(BusError, match="--control"):
        control_path("socketcan:can0")
    with pytest.raises(BusError, match="No commands can be taken"):
        ControlServer(Path("/nowhere/control"), LockstepBench(Flywheels()).faults)


def test_whoever_is_held_up_after_connecting_is_answered_and_holds_up_nobody(
    tell: Callable[[str], str], tmp_path: Path
) -> None:
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as slow,
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as gone,
    ):
        for client in (slow, gone):
            client.settimeout(5.0)
            client.connect(str(tmp_path / "control"))
        gone.close()
        time.sleep(0.3)
        assert tell("list") == "no faults"
        slow.send(b"list")
        assert slow.recv(1000) == b"ok\nno faults"
