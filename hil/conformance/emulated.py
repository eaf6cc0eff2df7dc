"""The conformance trace against an emulated drive in this process, on flywheels: only the protocol is of interest."""

from __future__ import annotations

from pathlib import Path

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.conformance.cases import STAND_INS
from hil.conformance.replay import NODE_ID, Replay
from hil.conformance.report import Verdict, run_cases
from hil.conformance.trace import read_trace


def replay_trace(trace: Path) -> list[Verdict]:
    """Replay all cases against node 4, a drive of the default network.

    Raises:
        DataFileError: the trace cannot be read.
    """
    cases = read_trace(trace)
    with LockstepBench(Flywheels()) as bench:
        objects = {(index, subindex) for index, subindex, _ in bench.devices.nodes[NODE_ID].object_dictionary.entries()}
        return run_cases(cases, Replay(bench.bus, bench.clock, objects, STAND_INS))
