"""Numbers with unit, source and uncertainty, read from TOML tables of quantities."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ident.errors import DataFileError


@dataclass(frozen=True)
class Quantity:
    """A value in the SI unit named, with its standard uncertainty and where it comes from."""

    value: float
    unit: str
    source: str
    std: float = 0.0


def read_toml(path: Path) -> dict[str, Any]:
    """Parse a TOML file.

    Raises:
        DataFileError: the file is missing, cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise DataFileError(f"{path} does not exist.", "Name an existing TOML file.") from error
    except OSError as error:
        raise DataFileError(f"{path} cannot be read: {error.strerror}.", "Name a readable TOML file.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DataFileError(f"{path} is not valid TOML: {error}.", "Mend the file at that place.") from error


def require_table(document: Mapping[str, Any], name: str, path: Path) -> Mapping[str, Any]:
    """The table `name` of a parsed file.

    Raises:
        DataFileError: there is no such table.
    """
    table = document.get(name)
    if not isinstance(table, Mapping):
        raise DataFileError(f"{path} has no table [{name}].", f"Add [{name}] with its entries.")
    return table


def read_quantities(table: Mapping[str, Any], units: Mapping[str, str], where: str) -> dict[str, Quantity]:
    """Read the quantities named in `units` (name -> the unit it must have) from a parsed table.

    Raises:
        DataFileError: an entry is missing, unknown, not finite, or in another unit.
    """
    _refuse_unknown(table, units, where)
    return {name: _read_quantity(table, name, unit, where) for name, unit in units.items()}


def _refuse_unknown(table: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    for name in table:
        if name not in known:
            raise DataFileError(f"{where}.{name} is not known.", f"Use only: {', '.join(known)}.")


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
