"""Reader of BLF files: every object is walked, so that a log which was cut or damaged is known as such.

The format is Vector's; facts after python-can's `can.io.blf`, which reads the same files. That reader passes over what
it cannot parse, an end that is missing included, and never looks at the counts in the header: ADR 28.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from can.io.blf import systemtime_to_timestamp
from numpy.typing import NDArray

from hil.frames.table import NOT_DATA, FrameTable
from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, read_bounded

_FILE_HEADER = struct.Struct("<4sLBBBBBBBBQQLL8H8H")
_OBJECT_HEADER = struct.Struct("<4sHHLL")
_CONTAINER_HEADER = struct.Struct("<H6xL4x")
_LOG_CONTAINER = 10
_CAN_MESSAGE = 1
_CAN_MESSAGE_2 = 86
_OTHER_FRAMES = (2, 73, 100, 101)
"""Error frames, plain and extended, and both kinds of CAN FD frames."""
_RESTORE_POINTS = 115
"""An index of the file that its header does not count."""
_BODIES: Final = {1: 32, 2: 40}
"""Where the frame begins in an object, by the version of the object's header."""
_STORED, _DEFLATED = 0, 2
_TEN_MICROSECONDS, _NANOSECONDS = 1, 2

_FRAME = np.dtype(
    [
        ("signature", "S4"),
        ("header_size", "<u2"),
        ("header_version", "<u2"),
        ("object_size", "<u4"),
        ("object_type", "<u4"),
        ("time_unit", "<u4"),
        ("client", "<u2"),
        ("object_version", "<u2"),
        ("time", "<u8"),
        ("channel", "<u2"),
        ("flags", "u1"),
        ("length", "u1"),
        ("can_id", "<u4"),
        ("data", "u1", 8),
    ]
)
"""A CAN_MESSAGE object with a version 1 header: 48 bytes, never padded."""
_HEAD = 32
"""Bytes of it before the frame."""

_REMOTE_FLAG = 0x80
_EXTENDED_FLAG = 1 << 31

_Frames = np.ndarray[tuple[int], np.dtype[Any]]


@dataclass(frozen=True)
class _Objects:
    """What the unpacked content of a file holds: frames, how many objects in all, and whether the last one is whole."""

    frames: _Frames
    count: int
    whole: bool


def read_blf(path: Path) -> tuple[FrameTable, str]:
    """Frames of a BLF file, and why it is not whole; that is empty where it is.

    Raises:
        ValueError: it is no BLF file, or damaged; says at which byte.
        RecordError: it is larger than what is read, as it is or unpacked.
    """
    content = read_bounded(path, LARGEST_RECORD, RecordError)
    if len(content) < _FILE_HEADER.size or content[:4] != b"LOGG":
        raise ValueError("no BLF header")
    header = _FILE_HEADER.unpack_from(content)
    payload, whole = _unpack_containers(content, header[1], path)
    objects = _plain_objects(payload) or _mixed_objects(payload)
    size, count = header[10], header[12]
    cut = "its last object is cut off" if not (whole and objects.whole) else ""
    # The writer completes the header when it closes the file: without that the end of the log is missing.
    if not cut and size != len(content):
        cut = f"its header tells of {size} bytes, and it has {len(content)}"
    if not cut and count != objects.count:
        cut = f"its header tells of {count} objects, and {objects.count} are there"
    return _to_table(objects.frames, systemtime_to_timestamp(header[14:22])), cut


def _unpack_containers(content: bytes, position: int, path: Path) -> tuple[bytes, bool]:
    parts, total = [], 0
    if position < _FILE_HEADER.size:
        raise ValueError(f"a file header of {position} bytes")
    while position + _OBJECT_HEADER.size + _CONTAINER_HEADER.size <= len(content):
        signature, header_size, _, size, kind = _OBJECT_HEADER.unpack_from(content, position)
        if signature != b"LOBJ" or kind != _LOG_CONTAINER:
            raise ValueError(f"no log container at byte {position}, where one should be")
        if header_size < _OBJECT_HEADER.size or size < header_size + _CONTAINER_HEADER.size:
            raise ValueError(f"a log container of {size} bytes at byte {position}, less than its own header")
        if position + size > len(content):
            break
        method, unpacked = _CONTAINER_HEADER.unpack_from(content, position + header_size)
        total += unpacked
        if total > LARGEST_RECORD:
            raise RecordError(
                f"{path} unpacks to more than {LARGEST_RECORD} bytes, at byte {position}.", "Split the log."
            )
        body = memoryview(content)[position + header_size + _CONTAINER_HEADER.size : position + size]
        parts.append(_unpacked(body, method, unpacked, position))
        position += size + size % 4
    return b"".join(parts), position >= len(content)


