"""Units as FMI wants them: exponents of the SI base units, and what people like to read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from ident.errors import DataFileError


@dataclass(frozen=True)
class DisplayUnit:
    """A unit to read values in: value read = factor times value in SI."""

    name: str
    factor: float


@dataclass(frozen=True)
class Unit:
    """A unit with its exponents.

    Attributes:
        name: as in the tables of `ident.vehicle`.
        exponents: of kg, m, s and rad; those that are zero are left out.
        display: other units for the same quantity.
    """

    name: str
    exponents: Mapping[str, int]
    display: tuple[DisplayUnit, ...] = ()


_FACTORS: Final[Mapping[str, Mapping[str, int]]] = MappingProxyType(
    {
        "1": {},
        "kg": {"kg": 1},
        "m": {"m": 1},
        "s": {"s": 1},
        "rad": {"rad": 1},
        "N": {"kg": 1, "m": 1, "s": -2},
        "Nm": {"kg": 1, "m": 2, "s": -2},
    }
)
"""What the names of units are made of."""

_DISPLAY: Final[Mapping[str, tuple[DisplayUnit, ...]]] = MappingProxyType(
    {
        "rad": (DisplayUnit("deg", 180 / math.pi),),
        "rad/s": (DisplayUnit("deg/s", 180 / math.pi), DisplayUnit("rev/min", 30 / math.pi)),
        "m": (DisplayUnit("mm", 1000.0),),
        "m/s": (DisplayUnit("mm/s", 1000.0), DisplayUnit("km/h", 3.6)),
    }
)


def unit_of(name: str) -> Unit:
    """A unit from its name: factors parted by blanks, one `/`, whole exponents behind `^`; `Nm s^2/rad^2`.

    Raises:
        DataFileError: a factor is not known.
    """
    above, _, below = name.partition("/")
    exponents: dict[str, int] = {}
    for text, sign in ((above, 1), (below, -1)):
        for factor in text.split():
            _multiply(exponents, factor, sign, name)
    return Unit(name, {base: power for base, power in exponents.items() if power}, _DISPLAY.get(name, ()))


def _multiply(exponents: dict[str, int], factor: str, sign: int, name: str) -> None:
    base, _, power = factor.partition("^")
    if base not in _FACTORS:
        raise DataFileError(f"The unit {name!r} has an unknown factor {base!r}.", f"Known: {', '.join(_FACTORS)}.")
    for symbol, count in _FACTORS[base].items():
        exponents[symbol] = exponents.get(symbol, 0) + sign * int(power or 1) * count
