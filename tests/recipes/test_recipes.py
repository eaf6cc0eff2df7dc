"""The recipes in docs/recipes do what they say: files and commands are taken out of the pages and run in order."""

from __future__ import annotations

import configparser
import contextlib
import os
import re
import shlex
import shutil
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.bus.socketcan.library import compilers
from hil.master.drive_states import decode_state
from hil.network import DRIVES, load_network
from hil.network.cia import DriveState

PAGES = Path(__file__).parents[2] / "docs" / "recipes"
BUS = "/tmp/can0"
"""Where the pages serve; a test has a path of its own in its place, so that it disturbs nobody."""
PATIENCE = 150.0
LELY = "## With Lely's master"


@dataclass(frozen=True)
class Recipe:
    """A part of a page: files by name, the commands as one script, and the output that it shows."""

    files: dict[str, str]
    script: str
    shown: list[str]


def recipe(text: str) -> Recipe:
    """Blocks that begin with a comment of a file's name are files, `sh` is run, those without a language are output."""
    files, script, shown = {}, [], []
    for language, code in re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        named = re.match(r"# ([\w.]+\.\w+)\n", code)
        if named is not None:
            files[named[1]] = code
        elif language == "sh":
            script.append(code)
        elif not language:
            shown += code.splitlines()
    return Recipe(files, "".join(script), shown)


@pytest.fixture
def environ(tmp_path: Path) -> dict[str, str]:
    """In which `quasiomni`, `python` and the tools beside it are those of these tests."""
    (programs := tmp_path / "bin").mkdir()
    for name, command in (("quasiomni", "-m quasiomni"), ("python", "")):
        (program := programs / name).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {command} "$@"\n')
        program.chmod(0o755)
    path = [str(programs), os.environ["PATH"], str(Path(sys.executable).parent)]
    return {**os.environ, "PATH": os.pathsep.join(path), "PYTHONUNBUFFERED": "1"}


