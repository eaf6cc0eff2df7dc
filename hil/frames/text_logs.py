"""Readers of text logs, candump's and ASC: every line is a frame, another known thing, or an error with its number.

python-can's readers pass over lines that do not parse, and take an odd number of hexadecimal digits for a payload; in a
log that was damaged both give wrong values without a sign.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from hil.frames.table import NOT_DATA, FrameTable
from hil.network.cia import HIGHEST_CAN_ID
from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, read_bounded

_CANDUMP: Final = re.compile(
    r"\((?P<time>\d+\.\d+)\) +\S+ +(?P<id>[0-9A-F]{8}|[0-9A-F]{3})#"
    r"(?:(?P<remote>R[0-8]?)|(?P<fd>#[0-9A-F]+)|(?P<data>(?:[0-9A-F]{2}){0,8})(?:_[9A-F])?)(?: +[RT])?",
    re.ASCII | re.IGNORECASE,
)
_ASC_FRAME: Final = re.compile(
    r"(?P<time>\d+\.\d+) +\d+ +(?P<id>[0-9A-F]+)(?P<extended>x?) +(?:Rx|Tx) +"
    r"(?:(?P<remote>r)\b.*|d +(?P<length>[0-9A-F]+)(?P<data>(?: +[0-9A-F]+)*?)(?: +[A-Za-z]+ *=.*)?)",
    re.ASCII | re.IGNORECASE,
)
_ASC_OTHER: Final = re.compile(
    r"//.*|date .*|base .*|(no +)?internal events logged.*|begin +triggerblock.*|end +triggerblock.*"
    r"|(?P<error>(?P<time>\d+\.\d+) +(\d+ +ErrorFrame|CANFD +).*)|\d+\.\d+ +(\d+ +)?[A-Z].*",
    re.ASCII | re.IGNORECASE,
)
_ASC_BASE: Final = re.compile(r"base +(?P<base>hex|dec)(?: +timestamps +(?P<stamps>\w+))?", re.ASCII | re.IGNORECASE)
_ASC_END: Final = re.compile(r"end +triggerblock", re.ASCII | re.IGNORECASE)

_Frame = tuple[float, int, bytes]
"""Stamp [s], identifier, data."""


def read_candump(path: Path) -> tuple[FrameTable, str]:
    """Frames of a log of `candump -L`, and why it is not whole; that is empty where it is, or where nothing tells.

    Raises:
        ValueError: a line is none of such a log; says which.
        RecordError: it is larger than what is read.
    """
    lines, cut = _lines(path)
    return _to_table([_candump_frame(number, line) for number, line in lines]), cut


def read_asc(path: Path) -> tuple[FrameTable, str]:
    """Frames of an ASC log, and why it is not whole; that is empty where it is.

    Raises:
        ValueError: a line is none of such a log, or its stamps are relative to each other.
        RecordError: it is larger than what is read.
    """
    lines, cut = _lines(path)
    last = lines[-1][1] if lines else ""
    if not cut and not _ASC_END.match(last):
        cut = "the end of its trigger block is missing"
    return _to_table(list(_asc_frames(lines))), cut


def _lines(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Numbered lines that are not empty; a last line without an end is left out, and said."""
    content = read_bounded(path, LARGEST_RECORD, RecordError)
    whole = content.endswith(b"\n")
    text = content.decode("utf-8-sig")
    lines = [(number, stripped) for number, line in enumerate(text.split("\n"), 1) if (stripped := line.strip())]
    if whole or not lines:
        return lines, ""
    return lines[:-1], f"line {lines[-1][0]} is cut off"


def _candump_frame(number: int, line: str) -> _Frame:
    found = _CANDUMP.fullmatch(line)
    if found is None:
        raise ValueError(f"line {number} is no frame: {line[:60]!r}")
    # Eight digits are those of an extended identifier, or of an error frame.
    plain = len(found["id"]) == 3 and found["data"] is not None
    can_id = int(found["id"], 16) if plain else NOT_DATA
    return float(found["time"]), can_id, bytes.fromhex(found["data"] or "") if plain else b""


def _asc_frames(lines: list[tuple[int, str]]) -> Iterator[_Frame]:
    base = 16
    for number, line in lines:
        found = _ASC_FRAME.fullmatch(line)
        if found is not None:
            yield _asc_frame(number, found, base)
            continue
        other = _ASC_OTHER.fullmatch(line)
        if other is None:
            raise ValueError(f"line {number} is no line of an ASC log: {line[:60]!r}")
        if other["error"]:
            yield float(other["time"]), NOT_DATA, b""
        base = _asc_base(line, base)


def _asc_base(line: str, base: int) -> int:
    header = _ASC_BASE.match(line)
    if header is None:
        return base
    if (header["stamps"] or "absolute").lower() != "absolute":
        raise ValueError("its stamps count from the line before; export it with absolute ones")
    return 16 if header["base"].lower() == "hex" else 10


def _asc_frame(number: int, found: re.Match[str], base: int) -> _Frame:
    time, can_id = float(found["time"]), int(found["id"], base)
    if found["extended"] or found["remote"]:
        return time, NOT_DATA, b""
    values = [int(value, base) for value in found["data"].split()]
    length = int(found["length"], 16)
    if len(values) != min(length, 8) or any(value > 0xFF for value in values) or can_id > HIGHEST_CAN_ID:
        raise ValueError(f"line {number} is no frame of {length} bytes: {found.string[:60]!r}")
    return time, can_id, bytes(values)


def _to_table(frames: list[_Frame]) -> FrameTable:
    payload = b"".join(data.ljust(8, b"\x00") for _, _, data in frames)
    return FrameTable(
        time=np.array([time for time, _, _ in frames], dtype=np.float64),
        can_id=np.array([can_id for _, can_id, _ in frames], dtype=np.uint32),
        length=np.array([len(data) for _, _, data in frames], dtype=np.uint8),
        data=np.frombuffer(payload, dtype=np.uint8).reshape(-1, 8),
    )
