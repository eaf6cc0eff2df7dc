"""Values of a scenario file, each with what it may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from hil.network import Role
from ident.errors import DataFileError
from ident.vehicle.quantities import refuse_unknown

Read = Callable[[Any, str], Any]
"""From what stands in a file, and where it stands, to a value.

Raises:
    DataFileError: it is none.
"""

_NEEDED: Final = object()


@dataclass(frozen=True)
class Key:
    """A key of a table.

    Attributes:
        read: its value.
        default: where it is left out; nothing for one that is needed.
    """

    read: Read
    default: Any = _NEEDED


def read_keys(table: Mapping[str, Any], keys: Mapping[str, Key], where: str, *, more: bool = False) -> dict[str, Any]:
    """The values of a table by key.

    Args:
        table: as parsed.
        keys: that it may have.
        where: the table, for errors.
        more: it may have others, which somebody else reads.

    Raises:
        DataFileError: a key is missing or unknown, or its value is none; names the key.
    """
    if not more:
        refuse_unknown(table, keys, where)
    found = {}
    for name, key in keys.items():
        if name in table:
            found[name] = key.read(table[name], f"{where}.{name}")
        elif key.default is _NEEDED:
            raise DataFileError(f"{where} has no {name}.", f"Add it; its keys are {', '.join(keys)}.")
        else:
            found[name] = key.default
    return found


def text(value: Any, where: str) -> str:
    """A text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise DataFileError(f"{where} = {value!r} is no text.", 'Write it in quotes: "...".')
    return value


def number(low: float, high: float) -> Read:
    """A number within bounds."""

    def read(value: Any, where: str) -> float:
        if not _is_number(value) or not low <= value <= high:
            raise DataFileError(f"{where} = {value!r} is out of range.", f"Give a number from {low:g} to {high:g}.")
        return float(value)

    return read


def integer(low: int, high: int) -> Read:
    """An integer within bounds; TOML takes them in hexadecimal too."""

    def read(value: Any, where: str) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise DataFileError(f"{where} = {value!r} is out of range.", f"Give an integer from {low:#x} to {high:#x}.")
        return value

    return read


def choice(known: Iterable[str]) -> Read:
    """One of some words."""
    words = tuple(known)

    def read(value: Any, where: str) -> str:
        if value not in words:
            raise DataFileError(f"{where} = {value!r} is not known.", f"Use one of {', '.join(words)}.")
        return str(value)

    return read


def role(value: Any, where: str) -> Role:
    """A node of the vehicle."""
    return Role(choice(Role)(value, where))


_TORQUE: Final = number(-1000.0, 1000.0)


def torques(value: Any, where: str) -> tuple[float, float, float, float]:
    """Motor torques fl, rl, fr, rr [Nm], or one for all."""
    given = [value] * 4 if _is_number(value) else value
    if not isinstance(given, list) or len(given) != 4:
        raise DataFileError(f"{where} = {value!r} is no torque.", "Give [fl, rl, fr, rr] in Nm, or one number for all.")
    fl, rl, fr, rr = (_TORQUE(one, f"{where}[{k}]") for k, one in enumerate(given, start=1))
    return fl, rl, fr, rr


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
