"""How numbers are written: as many digits as their standard deviation supports (GUM, 7.2.6)."""

from __future__ import annotations

import math
import re
from typing import Final

SIGNIFICANT: Final = 2
"""Significant digits of a standard deviation."""

BEYOND: Final = 1e4
"""Multiple from which its size says nothing."""

SMALL: Final = 0.1
"""Size below which what is a length, time, angle or torque, or so much of it a something, has a prefix: 12.7 μm."""

MISSING: Final = "–"
"""Stands where there is no number."""

_SUPERSCRIPTS: Final = {"^2": "²", "^3": "³"}

_PREFIXES: Final = ("", "m", "μ", "n")
"""Each a thousandth of the one before."""

_PREFIXED: Final = frozenset({"m", "s", "rad", "Nm"})
"""First factors of units that people write with them."""


def digits(value: float, std: float) -> str:
    """A value with the decimals of its standard deviation; four significant digits where there is none."""
    if not math.isfinite(value):
        return MISSING
    if not (std > 0 and math.isfinite(std)):
        return f"{value:.4g}"
    return f"{value:.{_decimals(std, SIGNIFICANT)}f}"


def with_std(value: float, std: float) -> str:
    """`value ± std`, or the value alone where there is no std."""
    return f"{digits(value, std)} ± {digits(std, std)}" if std > 0 else digits(value, std)


def quantity_text(value: float, std: float, unit: str) -> str:
    """`value ± std unit`, small ones with a prefix."""
    factor, shown = _prefixed(_size(value, std), unit)
    return f"{with_std(factor * value, factor * std)} {shown}".rstrip()


def value_text(value: float, unit: str, count: int = 3, beside: float = 0.0) -> str:
    """`value unit` of `count` significant digits, with the prefix of the larger of it and of what is beside it."""
    factor, shown = _prefixed(_size(value, beside), unit)
    return f"{significant(factor * value, count)} {shown}".rstrip()


def range_text(low: float, high: float, unit: str, count: int = 3) -> str:
    """`low to high unit`, both with the prefix and the decimals of the larger, which has `count` significant digits."""
    size = _size(low, high)
    factor, shown = _prefixed(size, unit)
    decimals = _decimals(factor * size, count) if size > 0 else 0
    return f"{factor * low:z.{decimals}f} to {factor * high:z.{decimals}f} {shown}".rstrip()


def _size(*values: float) -> float:
    """The largest of those that are numbers."""
    return max((abs(value) for value in values if math.isfinite(value)), default=0.0)


def _prefixed(size: float, unit: str) -> tuple[float, str]:
    """What numbers as large as this are multiplied by, and the unit that they have then; that of a share is none."""
    first, rounded, power = re.split("[ /]", unit)[0], float(f"{size:.2e}"), 0
    if first in _PREFIXED and 0 < rounded < SMALL:
        power = min(math.ceil(-math.log10(rounded) / 3), len(_PREFIXES) - 1)
    return 1000.0**power, "" if unit == "1" else _PREFIXES[power] + unit_text(unit)


def percent(share: float, *, signed: bool = False) -> str:
    """A share as a percentage of two significant digits, from 0.01 % upwards."""
    if not math.isfinite(share):
        return MISSING
    size = abs(100 * share)
    decimals = 2 if size < 1 else 1 if size < 10 else 0
    return f"{100 * share:{'+' if signed else ''}.{decimals}f} %"


def significant(value: float, count: int = 3) -> str:
    """A number of `count` significant digits, without exponent for the sizes that occur here."""
    if not math.isfinite(value):
        return MISSING
    if value == 0:
        return "0"
    return f"{value:.{_decimals(abs(value), count)}f}"


def _decimals(size: float, count: int) -> int:
    """That leave `count` significant digits of a size."""
    return max(0, count - 1 - math.floor(math.log10(size)))


def times(value: float) -> str:
    """A multiple of three significant digits; one beyond all bounds as no more than that."""
    return f"over {BEYOND:.0f}" if value >= BEYOND else significant(value)


def unit_text(unit: str) -> str:
    """A unit with real superscripts."""
    for plain, raised in _SUPERSCRIPTS.items():
        unit = unit.replace(plain, raised)
    return unit


def plain(name: str) -> str:
    """A canonical name for reading."""
    return name.replace("_", " ")