def _unpacked(body: memoryview, method: int, size: int, position: int) -> bytes:
    """The content of a container, which must be of the size that it states; no more than that is ever unpacked."""
    if method not in (_STORED, _DEFLATED):
        raise ValueError(f"the log container at byte {position} is packed by the unknown method {method}")
    if method == _STORED:
        content, ended = bytes(body), True
    else:
        unpacker = zlib.decompressobj()
        try:
            content = unpacker.decompress(body, size + 1)
        except zlib.error as error:
            raise ValueError(f"the log container at byte {position} cannot be unpacked: {error}") from error
        ended = unpacker.eof
    if not ended or len(content) != size:
        raise ValueError(f"the log container at byte {position} does not unpack to the {size} bytes that it states")
    return content


def _plain_objects(payload: bytes) -> _Objects | None:
    """All objects at once where there are but classic frames, None elsewhere."""
    count = len(payload) // _FRAME.itemsize
    frames = np.frombuffer(payload, _FRAME, count)
    plain = (frames["signature"] == b"LOBJ") & (frames["object_size"] == _FRAME.itemsize)
    plain &= (frames["object_type"] == _CAN_MESSAGE) & (frames["header_version"] == 1)
    if not plain.all():
        return None
    _refuse_odd_units(frames)
    return _Objects(frames, count, len(payload) == count * _FRAME.itemsize)


def _mixed_objects(payload: bytes) -> _Objects:
    """Objects one after the other; error frames and FD frames become frames without data."""
    position, count, heads, bodies = 0, 0, [], []
    while (found := _next_object(payload, position)) is not None:
        position, version, size, kind = found
        if position + size > len(payload):
            break
        count += kind != _RESTORE_POINTS
        if kind in (_CAN_MESSAGE, _CAN_MESSAGE_2, *_OTHER_FRAMES):
            if version not in _BODIES or size < _BODIES[version] + _FRAME.itemsize - _HEAD:
                raise ValueError(f"an odd frame at byte {position} of its unpacked content")
            heads.append(position)
            bodies.append(position + _BODIES[version])
        position += size
    frames = _gathered(payload, np.array(heads, dtype=np.intp), np.array(bodies, dtype=np.intp))
    _refuse_odd_units(frames)
    return _Objects(frames, count, found is None)


def _next_object(payload: bytes, position: int) -> tuple[int, int, int, int] | None:
    """Where the next object begins, its header's version, size and type; None at the end."""
    # Objects are padded by up to their size modulo 4; how far depends on the kind and on who wrote them.
    start = payload.find(b"LOBJ", position, position + 8)
    if start < 0:
        if len(payload) - position < 4 and not any(payload[position:]):
            return None
        raise ValueError(f"no object at byte {position} of its unpacked content, where one should be")
    if start + _OBJECT_HEADER.size > len(payload):
        return start, 0, _OBJECT_HEADER.size, 0
    _, header_size, version, size, kind = _OBJECT_HEADER.unpack_from(payload, start)
    if size < max(header_size, _OBJECT_HEADER.size):
        raise ValueError(f"an object of {size} bytes at byte {start} of its unpacked content")
    return start, version, size, kind


def _gathered(payload: bytes, heads: NDArray[np.intp], bodies: NDArray[np.intp]) -> _Frames:
    raw = np.frombuffer(payload, np.uint8)
    packed = np.concatenate(
        [
            raw[heads[:, None] + np.arange(_HEAD)],
            raw[bodies[:, None] + np.arange(_FRAME.itemsize - _HEAD)],
        ],
        axis=1,
    )
    return np.ascontiguousarray(packed).view(_FRAME).reshape(len(heads))


def _refuse_odd_units(frames: _Frames) -> None:
    odd = np.flatnonzero((frames["time_unit"] != _TEN_MICROSECONDS) & (frames["time_unit"] != _NANOSECONDS))
    if len(odd):
        raise ValueError(f"the stamp of frame {odd[0]} has the unknown unit {frames['time_unit'][odd[0]]}")


def _to_table(frames: _Frames, start: float) -> FrameTable:
    unit = np.where(frames["time_unit"] == _TEN_MICROSECONDS, 1e-5, 1e-9)
    classic = (frames["object_type"] == _CAN_MESSAGE) | (frames["object_type"] == _CAN_MESSAGE_2)
    remote = (frames["flags"] & _REMOTE_FLAG) != 0
    extended = (frames["can_id"] & _EXTENDED_FLAG) != 0
    return FrameTable(
        time=frames["time"] * unit + start,
        # Remote and extended frames carry nothing that is decoded here: keep them out of every identifier.
        can_id=np.where(remote | extended | ~classic, NOT_DATA, frames["can_id"]).astype(np.uint32),
        length=frames["length"].copy(),
        data=frames["data"].copy(),
    )
