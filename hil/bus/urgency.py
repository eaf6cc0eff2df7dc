"""Gives a loop that keeps to the clock precedence over other programs, where that is permitted, and takes it back.

Linux alone. With SCHED_FIFO a thread that wants to run takes the processor from whatever has no such class (sched(7)),
and memory that is locked is not taken away meanwhile (mlockall(2)).
"""

from __future__ import annotations

import ctypes
import enum
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

if sys.platform == "linux":
    import resource

PRIORITY: Final = 49
"""Among 1 ... 99: below the threads of interrupts, which bring the frames and have 50 on a kernel of PREEMPT_RT."""

_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4
"""Of mlockall (asm-generic/mman.h): what there is, what will be, and each page only once it has been touched."""

_MAY_LOCK: Final = 1 << 14
"""CAP_IPC_LOCK (linux/capability.h)."""


class Grant(enum.Enum):
    """What became of a wish."""

    GIVEN = enum.auto()
    THERE_ALREADY = enum.auto()
    NOT_ASKED = enum.auto()
    NOT_PERMITTED = enum.auto()
    ONE_PROCESSOR = enum.auto()
    NOT_HERE = enum.auto()


@dataclass(frozen=True)
class Urgency:
    """What a loop got.

    Attributes:
        priority: SCHED_FIFO.
        memory: locked.
    """

    priority: Grant
    memory: Grant

    @property
    def given(self) -> bool:
        """The loop has precedence, by this or by whoever started the program."""
        return self.priority in (Grant.GIVEN, Grant.THERE_ALREADY)

    @property
    def what(self) -> str:
        """In words that follow a comma."""
        memory = ", memory locked" if self.memory in (Grant.GIVEN, Grant.THERE_ALREADY) else ""
        return _WORDS[self.priority] + memory

    @property
    def remedy(self) -> str:
        """What to do about what was not permitted; empty where there is nothing to be done."""
        return _REMEDY if self.priority is Grant.NOT_PERMITTED else ""


NOT_ASKED: Final = Urgency(Grant.NOT_ASKED, Grant.NOT_ASKED)
_WORDS: Final[Mapping[Grant, str]] = MappingProxyType(
    {
        Grant.GIVEN: f"with real-time priority (SCHED_FIFO {PRIORITY})",
        Grant.THERE_ALREADY: "with the real-time priority that it was started with",
        Grant.NOT_ASKED: "without real-time priority",
        Grant.NOT_PERMITTED: "without real-time priority, which is not permitted here (`ulimit -r`)",
        Grant.ONE_PROCESSOR: "without real-time priority, for there is one processor and others need it too",
        Grant.NOT_HERE: f"without real-time priority, which this program does not know of on {sys.platform}",
    }
)
_REMEDY: Final = (
    "Lines `USER - rtprio 49` and `USER - memlock unlimited` in /etc/security/limits.conf permit it from the next "
    "login on (a container: --cap-add SYS_NICE --ulimit memlock=-1); `sudo chrt -R -f -p 49 PID` gives it to what runs."
)


@contextmanager
def urgent(wanted: bool = True) -> Iterator[Urgency]:
    """Inside, the calling thread goes before other programs, and the memory of its process stays where it is.

    Threads and processes that are started inside are as urgent as any other. Afterwards everything is as it was; only
    that what is started by this thread inherits no urgency remains, where the kernel lets nobody but root undo it.

    Args:
        wanted: False for a loop that does not keep to the clock, such as one in lockstep.
    """
    if not wanted:
        yield NOT_ASKED
        return
    if sys.platform != "linux":
        yield Urgency(Grant.NOT_HERE, Grant.NOT_ASKED)
        return
    if len(os.sched_getaffinity(0)) < 2:
        yield Urgency(Grant.ONE_PROCESSOR, Grant.NOT_ASKED)
        return
    with _first_in_line() as priority:
        if priority is Grant.NOT_PERMITTED:
            yield Urgency(priority, Grant.NOT_ASKED)
            return
        with _locked_memory() as memory:
            yield Urgency(priority, memory)


if sys.platform == "linux":

    @contextmanager
    def _first_in_line() -> Iterator[Grant]:
        policy, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
        if policy & ~os.SCHED_RESET_ON_FORK in (os.SCHED_FIFO, os.SCHED_RR):
            yield Grant.THERE_ALREADY
            return
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
        except OSError:
            yield Grant.NOT_PERMITTED
            return
        try:
            yield Grant.GIVEN
        finally:
            try:
                os.sched_setscheduler(0, policy, parameter)
            except PermissionError:
                os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, parameter)

    @contextmanager
    def _locked_memory() -> Iterator[Grant]:
        if _status("VmLck") != "0 kB":
            # Whoever has locked some would find it unlocked afterwards.
            yield Grant.THERE_ALREADY
            return
        unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
        libc = ctypes.CDLL(None, use_errno=True)
        # Under a limit that is not yet reached, it is later allocations that would fail.
        permitted = unlimited or bool(int(_status("CapEff"), 16) & _MAY_LOCK)
        if not permitted or libc.mlockall(_CURRENT | _FUTURE | _ON_FAULT) != 0:
            yield Grant.NOT_PERMITTED
            return
        try:
            yield Grant.GIVEN
        finally:
            libc.munlockall()

    def _status(name: str) -> str:
        """A line of proc(5) status of this process."""
        lines = (line.partition(":") for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines())
        return next(value.strip() for key, _, value in lines if key == name)
