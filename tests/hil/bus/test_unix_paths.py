"""A mistyped path of a socket costs nobody a file."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.control import ControlServer
from hil.bench.lockstep import LockstepBench
from hil.bus.unix import UnixHub
from hil.bus.unix_paths import BoundSocket, listen
from ident.errors import BusError


def _file(path: Path) -> None:
    path.write_text("what I must not forget")


def _folder(path: Path) -> None:
    path.mkdir()


def _link(path: Path) -> None:
    (path.parent / "elsewhere").write_text("mine")
    path.symlink_to(path.parent / "elsewhere")


def _link_to_a_dead_socket(path: Path) -> None:
    _dead(path.parent / "elsewhere")
    path.symlink_to(path.parent / "elsewhere")


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _dead(path: Path, kind: socket.SocketKind = socket.SOCK_SEQPACKET) -> None:
    """What a killed process leaves."""
    with socket.socket(socket.AF_UNIX, kind) as left:
        left.bind(str(path))


OTHERS = [_file, _folder, _link, _link_to_a_dead_socket, _pipe]


def _snapshot(path: Path) -> tuple[int, int, int]:
    found = os.lstat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns


def hub(path: Path) -> None:
    UnixHub(path)


def control(path: Path) -> None:
    with LockstepBench(Flywheels()) as bench:
        ControlServer(path, bench.faults)


@pytest.mark.parametrize("make", OTHERS, ids=lambda make: make.__name__)
@pytest.mark.parametrize("serve", [hub, control], ids=lambda serve: serve.__name__)
def test_what_is_no_socket_stays_as_it_is(tmp_path: Path, make: Callable[[Path], None], serve: Callable) -> None:
    path = tmp_path / "note.txt"
    make(path)
    before = _snapshot(path)
    with pytest.raises((can.CanInitializationError, BusError), match="is there, which is left as it is"):
        serve(path)
    assert _snapshot(path) == before


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_DGRAM, socket.SOCK_SEQPACKET], ids=lambda k: k.name)
def test_a_socket_that_somebody_serves_is_theirs(tmp_path: Path, kind: socket.SocketKind) -> None:
    path = tmp_path / "theirs"
    with socket.socket(socket.AF_UNIX, kind) as theirs:
        theirs.bind(str(path))
        if kind is not socket.SOCK_DGRAM:
            theirs.listen()
        with pytest.raises(OSError, match="another process serves it"):
            listen(path)
        assert path.is_socket()


def test_a_server_too_busy_to_accept_is_no_dead_one(tmp_path: Path) -> None:
    path = tmp_path / "busy"
    busy = listen(path)
    waiting = []
    for _ in range(200):
        client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK)
        waiting.append(client)
        if client.connect_ex(str(path)):
            break
    with pytest.raises(OSError, match="another process serves it"):
        listen(path)
    for client in waiting:
        client.close()
    busy.close()


def test_a_dead_socket_of_ours_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "can0"
    _dead(path)
    served = listen(path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
        client.connect(str(path))
    served.close()
    assert not path.exists()


def test_a_dead_socket_of_another_user_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "can0"
    _dead(path)
    user = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: user)
    with pytest.raises(OSError, match="another user"):
        listen(path)
    assert path.is_socket()


def test_at_the_end_only_what_was_bound_here_goes(tmp_path: Path) -> None:
    path = tmp_path / "can0"
    served = listen(path)
    path.unlink()
    path.write_text("somebody has put this here meanwhile")
    served.close()
    assert path.read_text() == "somebody has put this here meanwhile"


def test_of_many_that_start_at_once_one_serves(tmp_path: Path) -> None:
    path = tmp_path / "can0"
    for _ in range(20):
        _dead(path)
        bound: list[BoundSocket] = []
        refused: list[OSError] = []
        begin = threading.Barrier(8)

        def start(
            begin: threading.Barrier = begin, bound: list[BoundSocket] = bound, refused: list[OSError] = refused
        ) -> None:
            begin.wait()
            try:
                bound.append(listen(path))
            except OSError as error:
                refused.append(error)

        threads = [threading.Thread(target=start) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert (len(bound), len(refused)) == (1, 7)
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
            client.connect(str(path))
        bound[0].close()
