"""`quasiomni can`: the bus from the command line."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from hil.bench.control import ControlServer
from hil.bus.unix import UnixBus, UnixHub
from hil.faults import FaultKind

PATIENCE = 60.0


def quasiomni(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "quasiomni", *(str(argument) for argument in arguments)]


def test_a_network_that_fits_is_listed_with_its_load(quasi: Callable) -> None:
    answer = quasi("can", "load")
    assert answer.code == 0
    assert "49% to 59%" in answer.out
    assert "Every frame is through" in answer.out


def test_a_cycle_that_cannot_work_on_a_real_bus_is_said_to(quasi: Callable) -> None:
    answer = quasi("can", "load", "--cycle", "0.001")
    assert answer.code == 1
    assert "Cannot work on a real bus" in answer.out


class NoFaults:
    """A control socket without an emulator behind it."""

    def add(self, fault: str) -> int:
        raise AssertionError(fault)

    def remove(self, number: int) -> bool:
        return False

    def clear(self) -> None:
        """There are none."""

    def describe(self) -> list[str]:
        return []


def test_who_has_lost_frames_is_listed_while_the_bus_runs(quasi: Callable, tmp_path: Path) -> None:
    path = tmp_path / "bus"
    done = threading.Event()
    with UnixHub(path, room=10) as hub:
        server = ControlServer(Path(f"{path}.control"), NoFaults(), lambda: (*hub.listeners, *hub.departed))

        def serve() -> None:
            while not done.is_set():
                hub.recv(0.005)
                server.poll()

        with UnixBus(path), UnixBus(path) as sleeper:
            while hub.clients < 2:
                hub.recv(0.01)
            for _ in range(5000):
                hub.send(can.Message(arbitration_id=0x100, is_extended_id=False, data=bytes(8)))
            thread = threading.Thread(target=serve)
            thread.start()
            try:
                lost = hub.listeners[0].dropped
                answer = quasi("can", "load", "--bus", f"unix:{path}")
                sleeper.shutdown()
                while hub.clients == 2:
                    time.sleep(0.01)
                after = quasi("can", "load", "--bus", f"unix:{path}")
            finally:
                done.set()
                thread.join()
                server.close()
    assert lost > 0
    assert answer.code == after.code == 0
    assert answer.out.count(str(lost)) == 2
    assert f"{2 * lost} frames are lost" in answer.out
    assert "has left" in after.out
    assert "has left" not in answer.out
    assert f"{2 * lost} frames are lost" in after.out


def test_every_kind_of_fault_is_listed(quasi: Callable) -> None:
    answer = quasi("can", "kinds")
    assert answer.code == 0
    assert all(kind[:8] in answer.out for kind in FaultKind)


MISTAKES = {
    "no emulator": (("can", "faults", "--bus", "unix:/nowhere/bus"), "No emulator takes commands"),
    "nobody to list": (("can", "load", "--bus", "unix:/nowhere/bus"), "No emulator takes commands"),
    "no place for commands": (("can", "fault", "death", "--bus", "socketcan:can0"), "--control"),
    "another bus": (("can", "exec", "--bus", "socketcan:can0", "--", "true"), "not on this machine"),
    "two buses of one name": (
        ("can", "exec", "--bus", "unix:/a", "--bus", "can0=unix:/b", "--", "true"),
        "called can0",
    ),
    "no such program": (("can", "exec", "--", "no-such-program"), "no-such-program cannot be run"),
    "a vehicle that is none": (("can", "load", "--vehicle", "nix"), "There is no 'nix'"),
    "a file that is none": (("emulate", "--bus", "unix:/tmp/never", "--fault", "bad_day.txt"), "bad_day.txt does not"),
    "a script that is no text": (("emulate", "--bus", "unix:/tmp/never", "--fault", sys.executable), "Line 1"),
    "a place that cannot be written": (
        ("dbc", "--out", "/proc/nowhere/x.dbc"),
        "/proc/nowhere/x.dbc cannot be written: No such file",
    ),
    "a folder that cannot be made": (("eds", "--out", "/proc/x"), "/proc/x/drive.eds cannot be written: No such file"),
    "a fault that is none": (("emulate", "--bus", "unix:/tmp/never", "--fault", "vanish@0x1"), "vanish"),
}


@pytest.mark.parametrize(("arguments", "named"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_two_lines_with_a_remedy(quasi: Callable, arguments: tuple[str, ...], named: str) -> None:
    answer = quasi(*arguments)
    assert answer.code == 2
    assert named in answer.error
    assert "remedy:" in answer.error


def test_a_program_on_a_bus_that_nobody_serves_is_told_so(tmp_path: Path) -> None:
    bus = f"unix:{tmp_path / 'bus'}"
    done = subprocess.run(quasiomni("can", "exec", "--bus", bus, "--", "true"), capture_output=True, text=True)
    assert done.returncode == 0
    assert "Nobody serves" in done.stderr
    assert "quasiomni emulate" in " ".join(done.stderr.split())


NAMES = "import socket; print([name for _, name in socket.if_nameindex() if 'can' in name])"


def test_a_program_finds_as_many_buses_as_it_was_given(tmp_path: Path) -> None:
    buses = [word for name in ("can0", "can7") for word in ("--bus", f"{name}=unix:{tmp_path / name}")]
    command = quasiomni("can", "exec", *buses, "--", sys.executable, "-c", NAMES)
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout == "['can0', 'can7']\n"


def test_an_emulator_takes_faults_from_a_script_and_live_and_candump_sees_them(
    tmp_path: Path, need: Callable[..., str]
) -> None:
    need("candump", "can-utils")
    bus, script = f"unix:{tmp_path / 'bus'}", tmp_path / "faults.txt"
    script.write_text("# nodes that come and go\npower@drive_fl:from=2s,to=2.5s\n")
    serving = quasiomni("emulate", "--bus", bus, "--fault", script)
    with subprocess.Popen(serving, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as server:
        try:
            deadline = time.monotonic() + PATIENCE
            while not (tmp_path / "bus.control").exists():
                assert server.poll() is None, server.communicate()[0]
                assert time.monotonic() < deadline
                time.sleep(0.05)
            dump = quasiomni("can", "exec", "--bus", bus, "--", "candump", "-n", "1", "-L", "can0,703:7FF")
            with subprocess.Popen(dump, stdout=subprocess.PIPE, text=True) as listener:
                while listener.poll() is None:
                    assert time.monotonic() < deadline
                    told = subprocess.run(
                        quasiomni("can", "fault", "--bus", bus, "power@drive_fr:to=0.1s"),
                        capture_output=True,
                        check=False,
                    )
                    assert told.returncode == 0, told.stderr
                assert listener.stdout is not None
                assert listener.stdout.read().endswith("can0 703#00\n")
        finally:
            server.kill()
