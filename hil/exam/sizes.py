"""The table of sizes: how large an effect has to be, in its own unit, to have a size in noise units."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ident.diagnosis.names import LATE
from ident.diagnosis.observations.delays import HELD
from ident.errors import DataFileError

EVERYWHERE: Final = "drives"
"""Where a part of a sample interval is what sampling does."""


@dataclass(frozen=True)
class EffectSize:
    """An effect at a place.

    Attributes:
        name, where, parameter: whose size.
        unit: of the parameter.
        channel: in which it shows most: `torque`, `drift` (a changed value of the model) or `kinematic`.
        points: (size, noise units) as measured, ascending.
        largest: size in practice; an effect below the noise even there is invisible.
        signed: may be negative.
        known: the library has a candidate for it.
        from_sampling: size that sampling may make as well; only what is beyond it amounts to noise units.
    """

    name: str
    where: str
    parameter: str
    unit: str
    channel: str
    points: tuple[tuple[float, float], ...]
    largest: float
    signed: bool
    known: bool
    from_sampling: float = 0.0

    def physical(self, noise_units: float) -> float:
        """Size that amounts to so many noise units, those of sampling not counted."""
        return self.from_sampling + self._beyond(noise_units)

    def _beyond(self, noise_units: float) -> float:
        """By straight lines through the points, both axes logarithmic; in proportion beyond them."""
        sizes, units = zip(*self.points, strict=True)
        if noise_units <= units[0]:
            return float(sizes[0] * noise_units / units[0])
        if noise_units >= units[-1]:
            return float(sizes[-1] * noise_units / units[-1])
        return float(np.exp(np.interp(math.log(noise_units), np.log(units), np.log(sizes))))


@dataclass(frozen=True)
class SizeTable:
    """All effects of an exam.

    Attributes:
        visible: of the library, with a size in noise units.
        invisible: of the library, below the noise in these campaigns.
        unknown: without a candidate.
    """

    visible: tuple[EffectSize, ...]
    invisible: tuple[EffectSize, ...]
    unknown: tuple[EffectSize, ...]


def beyond_sampling(table: SizeTable, sample_time: float) -> SizeTable:
    """A table for records of one sample interval [s]: a lag of all drives counts from what sampling may do."""
    late = tuple(
        replace(row, from_sampling=HELD * sample_time) if row.name in LATE and row.where == EVERYWHERE else row
        for row in table.visible
    )
    return replace(table, visible=late)


def table_text(rows: Sequence[EffectSize]) -> str:
    """The table as JSON, an effect a line."""
    return "[\n" + ",\n".join(json.dumps(_measured(row)) for row in rows) + "\n]\n"


def _measured(row: EffectSize) -> dict[str, Any]:
    return {name: value for name, value in vars(row).items() if name != "from_sampling"}


def load_sizes(path: Path) -> SizeTable:
    """Read a table.

    Raises:
        DataFileError: the file is missing or malformed.
    """
    rows = load_rows(path)
    return SizeTable(
        visible=tuple(row for row in rows if row.known and row.points),
        invisible=tuple(row for row in rows if row.known and not row.points),
        unknown=tuple(row for row in rows if not row.known),
    )


def load_rows(path: Path) -> list[EffectSize]:
    """The rows of a table, in order.

    Raises:
        DataFileError: the file is missing or malformed.
    """
    try:
        return [_row(entry) for entry in json.loads(path.read_text(encoding="utf-8"))]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataFileError(
            f"{path} is no table of sizes: {error}.", "Write one: quasiomni exam calibrate --out FILE."
        ) from error


def replaced(rows: Sequence[EffectSize], anew: Sequence[EffectSize]) -> list[EffectSize]:
    """Rows, those of effects that were measured anew in the place of what they were, places that are new among them."""
    measured = {row.name for row in anew}
    everything = [*(row for row in rows if row.name not in measured), *anew]
    names = dict.fromkeys(row.name for row in (*rows, *anew))
    return [row for name in names for row in everything if row.name == name]


def _row(entry: dict[str, Any]) -> EffectSize:
    points = tuple((float(size), float(units)) for size, units in entry["points"])
    return EffectSize(**{**entry, "points": points})
