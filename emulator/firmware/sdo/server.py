"""The default SDO server of a node (1200h): one transfer at a time, whatever the client sends."""

from __future__ import annotations

import struct
from collections.abc import Callable

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.sdo.download import BlockDownload, SegmentedDownload
from emulator.firmware.sdo.transfer import FRAME_SIZE, Multiplexor, Send, Target, Transfer, read_object
from emulator.firmware.sdo.upload import BlockUpload, SegmentedUpload
from emulator.firmware.timers import Timers

TIMEOUT = 1.0
"""Time without a frame of the client after which a transfer is given up [s]."""

_ABORT = 0x80
_EXPEDITED = 0x02
_SIZE_INDICATED = 0x01
_BLOCK_SIZE_INDICATED = 0x02
_BLOCK_CHECKED = 0x04
_NOTHING = Multiplexor(0, 0)


class SdoServer:
    """Answers SDO requests from the object dictionary.

    Args:
        dictionary: the object dictionary.
        timers: simulated time.
        send: sends a frame of 8 bytes to the client.
    """

    def __init__(self, dictionary: Dictionary, timers: Timers, send: Send) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._send = send
        self._transfer: Transfer | None = None
        self._deadline = 0.0
        self._watching = False
        self._initiate: dict[int, Callable[[bytes, Multiplexor], Transfer | None]] = {
            1: self._initiate_download,
            2: self._initiate_upload,
            5: self._initiate_block_upload,
            6: self._initiate_block_download,
        }

    def reset(self) -> None:
        """Forget the transfer in progress."""
        self._transfer = None

    def receive(self, _can_id: int, frame: bytes) -> None:
        """Take a frame of the client; one that has not 8 bytes is not an SDO."""
        if len(frame) != FRAME_SIZE:
            return
        if frame[0] == _ABORT:
            self._transfer = None
            return
        try:
            self._take(frame)
        except AbortError as refusal:
            multiplexor = self._transfer.multiplexor if self._transfer is not None else _named(frame)
            self._abort(multiplexor, refusal.code)
        if self._transfer is not None:
            self._watch()

    def _take(self, frame: bytes) -> None:
        transfer = self._transfer
        if transfer is not None and (transfer.takes_all or not _initiates(frame)):
            if transfer.receive(frame):
                self._transfer = None
            return
        # A client that begins anew has given up what it did before.
        self._transfer = None
        if not _initiates(frame):
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        self._transfer = self._initiate[frame[0] >> 5](frame, _multiplexor(frame))

    def _initiate_download(self, frame: bytes, multiplexor: Multiplexor) -> Transfer | None:
        if not frame[0] & _EXPEDITED:
            size = int.from_bytes(frame[4:], "little") if frame[0] & _SIZE_INDICATED else None
            return SegmentedDownload(multiplexor, Target(self._dictionary, multiplexor, size), self._send)
        if frame[0] & _SIZE_INDICATED:
            size = 4 - (frame[0] >> 2 & 0x03)
            target = Target(self._dictionary, multiplexor, size)
        else:
            target = Target(self._dictionary, multiplexor, None)
            size = 4 if target.size is None else target.size
        target.write(frame[4 : 4 + size])
        self._send(multiplexor.frame(0x60))
        return None

    def _initiate_upload(self, _frame: bytes, multiplexor: Multiplexor) -> Transfer | None:
        return self._upload(multiplexor, read_object(self._dictionary, multiplexor))

    def _initiate_block_upload(self, frame: bytes, multiplexor: Multiplexor) -> Transfer | None:
        data = read_object(self._dictionary, multiplexor)
        threshold = frame[5]
        if threshold and len(data) <= threshold:
            # The client prefers the simpler protocol for data as short as this (protocol switch threshold).
            return self._upload(multiplexor, data)
        return BlockUpload(multiplexor, data, frame[4], bool(frame[0] & _BLOCK_CHECKED), self._send)

    def _initiate_block_download(self, frame: bytes, multiplexor: Multiplexor) -> Transfer | None:
        size = int.from_bytes(frame[4:], "little") if frame[0] & _BLOCK_SIZE_INDICATED else None
        target = Target(self._dictionary, multiplexor, size)
        return BlockDownload(multiplexor, target, bool(frame[0] & _BLOCK_CHECKED), self._send)

    def _upload(self, multiplexor: Multiplexor, data: bytes) -> Transfer | None:
        if not 1 <= len(data) <= 4:
            return SegmentedUpload(multiplexor, data, self._send)
        self._send(multiplexor.frame(0x43 | (4 - len(data)) << 2, data))
        return None

    def _abort(self, multiplexor: Multiplexor, code: AbortCode) -> None:
        self._transfer = None
        self._send(multiplexor.frame(_ABORT, struct.pack("<I", code)))

    def _watch(self) -> None:
        # Moving the deadline is cheaper than a new timer for every frame; the timer looks when it is due.
        self._deadline = self._timers.now + TIMEOUT
        if not self._watching:
            self._watching = True
            self._timers.after(TIMEOUT, self._check)

    def _check(self) -> None:
        self._watching = False
        if self._transfer is None:
            return
        remaining = self._deadline - self._timers.now
        if remaining > 1e-9:
            self._watching = True
            self._timers.after(remaining, self._check)
        else:
            self._abort(self._transfer.multiplexor, AbortCode.TIMED_OUT)


_INITIATING = {1: 0x00, 2: 0x00, 5: 0x03, 6: 0x01}
"""Client command specifier that begins a transfer -> the bits of its first byte that have to be zero."""


def _initiates(frame: bytes) -> bool:
    forbidden = _INITIATING.get(frame[0] >> 5)
    return forbidden is not None and not frame[0] & forbidden


def _multiplexor(frame: bytes) -> Multiplexor:
    return Multiplexor(*struct.unpack_from("<HB", frame, 1))


def _named(frame: bytes) -> Multiplexor:
    """What a refused frame was about, as far as it says so."""
    return _multiplexor(frame) if _initiates(frame) or frame[0] >> 5 == 7 else _NOTHING
