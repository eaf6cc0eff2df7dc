"""PDO parameters with live mapping by SDO (CiA 301, 7.5.2.35 to 7.5.2.38): what may be written, and when."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from emulator.firmware.dictionary import STRUCT_CODES, AbortCode, AbortError, Dictionary

INVALID = 1 << 31
"""Bit of a PDO COB-ID: the PDO does not exist."""

MAX_ENTRIES = 8

SYNCHRONOUS_MAX = 240
EVENT_DRIVEN = (254, 255)

_DUMMIES = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I"}
"""Data types that an RPDO may map to skip bytes (CiA 301, 7.4.8.2), by their index."""

_RESTRICTED = (
    (0x000, 0x000),
    (0x001, 0x07F),
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x6FF),
    (0x701, 0x7FF),
)
"""CAN identifiers that no PDO may use (CiA 301, table 40)."""


@dataclass(frozen=True)
class PdoIndices:
    """Where the parameters of one PDO are in the object dictionary."""

    communication: int
    mapping: int


class PdoParameters(ABC):
    """Communication and mapping parameters of one PDO, guarded as CiA 301 demands.

    Args:
        dictionary: the object dictionary of the node.
        indices: where the parameters are.
        changed: called when something was written that alters the behaviour of the PDO.
    """

    receives = False

    def __init__(self, dictionary: Dictionary, indices: PdoIndices, changed: Callable[[], None]) -> None:
        self._dictionary = dictionary
        self._indices = indices
        self._changed = changed
        self.stale = True
        self.cob_id = INVALID
        self.transmission_type = 255
        self.entries: tuple[int, ...] = ()
        dictionary.on_write(indices.communication, 1, self._write_cob_id)
        dictionary.on_write(indices.communication, 2, self._write_transmission_type)
        dictionary.on_write(indices.mapping, 0, self._write_count)
        for subindex in range(1, MAX_ENTRIES + 1):
            dictionary.on_write(indices.mapping, subindex, self._write_entry)

    @property
    def valid(self) -> bool:
        """The PDO exists and carries something."""
        return not self.cob_id & INVALID and bool(self.entries)

    @property
    def can_id(self) -> int:
        """CAN identifier of the PDO."""
        return self.cob_id & 0x7FF

    @property
    def synchronous(self) -> bool:
        """The PDO goes with the SYNC."""
        return self.transmission_type <= SYNCHRONOUS_MAX

    def load(self) -> None:
        """Take everything from the dictionary, as after a reset."""
        read = self._dictionary.value
        self.cob_id = read(self._indices.communication, 1)
        self.transmission_type = read(self._indices.communication, 2)
        self.entries = self._stored(read(self._indices.mapping, 0))

    def codes(self) -> str:
        """`struct` format of the PDO."""
        return "<" + "".join(self._code(entry) for entry in self.entries)

    def keys(self) -> list[tuple[int, int]]:
        """(index, sub-index) of the mapped objects in their order."""
        return [(entry >> 16, entry >> 8 & 0xFF) for entry in self.entries]

    def compile_if_stale(self) -> None:
        """Bind the mapped objects anew when something was written since the last time."""
        if self.stale:
            self.stale = False
            self.compile()

    @abstractmethod
    def compile(self) -> None:
        """Bind the mapped objects."""

    def _alter(self) -> None:
        self.stale = True
        self._changed()

    def _stored(self, count: int) -> tuple[int, ...]:
        return tuple(self._dictionary.value(self._indices.mapping, k) for k in range(1, count + 1))

    def _write_cob_id(self, value: int) -> None:
        identifier = value & 0x3FFFFFFF
        if identifier > 0x7FF or any(low <= identifier <= high for low, high in _RESTRICTED):
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        if not (self.cob_id | value) & INVALID and identifier != self.can_id:
            # The identifier of an existing PDO must not change: it has to be made invalid first.
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self.cob_id = value
        self._alter()

    def _write_transmission_type(self, value: int) -> None:
        if value > SYNCHRONOUS_MAX and value not in EVENT_DRIVEN:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self.transmission_type = value
        self._alter()

    def _write_count(self, count: int) -> None:
        self._refuse_while_valid()
        if count > MAX_ENTRIES:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)
        entries = self._stored(count)
        for entry in entries:
            self._check_mappable(entry)
        if sum(entry & 0xFF for entry in entries) > 64:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)
        self.entries = entries
        self._alter()

    def _write_entry(self, entry: int) -> None:
        self._refuse_while_valid()
        if self._dictionary.value(self._indices.mapping, 0):
            raise AbortError(AbortCode.SUBINDEX_ZERO_NOT_ZERO)
        if entry:
            self._check_mappable(entry)

    def _refuse_while_valid(self) -> None:
        if not self.cob_id & INVALID:
            raise AbortError(AbortCode.DEVICE_STATE)

    def _check_mappable(self, entry: int) -> None:
        code = self._code(entry)
        if struct.calcsize(code) * 8 != entry & 0xFF:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)

    def _code(self, entry: int) -> str:
        index, subindex = entry >> 16, entry >> 8 & 0xFF
        if self.receives and index in _DUMMIES and subindex == 0:
            return _DUMMIES[index]
        try:
            variable = self._dictionary.lookup(index, subindex)
        except KeyError as error:
            raise AbortError(AbortCode.OBJECT_MISSING) from error
        allowed = variable.writable if self.receives else variable.readable
        if (index, subindex) not in self._dictionary.mappable or not allowed:
            raise AbortError(AbortCode.NOT_MAPPABLE)
        return STRUCT_CODES[variable.datatype]


class Rpdo(PdoParameters):
    """A receive PDO: applied at once, or kept until the next SYNC."""

    receives = True

    def __init__(
        self,
        dictionary: Dictionary,
        indices: PdoIndices,
        changed: Callable[[], None],
        applied: Callable[[], None],
        wrong_length: Callable[[bool], None],
    ) -> None:
        super().__init__(dictionary, indices, changed)
        self._applied = applied
        self._wrong_length = wrong_length
        self._struct = struct.Struct("<")
        self._writers: Sequence[Callable[[int], None]] = ()
        self._waiting: bytes | None = None

    def compile(self) -> None:
        """Bind the mapped objects; what waits for a SYNC is dropped."""
        self._struct = struct.Struct(self.codes())
        self._writers = [self._dictionary.writer(*key) if key[0] not in _DUMMIES else _skip for key in self.keys()]
        self._waiting = None

    def receive(self, _can_id: int, data: bytes) -> None:
        """Take the PDO from the bus; one that is too short is not processed (CiA 301, 7.2.2.5)."""
        size = self._struct.size
        if len(data) != size:
            self._wrong_length(len(data) > size)
            if len(data) < size:
                return
            data = data[:size]
        if self.synchronous:
            self._waiting = data
        else:
            self._apply(data)

    def sync(self) -> None:
        """Apply what has come since the last SYNC."""
        if self._waiting is not None:
            data, self._waiting = self._waiting, None
            self._apply(data)

    def _apply(self, data: bytes) -> None:
        for write, value in zip(self._writers, self._struct.unpack(data), strict=True):
            write(value)
        # Only when the whole PDO is in place does the device act on it (a controlword on the new target).
        self._applied()


class Tpdo(PdoParameters):
    """A transmit PDO, sent with every n-th SYNC, with the SYNC after an event, or on the event."""

    def __init__(self, dictionary: Dictionary, indices: PdoIndices, changed: Callable[[], None]) -> None:
        super().__init__(dictionary, indices, changed)
        dictionary.on_write(indices.communication, 3, self._write_inhibit_time)
        dictionary.on_write(indices.communication, 5, self._write_event_timer)
        self.inhibit_time = 0.0
        self.event_timer = 0.0
        self._struct = struct.Struct("<")
        self._readers: Sequence[Callable[[], int]] = ()
        self._syncs = 0
        self.event_pending = False

    def load(self) -> None:
        """Take everything from the dictionary, as after a reset."""
        super().load()
        self.inhibit_time = self._dictionary.value(self._indices.communication, 3) * 1e-4
        self.event_timer = self._dictionary.value(self._indices.communication, 5) * 1e-3

    def compile(self) -> None:
        """Bind the mapped objects and start counting SYNCs."""
        self._struct = struct.Struct(self.codes())
        self._readers = [self._dictionary.reader(*key) for key in self.keys()]
        self._syncs = 0
        self.event_pending = True

    def data(self) -> bytes:
        """The PDO with the values of this instant."""
        return self._struct.pack(*[read() for read in self._readers])

    def due_at_sync(self) -> bool:
        """Count a SYNC; True when the PDO goes out with it."""
        if self.transmission_type == 0:
            due, self.event_pending = self.event_pending, False
            return due
        self._syncs += 1
        if self._syncs < self.transmission_type:
            return False
        self._syncs = 0
        return True

    def _write_inhibit_time(self, value: int) -> None:
        self._refuse_while_valid()
        self.inhibit_time = value * 1e-4

    def _write_event_timer(self, value: int) -> None:
        self.event_timer = value * 1e-3
        self._alter()


def _skip(_value: int) -> None:
    """Dummy mapping: the bytes are ignored."""
