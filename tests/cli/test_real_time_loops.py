"""Which commands go before other programs, what they say of it, and what they leave behind to look at."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

from hil.bus.opening import open_bus
from hil.bus.stamps import Moment, read_stamps
from hil.bus.urgency import Grant, urgent
from hil.network import load_network

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the classes of Linux's scheduler")


@contextmanager
def serving(bus: str, *words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """An emulator that is up, and how it said so."""
    command = [sys.executable, "-m", "quasiomni", "emulate", "--bus", bus, *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            line = ""
            while "is up on" not in line:
                line = process.stdout.readline()
                assert line
            yield process, line
        finally:
            process.kill()


def class_of(process: subprocess.Popen[str]) -> int:
    return os.sched_getscheduler(process.pid) & ~os.SCHED_RESET_ON_FORK


def test_in_real_time_the_emulator_goes_first_where_that_is_permitted_and_says_so(tmp_path: Path) -> None:
    with urgent() as possible:
        pass
    with serving(f"unix:{tmp_path / 'bus'}") as (process, line):
        expected = os.SCHED_FIFO if possible.priority is Grant.GIVEN else os.SCHED_OTHER
        assert class_of(process) == expected
        assert possible.what in line


@pytest.mark.parametrize(("option", "said"), [("--lockstep", "in lockstep"), ("--no-priority", "without real-time")])
def test_in_lockstep_and_where_it_is_declined_it_does_not(tmp_path: Path, option: str, said: str) -> None:
    with serving(f"unix:{tmp_path / 'bus'}", option) as (process, line):
        assert class_of(process) == os.SCHED_OTHER
        assert said in line


@pytest.mark.skipif(os.geteuid() != 0, reason="only root has rights that can be taken away")
def test_without_permission_the_emulator_works_and_names_the_remedy(tmp_path: Path, need) -> None:
    words = [need("setpriv"), "--bounding-set=-sys_nice", sys.executable, "-m", "quasiomni"]
    command = [*words, "emulate", "--bus", f"unix:{tmp_path / 'bus'}", "--duration", "0.2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "not permitted here" in done.stdout
    assert "limits.conf" in done.stderr


def test_a_trace_holds_every_sync_and_what_became_of_it(tmp_path: Path) -> None:
    bus, trace = f"unix:{tmp_path / 'bus'}", tmp_path / "trace.csv"
    sync = can.Message(arbitration_id=load_network().sync_cob_id, is_extended_id=False)
    with serving(bus, "--trace", str(trace)) as (process, _):
        with open_bus(bus) as opened:
            before = time.monotonic()
            for _ in range(50):
                opened.send(sync)
                time.sleep(0.002)
            while opened.recv(0.1) is not None:
                continue
            after = time.monotonic()
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60)[0]
    stamped = read_stamps(trace)
    syncs, moved = stamped.where(Moment.SYNC_TAKEN), stamped.where(Moment.MOVED)
    assert len(syncs) == len(moved) == 50
    assert "50 cycles served" in said
    assert (stamped.wall[moved] >= stamped.wall[syncs]).all()
    assert before < stamped.wall[syncs].min()
    assert stamped.wall[syncs].max() < after


def test_a_folder_is_no_place_for_a_trace(tmp_path: Path, quasi) -> None:
    done = quasi("emulate", "--trace", str(tmp_path))
    assert done.code == 2
    assert "is a folder" in done.error
    assert "--real-time" in quasi("doctor", "--trace", str(tmp_path / "late.csv")).error
