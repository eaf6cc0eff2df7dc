"""Frames as messages of an MCAP file: written as they come, read whole or refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self

import can

from ident.errors import RecordError
from ident.records.mcap_channels import own_topic
from ident.records.mcap_file import NANOSECONDS, McapWriter, Topic, read_topics, require_mcap

CAN: Final = "/can"
"""Topic of the frames."""
TITLE: Final = "quasiomni.CanFrame"

_PROPERTIES: Final[Mapping[str, Mapping[str, str]]] = {
    "time": {"type": "number", "unit": "s", "description": "stamp as it was recorded"},
    "id": {"type": "integer", "description": "identifier"},
    "data": {"type": "string", "description": "bytes in hexadecimal"},
    "length": {"type": "integer", "description": "data length code"},
    "extended": {"type": "boolean", "description": "29-bit identifier"},
    "remote": {"type": "boolean"},
    "error": {"type": "boolean"},
    "received": {"type": "boolean", "description": "false where the recording master sent it"},
    "fd": {"type": "boolean", "description": "CAN FD"},
}
FRAMES: Final = Topic(CAN, TITLE, {"type": "object", "properties": dict(_PROPERTIES), "required": list(_PROPERTIES)})
"""The topic of frames."""


class McapFrames:
    """A writer of frames, as those of python-can.

    Args:
        path: to be written.

    Attributes:
        file: that is written.

    Raises:
        RecordError: the package is missing.
    """

    def __init__(self, path: Path) -> None:
        require_mcap(path)
        self.file = path.open("wb")
        self._writer = McapWriter(self.file, FRAMES)

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        self._writer.write(CAN, log_time(msg.timestamp), message_of(msg))

    def stop(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def log_time(stamp: float) -> int:
    """A stamp [s] as MCAP has it [ns]."""
    return max(round(stamp * NANOSECONDS), 0)


def message_of(frame: can.Message) -> dict[str, Any]:
    """A frame as a message."""
    return {
        "time": frame.timestamp,
        "id": frame.arbitration_id,
        "data": bytes(frame.data).hex(" "),
        "length": frame.dlc,
        "extended": frame.is_extended_id,
        "remote": frame.is_remote_frame,
        "error": frame.is_error_frame,
        "received": frame.is_rx,
        "fd": frame.is_fd,
    }


def frame_of(message: Mapping[str, Any]) -> can.Message:
    """The frame of a message.

    Raises:
        ValueError, KeyError: it is none.
    """
    return can.Message(
        timestamp=float(message["time"]),
        arbitration_id=message["id"],
        data=bytes.fromhex(message["data"]),
        dlc=message["length"],
        is_extended_id=message["extended"],
        is_remote_frame=message["remote"],
        is_error_frame=message["error"],
        is_rx=message["received"],
        is_fd=message["fd"],
        check=True,
    )


def read_mcap_frames(path: Path, *, accept_truncated: bool = True) -> tuple[list[can.Message], str]:
    """Frames of an MCAP file that was written here, and why it is not whole; that is empty where it is.

    Raises:
        ValueError: it is no MCAP file, or damaged; or another error of a parser.
        RecordError: it is somebody else's, or larger than what is read.
    """
    topics, cut = read_topics(path, accept_truncated=accept_truncated)
    if cut and CAN not in topics:
        return [], cut
    content = own_topic(path, topics, CAN, TITLE)
    frames = []
    for number, message in enumerate(content.messages):
        try:
            frames.append(frame_of(message))
        except (LookupError, TypeError, ValueError) as error:
            raise RecordError(f"{path}: message {number} of {CAN} is no frame: {error}.", "Export it again.") from error
    return frames, cut
