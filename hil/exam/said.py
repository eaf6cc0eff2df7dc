"""What the diagnosing side said of a case."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

FAILED: Final = "failed"
"""Verdict of a diagnosis that ended in an error."""


@dataclass(frozen=True)
class Alone:
    """What a name closes of the removable held-out gap in place of the answer: `ident.diagnosis.answer.alone`.

    Attributes:
        name: of the effect.
        refitted, held: with the parameters of the model refitted, and held at its values; NaN where that says nothing.
    """

    name: str
    refitted: float
    held: float


@dataclass(frozen=True)
class Said:
    """What the diagnosing side said of one case.

    Attributes:
        verdict: `effect`, `law`, `none`, `unknown`, `fault` or `failed`.
        effects: as in `diagnosis.json`, most probable first; none unless the verdict is `effect` or `law`.
        invisible: names that the records cannot show.
        closed: share of the removable held-out gap that the whole answer closes.
        seconds: processor time [s].
        alone: what every name closes by itself.
        faults: `name@channel` of every fault of the records, and what else each may be called.
    """

    verdict: str
    effects: tuple[Mapping[str, Any], ...] = ()
    invisible: tuple[str, ...] = ()
    closed: float = math.nan
    seconds: float = math.nan
    alone: tuple[Alone, ...] = ()
    faults: tuple[frozenset[str], ...] = ()


def said_from(content: Mapping[str, Any]) -> Said:
    """What a file of the diagnosing side says."""
    alone = content.get("alone", ())
    return Said(
        verdict=str(content["verdict"]),
        effects=tuple(content["effects"]),
        invisible=tuple(content["invisible"]),
        closed=_number(content["gap"]["closed"]),
        seconds=_number(content.get("seconds")),
        faults=tuple(frozenset((f"{one['name']}@{one['channel']}", *one["also"])) for one in content.get("faults", ())),
        alone=tuple(Alone(one["name"], _number(one["refitted"]), _number(one["held"])) for one in alone),
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
