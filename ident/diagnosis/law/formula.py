"""A short formula for a curve, where one does as well as the curve itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AS_GOOD: Final = 1.0
"""Rms of what a formula misses of a curve, in its standard deviations, up to which it does as well."""

PART: Final = 0.02
"""The same over the range of the curve: what is a fiftieth of it is not worth a longer formula."""

_POWERS: Final[Mapping[str, Callable[[Array], Array]]] = {
    "x": lambda x: x,
    "x^2": np.square,
    "x^3": lambda x: x**3,
    "x|x|": lambda x: x * np.abs(x),
    "sign(x)": np.sign,
}
_SUMS: Final = (("x",), ("x^2",), ("x|x|",), ("x", "x^2"), ("x", "x^3"), ("x", "sign(x)"), ("x", "x^2", "x^3"))


def formula_of(x: Array, y: Array, std: Array, period: float) -> str | None:
    """The shortest formula that does as well as a curve; None where none does.

    Args:
        x, y, std: (N,) of the curve.
        period: of x, 0 where it does not come around.
    """
    if period:
        return _harmonics(x, y, std, period)
    for names in _SUMS:
        columns = [np.ones_like(x), *(_POWERS[name](x) for name in names)]
        text = _fitted(np.stack(columns, axis=1), ("1", *names), y, std)
        if text is not None:
            return text
    return None


def _harmonics(x: Array, y: Array, std: Array, period: float) -> str | None:
    for count in (1, 2):
        columns, names = [np.ones_like(x)], ["1"]
        for order in range(1, count + 1):
            angle = 2 * np.pi * order * x / period
            columns += [np.sin(angle), np.cos(angle)]
            names += [f"sin({2 * np.pi * order / period:.4g} x)", f"cos({2 * np.pi * order / period:.4g} x)"]
        text = _fitted(np.stack(columns, axis=1), names, y, std)
        if text is not None:
            return text
    return None


def _fitted(columns: Array, names: tuple[str, ...] | list[str], y: Array, std: Array) -> str | None:
    weights = 1 / np.maximum(std, np.finfo(float).tiny)
    found = np.linalg.lstsq(columns * weights[:, None], y * weights, rcond=None)[0]
    missed = y - columns @ found
    tolerated = np.maximum(AS_GOOD * std, PART * np.ptp(y))
    if np.sqrt(np.mean((missed / tolerated) ** 2)) > 1:
        return None
    return " ".join(
        f"{value:+.3g}" if name == "1" else f"{value:+.3g} {name}" for value, name in zip(found, names, strict=True)
    )
