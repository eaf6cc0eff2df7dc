"""Campaigns as processes: killed and resumed, and on a bus whose other side is another process."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hil.frames.recorder import finished_steps
from ident.records.record import Step

GIVEN_INERTIA = ("--b-w", "0.121", "--b-w-std", "0.001")
TIMEOUT = 180.0

WITHOUT_EMULATOR = """
import sys
import quasiomni
try:
    quasiomni.main()
except SystemExit as leave:
    if leave.code:
        raise
loaded = [name for name in sys.modules if name.split(".")[0] in ("emulator", "pybullet", "durand")]
sys.exit(f"loaded {loaded}" if loaded else 0)
"""


def quasiomni(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "quasiomni", *(str(argument) for argument in arguments)]


def only(*steps: Step) -> list[str]:
    left_out = [step for step in Step if step not in (*steps, Step.ALIGNMENT, Step.LATERAL, Step.WHEEL_LIFTED)]
    return [word for step in left_out for word in ("--skip", str(step))]


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.02)


def names(run: Path) -> list[str]:
    return [step for step, _ in finished_steps(run / "frames") if step != Step.ALIGNMENT]


@contextmanager
def running(command: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_killed_run_keeps_its_finished_steps_and_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "run"
    command = quasiomni("campaign", "--out", out, *GIVEN_INERTIA, *only(Step.STRAIGHT, Step.ROTATION))
    frames = out / "frames"
    with running(command) as process:
        wait_until(lambda: any(frames.glob("*_rotation.part.blf")))
        os.kill(process.pid, signal.SIGKILL)
    assert names(out) == [Step.STRAIGHT]
    (log,) = frames.glob("*_straight.blf")
    kept = hashlib.sha256(log.read_bytes()).hexdigest()

    resumed = subprocess.run([*command, "--resume"], capture_output=True, timeout=TIMEOUT, check=False)

    assert resumed.returncode == 0, resumed.stderr.decode()
    assert names(out) == [Step.STRAIGHT, Step.ROTATION]
    assert hashlib.sha256(log.read_bytes()).hexdigest() == kept
    assert list(frames.glob("*.part.blf")), "what there is of the killed step stays for inspection"


def test_a_campaign_on_a_bus_imports_nothing_of_the_emulator(tmp_path: Path) -> None:
    """The emulator is another process here; on a vehicle there is none. A lane change is the shortest step."""
    bus, out = f"unix:{tmp_path / 'can0'}", tmp_path / "run"
    with running(quasiomni("emulate", "--bus", bus, "--lockstep")) as server:
        wait_until(lambda: (tmp_path / "can0").exists() or server.poll() is not None)
        campaign = subprocess.run(
            [
                *(sys.executable, "-c", WITHOUT_EMULATOR, "campaign", "--bus", bus, "--lockstep", "--yes"),
                *("--out", str(out), *GIVEN_INERTIA, *only(Step.LANE_CHANGE)),
            ],
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
        )
    assert campaign.returncode == 0, campaign.stdout.decode() + campaign.stderr.decode()
    assert names(out) == [Step.LANE_CHANGE]


def test_without_a_yes_nothing_moves(tmp_path: Path) -> None:
    bus, out = f"unix:{tmp_path / 'can0'}", tmp_path / "run"
    with running(quasiomni("emulate", "--bus", bus, "--lockstep")) as server:
        wait_until(lambda: (tmp_path / "can0").exists() or server.poll() is not None)
        campaign = subprocess.run(
            quasiomni("campaign", "--bus", bus, "--lockstep", "--out", out, *GIVEN_INERTIA, *only(Step.ROTATION)),
            input=b"n\n",
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
        )
    assert campaign.returncode == 1
    assert b"Is the floor free" in campaign.stdout
    assert not out.exists()


def test_lifting_the_wheels_needs_a_person(tmp_path: Path) -> None:
    bus, out = f"unix:{tmp_path / 'can0'}", tmp_path / "run"
    with running(quasiomni("emulate", "--bus", bus, "--lockstep")) as server:
        wait_until(lambda: (tmp_path / "can0").exists() or server.poll() is not None)
        campaign = subprocess.run(
            quasiomni("campaign", "--bus", bus, "--lockstep", "--yes", "--out", out),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
        )
    assert campaign.returncode == 2
    assert b"jack-stand" in campaign.stderr
    assert b"Traceback" not in campaign.stderr
