"""The object dictionary of one node, made from its EDS file; every service reads and writes this one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
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

from ident.errors import DataFileError
from ident.reading import read_text


class AbortCode(IntEnum):
    """SDO abort codes of CiA 301, table 22, as far as these nodes have a use for them."""

    TOGGLE_BIT = 0x05030000
    TIMED_OUT = 0x05040000
    COMMAND_SPECIFIER = 0x05040001
    BLOCK_SIZE = 0x05040002
    SEQUENCE_NUMBER = 0x05040003
    CHECKSUM = 0x05040004
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    SUBINDEX_ZERO_NOT_ZERO = 0x06010003
    OBJECT_MISSING = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH_EXCEEDED = 0x06040042
    PARAMETER_INCOMPATIBLE = 0x06040043
    LENGTH_MISMATCH = 0x06070010
    TOO_LONG = 0x06070012
    TOO_SHORT = 0x06070013
    SUBINDEX_MISSING = 0x06090011
    VALUE_RANGE_EXCEEDED = 0x06090030
    VALUE_TOO_HIGH = 0x06090031
    VALUE_TOO_LOW = 0x06090032
    CANNOT_STORE = 0x08000020
    DEVICE_STATE = 0x08000022
    NO_DATA = 0x08000024


class AbortError(Exception):
    """An access is refused with an SDO abort code."""

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
    DatatypeEnum.INTEGER64: "q",
    DatatypeEnum.UNSIGNED64: "Q",
    DatatypeEnum.REAL32: "f",
    DatatypeEnum.REAL64: "d",
}
"""Data types that a PDO can carry -> `struct` code."""

STORE_EDS = 0x1021
"""The object in which a device carries its own EDS."""

_ACCESS = {"rww": "rw", "rwr": "rw"}
"""CiA 306 access types with a PDO direction in them -> what SDO may do."""

_RECEIVABLE = ("wo", "rww", "rw")
"""Access types of what an RPDO may carry where PDOMapping is 1: process outputs (CiA 306)."""

_TRANSMITTABLE = ("ro", "const", "rwr", "rw")
"""Access types of what a TPDO may carry where PDOMapping is 1: process inputs (CiA 306)."""


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

    Attributes:
        receivable, transmittable: what an RPDO, a TPDO may carry, as (index, sub-index).

    Raises:
        DataFileError: the file cannot be read, or an object has a data type, access type or limits that cannot be
            emulated.
    """

    def __init__(self, eds: Path, node_id: int) -> None:
        super().__init__()
        self._source = eds
        self.receivable: set[tuple[int, int]] = set()
        self.transmittable: set[tuple[int, int]] = set()
        self._pdo_writers: dict[tuple[int, int], Callable[[int], None]] = {}
        content = read_text(eds)
        for item in _parse(content, node_id).values():
            # Indices below 20h are the dummy types of the EDS, not objects of the device.
            if item.index >= 0x20:
                self[item.index] = self._convert(item)
        if STORE_EDS in self:
            self.on_read(STORE_EDS, 0, content.encode)

    def _convert(self, item: ODVariable | ODRecord | ODArray) -> Any:
        if isinstance(item, ODVariable):
            return self._variable(item)
        record = _EdsRecord(item.name)
        for subindex, variable in item.subindices.items():
            record[subindex] = self._variable(variable)
        return record

    def _variable(self, item: ODVariable) -> Any:
        if item.pdo_mappable:
            for access_types, mappable in ((_RECEIVABLE, self.receivable), (_TRANSMITTABLE, self.transmittable)):
                if item.access_type in access_types:
                    mappable.add((item.index, item.subindex))
        default = item.default
        try:
            return Variable(
                DatatypeEnum(item.data_type),
                _ACCESS.get(item.access_type, item.access_type),
                value=default.encode() if isinstance(default, str) else default,
                minimum=item.min,
                maximum=item.max,
                name=item.name,
            )
        except ValueError as error:
            raise DataFileError(
                f"{self._source}: object {item.index:04X}h:{item.subindex} cannot be emulated, "
                f"data type {item.data_type:04X}h: {error}.",
                "Correct data type, access type and limits in a copy of the EDS, or take the object out.",
            ) from error

    def value(self, index: int, subindex: int = 0, default: int | None = None) -> int:
        """The value that an SDO read would give.

        Args:
            index, subindex: the object.
            default: what an object that the EDS does not have counts as.

        Raises:
            DataFileError: the EDS does not have the object, and the device cannot do without it.
        """
        try:
            return int(self.read(index, subindex))
        except KeyError as error:
            if default is not None:
                return default
            raise DataFileError(
                f"{self._source}: object {index:04X}h:{subindex} is missing, and the emulated device needs it.",
                "Add it to the EDS, or emulate with the EDS files of hil/data.",
            ) from error

    def on_read(self, index: int, subindex: int, read: Callable[[], int | bytes]) -> None:
        """Let `read` give the value of an object."""
        self.set_read_callback(index, subindex, read)

    def on_write(self, index: int, subindex: int, write: Callable[[int], None]) -> None:
        """Call `write` with a value before it is stored; it may refuse by raising `AbortError`."""
        self.validate_callbacks[index, subindex].add(write)

    def on_change(self, index: int, subindex: int, take: Callable[[int], None]) -> None:
        """Call `take` with a value that nobody has refused and that is stored."""
        self.update_callbacks[index, subindex].add(take)

    def on_pdo_write(self, index: int, subindex: int, write: Callable[[int], None]) -> None:
        """Let an RPDO write this object through `write` instead of the way an SDO goes."""
        self._pdo_writers[index, subindex] = write

    def reader(self, index: int, subindex: int) -> Callable[[], int]:
        """A function that reads the object, for a TPDO."""
        return self._read_callbacks.get((index, subindex)) or partial(self.read, index, subindex)

    def writer(self, index: int, subindex: int) -> Callable[[int], None]:
        """A function that writes the object, for an RPDO; a refused value leaves it unchanged."""
        return self._pdo_writers.get((index, subindex)) or partial(self._write_checked, index, subindex)

    def find(self, index: int, subindex: int) -> Variable:
        """The description of an object.

        Raises:
            AbortError: 0602 0000h no such object, 0609 0011h no such sub-index.
        """
        try:
            return self.lookup(index, subindex)
        except KeyError as error:
            missing = AbortCode.SUBINDEX_MISSING if index in self else AbortCode.OBJECT_MISSING
            raise AbortError(missing) from error

    def lookup(self, index: int, subindex: int | None = None) -> Any:
        """The object, or its entry at a sub-index.

        Raises:
            KeyError: there is none (durand 0.5.0 gives a plain variable whatever the sub-index).
        """
        if subindex and index in self._variables:
            raise KeyError(index, subindex)
        return super().lookup(index, subindex)

    def entries(self) -> Iterator[tuple[int, int, Variable]]:
        """Every (index, sub-index, variable), in order."""
        for index, item in self:
            if isinstance(item, Variable):
                yield index, 0, item
            else:
                for subindex, variable in item:
                    yield index, subindex, variable

    def check(self, index: int, subindex: int, value: Any) -> None:
        """Refuse a value outside the limits of the object.

        Raises:
            AbortError: 0609 0031h, 0609 0032h.
        """
        variable = self.lookup(index, subindex)
        if variable.maximum is not None and value > variable.maximum:
            raise AbortError(AbortCode.VALUE_TOO_HIGH)
        if variable.minimum is not None and value < variable.minimum:
            raise AbortError(AbortCode.VALUE_TOO_LOW)

    def restore(
        self, first: int = 0x1000, last: int = 0xFFFF, stored: Mapping[tuple[int, int], int | bytes] | None = None
    ) -> None:
        """Forget every value written to the objects from `first` to `last`: defaults or `stored` values hold again."""
        for key in [key for key in self._data if first <= key[0] <= last]:
            del self._data[key]
        for key, value in (stored or {}).items():
            if first <= key[0] <= last:
                self._data[key] = value

    def written(self) -> dict[tuple[int, int], int | bytes]:
        """The values that differ from the defaults of the EDS."""
        return {key: value for key, value in self._data.items() if value != self.lookup(*key).value}

    def _write_checked(self, index: int, subindex: int, value: int) -> None:
        # A PDO has no way to answer (CiA 301): a refused value leaves the object as it is.
        with suppress(AbortError):
            self.check(index, subindex, value)
            self.write(index, subindex, value, downloaded=True)
