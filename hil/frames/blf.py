"""Fast reader of BLF files that hold nothing but classic CAN frames, as our recorder writes them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from can.io.blf import systemtime_to_timestamp

from hil.frames.table import NOT_DATA, FrameTable

_FILE_HEADER = struct.Struct("<4sLBBBBBBBBQQLL8H8H")
_OBJECT_HEADER = struct.Struct("<4sHHLL")
_CONTAINER_HEADER = struct.Struct("<H6xL4x")
_LOG_CONTAINER = 10
_CAN_MESSAGE = 1
_COMPRESSED = 2
_TEN_MICROSECONDS = 1

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

_REMOTE_FLAG = 0x80
_EXTENDED_FLAG = 1 << 31


def read_blf(path: Path) -> tuple[FrameTable, bool] | None:
    """Frames of a BLF file and whether the file is whole; None if it holds other objects than classic frames.

    Raises:
        ValueError: it is not a BLF file.
    """
    content = path.read_bytes()
    if len(content) < _FILE_HEADER.size or content[:4] != b"LOGG":
        raise ValueError("no BLF header")
    header = _FILE_HEADER.unpack_from(content)
    payload, whole = _unpack_containers(memoryview(content)[header[1] :])
    count = len(payload) // _FRAME.itemsize
    frames = np.frombuffer(payload, _FRAME, count)
    plain = (frames["signature"] == b"LOBJ") & (frames["object_size"] == _FRAME.itemsize)
    plain &= (frames["object_type"] == _CAN_MESSAGE) & (frames["header_version"] == 1)
    if not plain.all() or not count:
        return None
    # The writer completes the header when it closes the file: without that the end of the log is missing.
    whole = whole and header[12] == count and len(payload) == count * _FRAME.itemsize
    return _to_table(frames, systemtime_to_timestamp(header[14:22])), whole


def _unpack_containers(content: memoryview) -> tuple[bytes, bool]:
    parts, position = [], 0
    while position + _OBJECT_HEADER.size + _CONTAINER_HEADER.size <= len(content):
        signature, header_size, _, size, kind = _OBJECT_HEADER.unpack_from(content, position)
        if signature != b"LOBJ" or kind != _LOG_CONTAINER:
            raise ValueError("no log container where one should be")
        if position + size > len(content):
            break
        method, _ = _CONTAINER_HEADER.unpack_from(content, position + header_size)
        body = content[position + header_size + _CONTAINER_HEADER.size : position + size]
        parts.append(zlib.decompress(body) if method == _COMPRESSED else bytes(body))
        position += size + size % 4
    return b"".join(parts), position >= len(content)


def _to_table(frames: np.ndarray[tuple[int], np.dtype[np.void]], start: float) -> FrameTable:
    unit = np.where(frames["time_unit"] == _TEN_MICROSECONDS, 1e-5, 1e-9)
    remote = (frames["flags"] & _REMOTE_FLAG) != 0
    extended = (frames["can_id"] & _EXTENDED_FLAG) != 0
    return FrameTable(
        time=frames["time"] * unit + start,
        # Remote and extended frames carry nothing that is decoded here: keep them out of every identifier.
        can_id=np.where(remote | extended, NOT_DATA, frames["can_id"]).astype(np.uint32),
        length=frames["length"].copy(),
        data=frames["data"].copy(),
    )
