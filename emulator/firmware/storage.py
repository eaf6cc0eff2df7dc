"""Store and restore parameters: 1010h, 1011h (CiA 301, 7.5.2.13, 7.5.2.14), in a memory that outlives the node."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from ident.errors import DataFileError
from ident.reading import read_json
from ident.writing import replace_whole

Values = dict[tuple[int, int], int | bytes]
"""(index, sub-index) -> value."""

_SAVE = int.from_bytes(b"save", "little")
_LOAD = int.from_bytes(b"load", "little")

ON_COMMAND = 1
"""What 1010h and 1011h read as: the device saves (restores) when it is told to, not by itself."""

GROUPS = {1: (0x1000, 0xFFFF), 2: (0x1000, 0x1FFF), 3: (0x6000, 0x9FFF)}
"""Sub-index of 1010h and 1011h -> first and last index: all, communication, device profile."""

_IDENTITY = ((0x1000, 0), (0x1018, 1), (0x1018, 2))
"""Device type, vendor and product: what stored parameters have to fit."""

COMMANDS = frozenset((0x1010, 0x1011, 0x6003, 0x6040, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60FF))
"""Objects that are commands or set points, not parameters: they are never stored."""


class Memory(Protocol):
    """Non-volatile memory for what all devices store, by name."""

    def load(self, name: str, device: str) -> Values:
        """What was saved under this name by this kind of device."""

    def save(self, name: str, device: str, values: Mapping[tuple[int, int], int | bytes]) -> None:
        """Keep these values."""


@dataclass
class VolatileMemory:
    """Outlives the resets of the nodes, not the process."""

    _values: dict[str, Values] = field(default_factory=dict)

    def load(self, name: str, device: str) -> Values:
        """What was saved under this name."""
        return dict(self._values.get(name, {}))

    def save(self, name: str, device: str, values: Mapping[tuple[int, int], int | bytes]) -> None:
        """Keep these values."""
        self._values[name] = dict(values)


@dataclass(frozen=True)
class FolderMemory:
    """One JSON file a name in a folder: outlives the process, and can be read by people.

    Attributes:
        folder: where the files are; made when something is saved.
    """

    folder: Path

    def load(self, name: str, device: str) -> Values:
        """What was saved under this name.

        Raises:
            DataFileError: the file cannot be read, or is of another kind of device.
        """
        path = self._path(name)
        if not path.exists():
            return {}
        try:
            document = read_json(path)
            saved_by = document["device"]
            values = {_key(key): _value(text) for key, text in document["values"].items()}
        except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
            raise DataFileError(f"{path}: not stored parameters of a node ({error}).", "Delete the file.") from error
        if saved_by != device:
            raise DataFileError(
                f"{path}: parameters of {saved_by}, but {name.replace('_', ' ')} is {device}.",
                "Delete the file, or use another storage folder.",
            )
        return values

    def save(self, name: str, device: str, values: Mapping[tuple[int, int], int | bytes]) -> None:
        """Keep these values; the file is replaced as a whole.

        Raises:
            OSError: the file cannot be written.
        """
        document = {
            "device": device,
            "values": {
                f"{index:04X}sub{subindex:X}": value if isinstance(value, int) else value.hex()
                for (index, subindex), value in sorted(values.items())
            },
        }
        replace_whole(json.dumps(document, indent=1) + "\n", self._path(name))

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.json"


class ParameterStorage:
    """Objects 1010h and 1011h of one node.

    Args:
        dictionary: the object dictionary of the node.
        memory: non-volatile memory.
        name: what they are stored under.
        may_store: whether the state of the node allows it.
    """

    def __init__(self, dictionary: Dictionary, memory: Memory, name: str, may_store: Callable[[], bool]) -> None:
        self._dictionary = dictionary
        self._memory = memory
        self._name = name
        self._may_store = may_store
        self._device = ":".join(f"{dictionary.value(*key, default=0):08X}" for key in _IDENTITY)
        for subindex, (first, last) in GROUPS.items():
            dictionary.on_write(0x1010, subindex, self._on_signature(_SAVE, self._save, first, last))
            dictionary.on_write(0x1011, subindex, self._on_signature(_LOAD, self._forget, first, last))
            dictionary.on_read(0x1010, subindex, lambda: ON_COMMAND)
            dictionary.on_read(0x1011, subindex, lambda: ON_COMMAND)

    def stored(self) -> Values:
        """What a reset starts with instead of the defaults; values that no longer fit the dictionary are left out."""
        return {key: value for key, value in self._memory.load(self._name, self._device).items() if self._fits(key)}

    def _fits(self, key: tuple[int, int]) -> bool:
        try:
            return bool(self._dictionary.find(*key).writable)
        except AbortError:
            return False

    def _on_signature(
        self, signature: int, act: Callable[[int, int], None], first: int, last: int
    ) -> Callable[[int], None]:
        def write(value: int) -> None:
            if value != signature:
                raise AbortError(AbortCode.CANNOT_STORE)
            if not self._may_store():
                raise AbortError(AbortCode.DEVICE_STATE)
            act(first, last)

        return write

    def _save(self, first: int, last: int) -> None:
        written = self._dictionary.written()
        self._replace(first, last, {key: value for key, value in written.items() if key[0] not in COMMANDS})

    def _forget(self, first: int, last: int) -> None:
        # The defaults become valid with the next reset (CiA 301): the present values stay until then.
        self._replace(first, last, {})

    def _replace(self, first: int, last: int, values: Values) -> None:
        new = {key: value for key, value in values.items() if first <= key[0] <= last and self._fits(key)}
        try:
            kept = {key: value for key, value in self.stored().items() if not first <= key[0] <= last}
            self._memory.save(self._name, self._device, kept | new)
        except (OSError, DataFileError) as error:
            raise AbortError(AbortCode.CANNOT_STORE) from error


def _key(name: str) -> tuple[int, int]:
    index, subindex = name.split("sub")
    return int(index, 16), int(subindex, 16)


def _value(text: int | str) -> int | bytes:
    return text if isinstance(text, int) else bytes.fromhex(text)