@pytest.fixture
def run(tmp_path: Path, environ: dict[str, str]) -> Iterator[Callable[[Recipe], list[str]]]:
    """Runs a recipe in an empty folder and gives the lines of its output; what it leaves running is ended."""
    (work := tmp_path / "work").mkdir()
    started: list[subprocess.Popen[str]] = []

    def follow(followed: Recipe) -> list[str]:
        for name, content in followed.files.items():
            (work / name).write_text(content)
        script = followed.script.replace(BUS, str(tmp_path / "can0"))
        process = subprocess.Popen(
            ["bash", "-euo", "pipefail", "-c", script],
            cwd=work,
            env=environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        output, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, output + "".join(log.read_text() for log in work.glob("*.log"))
        return output.splitlines()

    yield follow
    for process in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def needs_compiler() -> None:
    """Unmodified programs need a library that is built here."""
    if not compilers():
        (pytest.fail if os.environ.get("QUASIOMNI_CI") else pytest.skip)("there is no C compiler")


@pytest.mark.parametrize("page", ["python_canopen.md", "plc.md"])
def test_a_master_does_what_its_page_says(page: str, run: Callable[[Recipe], list[str]]) -> None:
    needs_compiler()
    followed = recipe((PAGES / page).read_text())
    assert len(followed.shown) >= 6
    said = run(followed)
    assert [line for line in said if line in followed.shown] == followed.shown


def test_every_page_is_listed_and_run() -> None:
    pages = {path.name for path in PAGES.glob("*.md")} - {"README.md"}
    assert pages == {"python_canopen.md", "plc.md", "ros2_canopen.md"}
    listed = re.findall(r"\]\((\w+\.md)\)", (PAGES / "README.md").read_text())
    assert set(listed) == pages


def configured(run: Callable[[Recipe], list[str]], folder: Path) -> configparser.ConfigParser:
    """What dcfgen makes of the page of ros2_canopen: `master.dcf`."""
    before = (PAGES / "ros2_canopen.md").read_text().split(LELY)[0]
    followed = recipe(before)
    assert run(followed)[-len(followed.shown) :] == followed.shown, "dcfgen has warnings"
    dcf = configparser.ConfigParser(interpolation=None, strict=False)
    dcf.read(folder / "master.dcf")
    return dcf


class Booting:
    """A master that boots as CiA 302-2 says, by nothing but what dcfgen has written."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def send(self, can_id: int, data: bytes = b"") -> None:
        self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def request(self, node: int, data: bytes) -> bytes:
        """Answer of an SDO server."""
        self.send(0x600 + node, data)
        while True:
            message = self._bus.recv(0.3)
            assert message is not None, f"node {node} does not answer"
            if message.arbitration_id == 0x580 + node:
                return bytes(message.data)

    def upload(self, node: int, index: int, subindex: int = 0) -> int:
        answer = self.request(node, struct.pack("<BHB4x", 0x40, index, subindex))
        return int(struct.unpack_from("<I", answer, 4)[0])

    def configure(self, node: int, concise: bytes) -> int:
        """Downloads a concise DCF: a count, and index, sub-index, size and data of each value; gives the count."""
        (count,), position = struct.unpack_from("<I", concise), 4
        for _ in range(count):
            index, subindex, size = struct.unpack_from("<HBI", concise, position)
            data = concise[position + 7 : position + 7 + size]
            answer = self.request(node, struct.pack("<BHB4s", 0x23 | 4 - size << 2, index, subindex, data))
            assert answer[:4] == struct.pack("<BHB", 0x60, index, subindex), f"{index:04X}h:{subindex}: {answer.hex()}"
            position += 7 + size
        assert position == len(concise)
        return int(count)


def test_what_dcfgen_makes_of_the_page_boots_enables_and_drives_the_nodes(
    run: Callable[[Recipe], list[str]], tmp_path: Path
) -> None:
    dcf = configured(run, tmp_path / "work")
    network = load_network()
    with LockstepBench(Flywheels()) as bench:
        master = Booting(bench.bus)
        master.send(0x000, bytes((0x82, 0)))
        for node in network.nodes:
            expected = [int(dcf[f"{index}Value"][str(node.node_id)], 0) for index in ("1F84", "1F85", "1F86")]
            found = [master.upload(node.node_id, *place) for place in ((0x1000, 0), (0x1018, 1), (0x1018, 2))]
            assert found == expected
            assert master.configure(node.node_id, (tmp_path / "work" / f"{node.role}.bin").read_bytes()) > 5
            master.send(0x000, bytes((0x01, node.node_id)))
        for controlword, torque in ((0x06, 0), (0x07, 0), (0x0F, 0), (0x0F, 200)):
            for cycle in range(100):
                if cycle % 10 == 0:
                    master.send(0x77F, b"\x05")
                for role in DRIVES:
                    master.send(0x200 + network.node(role).node_id, struct.pack("<HBh", controlword, 4, torque))
                master.send(0x080)
        sampled = {can_id: data for can_id, data in heard(bench.bus) if 0x180 < can_id < 0x300}
    drives = [network.node(role).node_id for role in DRIVES]
    assert {can_id: len(data) for can_id, data in sampled.items()} == {
        **{0x180 + node: 5 for node in drives},
        **{0x280 + node: 8 for node in drives},
        0x185: 4,
        0x186: 4,
    }
    for node in drives:
        statusword, mode, given = struct.unpack("<HBh", sampled[0x180 + node])
        assert decode_state(statusword) is DriveState.OPERATION_ENABLED
        assert mode == 4
        assert given == pytest.approx(200, abs=40)


def heard(bus: can.BusABC) -> Iterator[tuple[int, bytes]]:
    """Identifier and data of all frames that have come."""
    while (message := bus.recv(0.0)) is not None:
        yield message.arbitration_id, bytes(message.data)


def test_lelys_master_boots_and_enables_the_nodes_by_the_same_files(
    run: Callable[[Recipe], list[str]], tmp_path: Path
) -> None:
    if shutil.which("coctl") is None:
        pytest.skip("coctl of lely-core is not installed: neither Debian nor PyPI has it")
    configured(run, tmp_path / "work")
    followed = recipe((PAGES / "ros2_canopen.md").read_text().split(LELY)[1])
    said = run(followed)
    assert [line for line in followed.shown if line not in said] == []
