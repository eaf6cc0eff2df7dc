"""PDO parameters with live mapping by SDO (CiA 301, 7.5.2.35 to 7.5.2.38): what may be written, and when."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from emulator.firmware.cob_ids import INVALID, check_change, check_cob_id
from emulator.firmware.dictionary import STRUCT_CODES, AbortCode, AbortError, Dictionary

MAX_ENTRIES = 8

_MAX_BITS = 64

SYNCHRONOUS_MAX = 240
EVENT_DRIVEN = (254, 255)

DUMMIES = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I"}
"""Data types that an RPDO may map to skip bytes (CiA 301, 7.4.8.2), by their index."""


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

    Attributes:
        can_id: CAN identifier of the PDO.
        synchronous: it goes with the SYNC.
    """

    receives = False

    def __init__(self, dictionary: Dictionary, indices: PdoIndices, changed: Callable[[], None]) -> None:
        self._dictionary = dictionary
        self._indices = indices
        self._changed = changed
        self.stale = True
        self._take_cob_id(INVALID)
        self._take_transmission_type(EVENT_DRIVEN[-1])
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

    def load(self) -> None:
        """Take everything from the dictionary, as after a reset."""
        read = self._dictionary.value
        self._take_cob_id(read(self._indices.communication, 1))
        self._take_transmission_type(read(self._indices.communication, 2))
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
        check_cob_id(value)
        check_change(self.cob_id, value)
        self._take_cob_id(value)
        self._alter()

    def _take_cob_id(self, value: int) -> None:
        self.cob_id = value
        self.can_id = value & 0x7FF

    def _take_transmission_type(self, value: int) -> None:
        self.transmission_type = value
        self.synchronous = value <= SYNCHRONOUS_MAX

    def _write_transmission_type(self, value: int) -> None:
        if value > SYNCHRONOUS_MAX and value not in self.acyclic_types():
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._take_transmission_type(value)
        self._alter()

    def acyclic_types(self) -> tuple[int, ...]:
        """Transmission types above 240 that this PDO has now."""
        return EVENT_DRIVEN

    def _write_count(self, count: int) -> None:
        self._refuse_mapping_while_valid()
        if count > MAX_ENTRIES:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)
        entries = self._stored(count)
        for entry in entries:
            self._check_mappable(entry)
        if sum(entry & 0xFF for entry in entries) > _MAX_BITS:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)
        self.entries = entries
        self._alter()

    def _write_entry(self, entry: int) -> None:
        self._refuse_mapping_while_valid()
        if self._dictionary.value(self._indices.mapping, 0):
            # 0601 0003h of CiA 301, 4.2 would say more, but conformance tests expect this code.
            raise AbortError(AbortCode.UNSUPPORTED_ACCESS)
        if entry:
            self._check_mappable(entry)

    def _refuse_mapping_while_valid(self) -> None:
        if not self.cob_id & INVALID:
            raise AbortError(AbortCode.UNSUPPORTED_ACCESS)

    def refuse_while_valid(self) -> None:
        """Refuse what must not be written while the PDO exists.

        Raises:
            AbortError: 0800 0022h.
        """
        if not self.cob_id & INVALID:
            raise AbortError(AbortCode.DEVICE_STATE)

    def _check_mappable(self, entry: int) -> None:
        code = self._code(entry)
        if struct.calcsize(code) * 8 != entry & 0xFF:
            raise AbortError(AbortCode.PDO_LENGTH_EXCEEDED)

    def _code(self, entry: int) -> str:
        index, subindex = entry >> 16, entry >> 8 & 0xFF
        if index in DUMMIES and subindex == 0:
            if not self.receives:
                raise AbortError(AbortCode.NOT_MAPPABLE)
            return DUMMIES[index]
        variable = self._dictionary.find(index, subindex)
        mappable = self._dictionary.receivable if self.receives else self._dictionary.transmittable
        if (index, subindex) not in mappable or variable.datatype not in STRUCT_CODES:
            raise AbortError(AbortCode.NOT_MAPPABLE)
        return STRUCT_CODES[variable.datatype]
