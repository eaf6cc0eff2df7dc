"""What a loop that keeps to the clock gets of the kernel, and that it gives it back."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.bus.urgency import Grant, urgent

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the classes of Linux's scheduler")

NOBODY = 65534


def status(name: str) -> str:
    """A line of /proc/self/status."""
    # A user without rights may not read the codec of another encoding.
    lines = Path("/proc/self/status").read_bytes().decode().splitlines()
    return next(line.split(":")[1].strip() for line in lines if line.startswith(f"{name}:"))


@pytest.fixture
def permitted() -> None:
    """Skips where this user may not have what is tested."""
    with urgent() as got:
        if got.priority is not Grant.GIVEN:
            pytest.skip(f"this test runs {got.what}")


def in_a_process(code: str, *before: str) -> list[str]:
    """The words that a program of its own prints, started by the command `before`."""
    head = "import os, resource\nfrom hil.bus.urgency import urgent\nfrom tests.hil.bus.test_urgency import status\n"
    done = subprocess.run(
        [*before, sys.executable, "-c", head + textwrap.dedent(code)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.usefixtures("permitted")
def test_inside_the_loop_goes_first_and_afterwards_it_is_one_of_many() -> None:
    before = os.sched_getscheduler(0), os.sched_getparam(0), os.nice(0)
    with urgent() as got:
        assert os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        assert got.given
        assert (status("VmLck") != "0 kB") == (got.memory is Grant.GIVEN)
    assert (os.sched_getscheduler(0), os.sched_getparam(0), os.nice(0)) == before
    assert status("VmLck") == "0 kB"


@pytest.mark.usefixtures("permitted")
def test_it_is_given_back_when_the_loop_fails() -> None:
    before = os.sched_getscheduler(0)
    with pytest.raises(ZeroDivisionError), urgent():
        _ = 1 / 0
    assert os.sched_getscheduler(0) == before
    assert status("VmLck") == "0 kB"


@pytest.mark.usefixtures("permitted")
def test_what_the_loop_starts_is_not_urgent() -> None:
    of_thread: list[int] = []
    with urgent():
        thread = threading.Thread(target=lambda: of_thread.append(os.sched_getscheduler(0)))
        thread.start()
        thread.join()
        child = subprocess.run(
            [sys.executable, "-c", "import os; print(os.sched_getscheduler(0))"],
            capture_output=True,
            text=True,
            check=True,
        )
    assert of_thread == [os.SCHED_OTHER]
    assert int(child.stdout) == os.SCHED_OTHER


def test_a_loop_that_does_not_want_it_gets_nothing() -> None:
    before = os.sched_getscheduler(0)
    with urgent(wanted=False) as got:
        assert os.sched_getscheduler(0) == before
        assert status("VmLck") == "0 kB"
    assert (got.priority, got.memory) == (Grant.NOT_ASKED, Grant.NOT_ASKED)
    assert got.remedy == ""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody without rights")
def test_without_permission_it_goes_on_and_says_what_to_do() -> None:
    words = in_a_process(f"""
        os.setuid({NOBODY})
        with urgent() as got:
            print(got.priority.name, os.sched_getscheduler(0), status("VmLck").replace(" ", ""), got.remedy)
    """)
    assert words[:3] == ["NOT_PERMITTED", str(os.SCHED_OTHER), "0kB"]
    assert "/etc/security/limits.conf" in words
    assert "chrt" in " ".join(words)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root has rights that can be taken away")
@pytest.mark.usefixtures("permitted")
def test_under_a_limit_no_memory_is_locked_that_could_run_out(need: Callable[..., str]) -> None:
    words = in_a_process(
        """
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (1 << 20, 1 << 20))
        with urgent() as got:
            print(got.priority.name, got.memory.name)
            held = bytearray(1 << 24)
        print(os.sched_getscheduler(0))
        """,
        need("setpriv"),
        "--bounding-set=-ipc_lock",
    )
    assert words == ["GIVEN", "NOT_PERMITTED", str(os.SCHED_OTHER)]


@pytest.mark.usefixtures("permitted")
def test_a_priority_that_is_there_already_stays_as_it_is() -> None:
    words = in_a_process("""
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(7))
        with urgent() as got:
            print(got.priority.name, os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)
        print(os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)
    """)
    assert words == ["THERE_ALREADY", str(os.SCHED_RR), "7", str(os.SCHED_RR), "7"]


def test_on_one_processor_nobody_goes_first() -> None:
    words = in_a_process("""
        os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
        with urgent() as got:
            print(got.priority.name, os.sched_getscheduler(0))
    """)
    assert words == ["ONE_PROCESSOR", str(os.SCHED_OTHER)]
