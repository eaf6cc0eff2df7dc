"""The object dictionary of one node, made from its EDS file; every service reads and writes this one."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import lru_cache, partial
from io import StringIO
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable
from canopen.objectdictionary.eds import import_eds
from durand.datatypes import DatatypeEnum
from durand.object_dictionary import ObjectDictionary, Record, Variable
from durand.services.sdo.server import SDODomainAbort


class AbortCode(IntEnum):
    """SDO abort codes of CiA 301, table 22, as far as our own checks use them."""

    UNSUPPORTED_ACCESS = 0x06010000
    SUBINDEX_ZERO_NOT_ZERO = 0x06010003
    OBJECT_MISSING = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH_EXCEEDED = 0x06040042
    PARAMETER_INCOMPATIBLE = 0x06040043
    SUBINDEX_MISSING = 0x06090011
    VALUE_RANGE_EXCEEDED = 0x06090030
    VALUE_TOO_HIGH = 0x06090031
    VALUE_TOO_LOW = 0x06090032
    DEVICE_STATE = 0x08000022


class AbortError(Exception):
    """A write is refused with an SDO abort code."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(code.name)
        self.code = code


STRUCT_CODES = {
    DatatypeEnum.INTEGER8: "b",
    DatatypeEnum.UNSIGNED8: "B",
    DatatypeEnum.INTEGER16: "h",
    DatatypeEnum.UNSIGNED16: "H",
    DatatypeEnum.INTEGER32: "i",
    DatatypeEnum.UNSIGNED32: "I",
}
"""Data types that a PDO can carry -> `struct` code."""

_ACCESS = {"rww": "rw", "rwr": "rw"}
"""CiA 306 access types with a PDO direction in them -> what SDO may do."""


@lru_cache(maxsize=64)
def _parse(content: str, node_id: int) -> canopen.ObjectDictionary:
    # Parsing takes longer than everything else at the start of a node, and the result is only read.
    parsed: canopen.ObjectDictionary = import_eds(StringIO(content), node_id)  # type: ignore[no-untyped-call]
    return parsed


class _EdsRecord(Record):  # type: ignore[misc]  # durand carries no types
    """A record or array whose sub-index 0 is an entry of the EDS like any other (writable in PDO mappings)."""

    def __getitem__(self, subindex: int) -> Any:
        return self._variables[subindex]

    def __iter__(self) -> Any:
        return iter(sorted(self._variables.items()))

    def __len__(self) -> int:
        return len(self._variables)

    def __contains__(self, subindex: object) -> bool:
        return subindex in self._variables


class Dictionary(ObjectDictionary):  # type: ignore[misc]  # durand carries no types
    """Object dictionary with live values, refusals by abort code, and restore of defaults.

    Args:
        eds: EDS file (CiA 306).
        node_id: replaces $NODEID in it.

    Raises:
        OSError: the file cannot be read.
    """

    def __init__(self, eds: Path, node_id: int) -> None:
        super().__init__()
        self.mappable: set[tuple[int, int]] = set()
        self._pdo_writers: dict[tuple[int, int], Callable[[int], None]] = {}
        for item in _parse(eds.read_text(encoding="utf-8"), node_id).values():
            # Indices below 20h are the dummy types of the EDS, not objects of the device.
            if item.index >= 0x20:
                self[item.index] = self._convert(item)

    def _convert(self, item: ODVariable | ODRecord | ODArray) -> Any:
        if isinstance(item, ODVariable):
            return self._variable(item)
        record = _EdsRecord(item.name)
        for subindex, variable in item.subindices.items():
            record[subindex] = self._variable(variable)
        return record

    def _variable(self, item: ODVariable) -> Any:
        if item.pdo_mappable:
            self.mappable.add((item.index, item.subindex))
        default = item.default
        return Variable(
            DatatypeEnum(item.data_type),
            _ACCESS.get(item.access_type, item.access_type),
            value=default.encode() if isinstance(default, str) else default,
            minimum=item.min,
            maximum=item.max,
            name=item.name,
        )

    def set(self, index: int, subindex: int, value: int) -> None:
        """Change a value from inside the device: no access check, no reaction."""
        self._data[index, subindex] = value

    def value(self, index: int, subindex: int = 0) -> int:
        """The value that an SDO read would give."""
        return int(self.read(index, subindex))

    def on_read(self, index: int, subindex: int, read: Callable[[], int]) -> None:
        """Let `read` give the value of an object."""
        self.set_read_callback(index, subindex, read)

    def on_write(self, index: int, subindex: int, write: Callable[[int], None]) -> None:
        """Call `write` with a value before it is stored; it may refuse by raising `AbortError`."""

        def guarded(value: int) -> None:
            try:
                write(value)
            except AbortError as refusal:
                raise SDODomainAbort(refusal.code, (index, subindex)) from refusal

        self.validate_callbacks[index, subindex].add(guarded)

    def on_pdo_write(self, index: int, subindex: int, write: Callable[[int], None]) -> None:
        """Let an RPDO write this object through `write` instead of the way an SDO goes."""
        self._pdo_writers[index, subindex] = write

    def reader(self, index: int, subindex: int) -> Callable[[], int]:
        """A function that reads the object, for a TPDO."""
        return self._read_callbacks.get((index, subindex)) or partial(self.read, index, subindex)

    def writer(self, index: int, subindex: int) -> Callable[[int], None]:
        """A function that writes the object, for an RPDO; a refused value leaves it unchanged."""
        return self._pdo_writers.get((index, subindex)) or partial(self._write_checked, index, subindex)

    def _write_checked(self, index: int, subindex: int, value: int) -> None:
        variable = self.lookup(index, subindex)
        if variable.minimum <= value <= variable.maximum:
            try:
                self.write(index, subindex, value, downloaded=True)
            except SDODomainAbort:
                # A PDO has no way to answer (CiA 301): the object keeps its value.
                return

    def restore(self, first: int = 0x1000, last: int = 0xFFFF) -> None:
        """Forget every value written to the objects from `first` to `last`: the EDS defaults hold again."""
        for key in [key for key in self._data if first <= key[0] <= last]:
            del self._data[key]
