"""Numbers with unit, source and uncertainty, read from TOML tables of quantities."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import DataFileError
from ident.reading import read_toml as read_toml

GRAVITY: Final = 9.80665
"""Standard gravity, ISO 80000-3 [m/s²]."""

QUANTITY_KEYS: Final = ("value", "unit", "source", "std")
"""What an entry of a table of quantities may hold."""


@dataclass(frozen=True)
class Quantity:
    """A value in the SI unit named, with its standard uncertainty and where it comes from."""

    value: float
    unit: str
    source: str
    std: float = 0.0


def require_table(document: Mapping[str, Any], name: str, path: Path) -> Mapping[str, Any]:
    """The table `name` of a parsed file.

    Raises:
        DataFileError: there is no such table.
    """
    table = document.get(name)
    if not isinstance(table, Mapping):
        raise DataFileError(f"{path} has no table [{name}].", f"Add [{name}] with its entries.")
    return table


def read_quantities(
    table: Mapping[str, Any],
    units: Mapping[str, str],
    where: str,
    *,
    optional: Iterable[str] = (),
    more_keys: bool = False,
) -> dict[str, Quantity]:
    """Read the quantities named in `units` (name -> the unit it must have) from a parsed table.

    Args:
        table: as parsed.
        units: name -> the unit it must have.
        where: file and table, for errors.
        optional: names that may be left out; they are then not in the result.
        more_keys: an entry may hold other keys than those of a quantity, as in files of results.

    Raises:
        DataFileError: an entry is missing, unknown, not finite, or in another unit.
    """
    refuse_unknown(table, units, where)
    left_out = {name for name in optional if name not in table}
    read = {name: _read_quantity(table, name, unit, where) for name, unit in units.items() if name not in left_out}
    if not more_keys:
        for name in read:
            refuse_unknown(table[name], QUANTITY_KEYS, f"{where}.{name}")
    return read


def read_numbers(found: object, shape: tuple[int, ...], where: str, remedy: str) -> NDArray[np.float64]:
    """Finite numbers of that shape.

    Raises:
        DataFileError: they are not; with the remedy.
    """
    try:
        array = np.asarray(found, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape or not np.all(np.isfinite(array)):
        raise DataFileError(f"{where} is not {' by '.join(map(str, shape))} numbers.", remedy)
    return array


def refuse_unknown(table: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    """Refuse keys that nobody reads: most are misspelt, and what was meant would be missed in silence.

    Args:
        table: as parsed.
        known: the keys that are read.
        where: the table, or the file followed by a colon, for errors.

    Raises:
        DataFileError: a key is not among `known`; with the one that was probably meant.
    """
    names = tuple(known)
    for key in table:
        if key not in names:
            meant = get_close_matches(key, names, n=1)
            hint = f"Did you mean {meant[0]!r}? " if meant else ""
            place = f"{where} {key}" if where.endswith(":") else f"{where}.{key}"
            raise DataFileError(f"{place} is not known.", f"{hint}Use only: {', '.join(names)}.")


def _read_quantity(table: Mapping[str, Any], name: str, unit: str, where: str) -> Quantity:
    entry = table.get(name)
    example = f'{name} = {{ value = 1.0, unit = "{unit}", std = 0.1, source = "..." }}'
    if not isinstance(entry, Mapping) or not {"value", "unit", "source"} <= entry.keys():
        raise DataFileError(f"{where}.{name} is missing or incomplete.", f"Write {example}.")
    if entry["unit"] != unit:
        raise DataFileError(f"{where}.{name} is given in {entry['unit']!r}.", f"Give it in {unit!r}.")
    value, std = entry["value"], entry.get("std", 0.0)
    if not (_is_finite_number(value) and _is_finite_number(std)):
        raise DataFileError(f"{where}.{name} is not a finite number.", f"Write {example}.")
    if std < 0:
        raise DataFileError(f"{where}.{name} has a negative std.", f"Write {example}.")
    return Quantity(float(value), unit, str(entry["source"]), float(std))


def _is_finite_number(number: object) -> bool:
    return isinstance(number, int | float) and not isinstance(number, bool) and math.isfinite(number)
