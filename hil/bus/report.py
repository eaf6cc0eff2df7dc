"""What is said of a client of the hub; nothing of the bus itself, so that whoever shows it loads nothing else."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ListenerReport:
    """What became of the frames for one client.

    Attributes:
        pid: its process; 0 where the system does not say.
        program: name of the process, empty where the system does not say.
        waiting: frames that wait in the hub because its socket is full.
        dropped: frames that it has lost because it did not read.
        gone: it has left the bus.
    """

    pid: int
    program: str
    waiting: int
    dropped: int
    gone: bool = False
