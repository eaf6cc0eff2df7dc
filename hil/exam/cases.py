"""Cases of an exam: which effect, where, how large, with which noise."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

SIZES: Final = (0.2, 0.5, 1.0)
"""Of the effects of an exam, in noise units."""

SEEDS_PER_CASE: Final = 2


class Kind(enum.StrEnum):
    """What a case asks."""

    EFFECT = "effect"
    PAIR = "pair"
    NONE = "none"
    UNKNOWN = "unknown"
    INVISIBLE = "invisible"
    LAW = "law"
    FAULT = "fault"


@dataclass(frozen=True)
class Injected:
    """An effect of a case.

    Attributes:
        name, where: which effect, or law without a name; of a fault of the record, its name and its channel.
        parameter: that says how large it is; of a fault, the step that it is confined to.
        size: of that parameter [SI]; of a law, in noise units; of a fault, whatever its value is.
        values: further numbers of a law.
    """

    name: str
    where: str
    parameter: str
    size: float
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """One case with its answer.

    Attributes:
        identifier: random; all that the diagnosing side sees of it.
        kind: what it asks.
        effects: that the vehicle has.
        noise_units: size of each of them, zero without one.
        seed: of the noise while fitting; the next one while confirming.
        excitation: number of the pair of campaigns that it drives, among the plans of the exam.
    """

    identifier: str
    kind: Kind
    effects: tuple[Injected, ...]
    noise_units: float
    seed: int
    excitation: int

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "identifier": self.identifier,
            "kind": str(self.kind),
            "effects": [vars(effect) for effect in self.effects],
            "noise_units": self.noise_units,
            "seed": self.seed,
            "excitation": self.excitation,
        }


def case_from_json(entry: dict[str, Any]) -> Case:
    """The case of `Case.as_json`."""
    effects = tuple(Injected(**effect) for effect in entry["effects"])
    return Case(**{**entry, "kind": Kind(entry["kind"]), "effects": effects})
