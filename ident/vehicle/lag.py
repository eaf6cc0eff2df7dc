"""How late torques act in the records of a vehicle, and the table `[sampling]` that says so."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from ident.errors import DataFileError
from ident.vehicle.quantities import read_quantities, require_table

SAMPLING: Final = "sampling"
"""Table of the parameter file."""

_UNITS: Final[Mapping[str, str]] = MappingProxyType({"lag": "s", "interval": "s"})


@dataclass(frozen=True)
class Lag:
    """By how much all torques act later than they are recorded, as drives, buses and sampling have it.

    Attributes:
        value, std: of it, less than zero where they act earlier [s].
        interval: between the samples that it was found in [s]; at another one it is another.
    """

    value: float
    std: float
    interval: float


def read_lag(document: Mapping[str, Any], path: Path) -> Lag | None:
    """The lag of a parsed file; None where it says nothing of it.

    Raises:
        DataFileError: the table cannot be used.
    """
    if SAMPLING not in document:
        return None
    found = read_quantities(require_table(document, SAMPLING, path), _UNITS, f"{path}: {SAMPLING}")
    if not found["lag"].std > 0:
        raise DataFileError(
            f"{path}: {SAMPLING}.lag has no standard deviation.",
            f"Give std, in s, or leave [{SAMPLING}] out: nothing is said of the lag then.",
        )
    return Lag(found["lag"].value, found["lag"].std, found["interval"].value)


def lag_text(lag: Lag, source: str) -> str:
    """The table of a file."""
    lines = ["", f"[{SAMPLING}.lag]", f"value = {lag.value:.6g}", f"std = {lag.std:.6g}"]
    lines += [f'unit = "{_UNITS["lag"]}"', f"source = {json.dumps(source)}"]
    lines += ["", f"[{SAMPLING}.interval]", f"value = {lag.interval:.6g}", f'unit = "{_UNITS["interval"]}"']
    return "\n".join([*lines, f"source = {json.dumps(source)}", ""])
