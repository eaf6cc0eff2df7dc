"""What README and docs/bench.md print about the emulator works as printed, in an empty folder, in the order printed."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PATIENCE = 90.0
BUS = Path("/tmp/can0")
"""Where the printed commands serve."""

LASTING = ("quasiomni emulate", "quasiomni can exec")
"""What goes on in a terminal of its own."""


def section(page: str, heading: str) -> str:
    """The text under a heading of a page."""
    text = (ROOT / page).read_text()
    found = re.search(rf"^##+ {re.escape(heading)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    assert found is not None, f"{page} has no {heading!r}"
    return found[1]


def blocks(text: str, language: str = "") -> list[str]:
    """Code blocks of a language."""
    return [
        code for found, code in re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL) if found == language
    ]


def served() -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        return probe.connect_ex(str(BUS)) == 0


class Terminals:
    """A shell in a folder; commands that last run beside those that come after them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "bin").mkdir()
        program = folder / "bin" / "quasiomni"
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m quasiomni "$@"\n')
        program.chmod(0o755)
        self.environ = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}"}
        self.lasting: list[tuple[str, subprocess.Popen[bytes]]] = []
        self.work = folder / "work"
        self.work.mkdir()

    def run(self, line: str) -> tuple[int, str]:
        """Exit code and output; 0 and nothing for what lasts."""
        if line.startswith(LASTING):
            self._start(line)
            return 0, ""
        done = subprocess.run(
            line,
            shell=True,
            cwd=self.work,
            env=self.environ,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        return done.returncode, done.stdout + done.stderr

    def output(self, line: str) -> str:
        """What a command that lasts has printed."""
        return (self.folder / f"{[name for name, _ in self.lasting].index(line)}.txt").read_text()

    def _start(self, line: str) -> None:
        log = self.folder / f"{len(self.lasting)}.txt"
        with log.open("wb") as output:
            process = subprocess.Popen(
                f"exec stdbuf -oL {line}",
                shell=True,
                cwd=self.work,
                env=self.environ,
                stdout=output,
                stderr=subprocess.STDOUT,
                # Whoever runs the tests in the background has them ignore what a terminal sends.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
        self.lasting.append((line, process))
        deadline = time.monotonic() + PATIENCE
        while line.startswith("quasiomni emulate") and " is up on " not in log.read_text():
            if process.poll() is not None:
                return
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.05)

    def close(self) -> None:
        for _, process in reversed(self.lasting):
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGINT)
            process.wait(PATIENCE)


@pytest.fixture
def terminals(tmp_path: Path) -> Iterator[Terminals]:
    if served():
        pytest.skip(f"{BUS} is served by another program")
    opened = Terminals(tmp_path)
    yield opened
    opened.close()


def commands(block: str) -> list[str]:
    return [line for line in block.splitlines() if line.strip()]


def test_the_first_test_of_the_bench_passes_as_printed(tmp_path: Path) -> None:
    (page,) = blocks(section("docs/bench.md", "A test"), "python")
    assert page.startswith("import pytest")
    (tmp_path / "test_death.py").write_text(page)
    run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_death.py"]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "1 passed" in done.stdout


def test_the_faults_of_the_bench_are_injected_as_printed(terminals: Terminals) -> None:
    printed = [line for block in blocks(section("docs/bench.md", "Faults")) for line in commands(block)]
    assert any("can fault" in line for line in printed)
    answers = {line: terminals.run(line) for line in printed}
    assert {line: code for line, (code, _) in answers.items()} == dict.fromkeys(printed, 0), answers
    serving = next(line for line in printed if "emulate" in line)
    assert "is up on unix:/tmp/can0" in terminals.output(serving)


def test_the_emulator_of_the_readme_serves_and_takes_faults_as_printed(
    terminals: Terminals, need: Callable[..., str]
) -> None:
    need("candump", "can-utils")
    printed = commands(blocks(section("README.md", "Test your own master against the emulated vehicle"))[0])
    fault = next(line for line in printed if "can fault" in line)
    for line in printed[: printed.index(fault) + 1]:
        code, answer = terminals.run(line)
        assert code == 0, answer
    for line in printed[printed.index(fault) + 1 :]:
        # No kernel of CI has the interface of the example; the other commands need none.
        if "vcan" not in line:
            assert terminals.run(line)[0] == 0
    assert {path.name for path in terminals.work.iterdir()} == {"eds", "vehicle.dbc"}
    listener = next(line for line in printed if "candump" in line)
    deadline = time.monotonic() + PATIENCE
    while not re.search(r"701 +\[1\] +00", terminals.output(listener)):
        assert time.monotonic() < deadline, "the drive whose power came back has said that it boots"
        time.sleep(0.1)
