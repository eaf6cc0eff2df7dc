"""The trace of a run of CiA's conformance tool: test cases, and the frames of each.

The format is that of the report in CANopenDemo (Apache-2.0), lines like
`Test CAN	: CAN1  604 Tx SD  8  40 00 10 00 00 00 00 00`: identifier, direction as the tool sees it, length, data.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from ident.errors import DataFileError
from ident.reading import read_bounded

_CASE = re.compile(r"### Test case : (?P<number>\d+\.\d+)\s+-\s+Test name : (?P<name>.*?) #+")
_FRAME = re.compile(
    r"^Test CAN\s*:\s*CAN1\s+(?P<id>[0-9A-F]{3}) (?P<way>Tx|Rx) S(?P<kind>[DR])\s+\d+ ?(?P<data>[0-9A-F ]*)$"
)
_PREPARATION = "### Prepare DUT"
_TOOL_MARK = 0x7FF
"""The tool marks begin and end of a case with frames of this identifier."""


class Way(Enum):
    """Direction of a frame, as the tool sees it."""

    TO_NODE = "Tx"
    FROM_NODE = "Rx"


@dataclass(frozen=True)
class TracedFrame:
    """One frame of the trace."""

    can_id: int
    way: Way
    remote: bool
    data: bytes


@dataclass(frozen=True)
class Case:
    """One test case.

    Attributes:
        number: as the tool counts, for example `2.16`.
        name: of the tool.
        purpose: what the tool says it does.
        verdict: of the tool about the device of the trace.
        preparation: frames between the case before and this one.
        frames: the frames of the case.
        abort_codes: SDO abort codes that the tool accepts, where it says so.
    """

    number: str
    name: str
    purpose: str
    verdict: str
    preparation: tuple[TracedFrame, ...]
    frames: tuple[TracedFrame, ...]
    abort_codes: frozenset[int]


def read_trace(path: Path) -> tuple[Case, ...]:
    """The test cases of a trace, in their order.

    Raises:
        DataFileError: the file cannot be read, or holds no test case.
    """
    lines = read_bounded(path).decode(errors="replace").splitlines()
    starts = [k for k, line in enumerate(lines) if _CASE.search(line)]
    if not starts:
        raise DataFileError(f"{path} holds no test case.", "Give the trace of a conformance test.")
    ends = [_end(lines, start, stop) for start, stop in zip(starts, [*starts[1:], len(lines)], strict=True)]
    return tuple(
        _case(lines[start:end], lines[before:start])
        for before, start, end in zip([0, *ends[:-1]], starts, ends, strict=True)
    )


def _end(lines: list[str], start: int, stop: int) -> int:
    return next((k for k in range(start, stop) if _PREPARATION in lines[k]), stop)


def _case(lines: list[str], before: list[str]) -> Case:
    head = _CASE.search(lines[0])
    name = "" if head is None else head["name"]
    verdicts = [
        line.rsplit(":", 1)[1].strip() for line in lines if re.search(rf": {name}: (Passed|Failed|Skipped)", line)
    ]
    purpose = lines[1].partition(":")[2].strip() if len(lines) > 1 else ""
    return Case(
        number="" if head is None else head["number"],
        name=name,
        purpose=purpose,
        verdict=verdicts[-1].lower() if verdicts else "none",
        preparation=_frames(before),
        frames=_frames(lines),
        abort_codes=_abort_codes(lines),
    )


def _frames(lines: list[str]) -> tuple[TracedFrame, ...]:
    matches = (_FRAME.match(line.rstrip()) for line in lines)
    frames = (
        TracedFrame(int(match["id"], 16), Way(match["way"]), match["kind"] == "R", bytes.fromhex(match["data"]))
        for match in matches
        if match is not None
    )
    return tuple(frame for frame in frames if frame.can_id != _TOOL_MARK)


def _abort_codes(lines: list[str]) -> frozenset[int]:
    announced = [line for line in lines if re.search(r"[Vv]alid abort code|Allowing error code", line)]
    return frozenset(int(code, 16) for line in announced for code in re.findall(r"\b(?:0x)?([0-9A-F]{8})h?\b", line))
