"""What may stand in one place of an explanation, as it is reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

COVERAGE: Final = 0.95
"""Probability that an ambiguity set holds together."""


@dataclass(frozen=True)
class Ranked:
    """What may stand in one place of an explanation.

    Attributes:
        probabilities: of every candidate by key, most probable first; what is missing to one is nothing, or what none
            of them describes.
        names: of every effect by name, whatever its place.
        alike: keys that are the same as the one taken in these records, itself first.
        log_odds: of every candidate by key, against nothing in this place, the greatest first.
    """

    probabilities: Mapping[str, float]
    names: Mapping[str, float]
    alike: tuple[str, ...]
    log_odds: Mapping[str, float]

    def ambiguity_set(self, name: str) -> tuple[str, ...]:
        """Names up to a probability of `COVERAGE`, and those of candidates that are the same; `name` first."""
        total, chosen, reached = sum(self.names.values()), [name], 0.0
        for other, probability in self.names.items():
            if total == 0 or reached >= COVERAGE * total:
                break
            reached += probability
            chosen.append(other)
        chosen += [key.split("@")[0] for key in self.alike]
        return tuple(dict.fromkeys(chosen))

    @property
    def untold(self) -> tuple[str, ...]:
        """Keys of what is the same in these records, and of its name's places up to `COVERAGE` of their probability."""
        first = self.alike[0]
        name = first.split("@")[0]
        own = {key: each for key, each in self.probabilities.items() if key.split("@")[0] == name}
        before = np.cumsum([0.0, *own.values()])
        places = [key for key, less in zip(own, before[:-1], strict=True) if less < COVERAGE * before[-1]]
        return tuple(dict.fromkeys([*self.alike, *places]))
