"""What may stand in one place of an explanation, as it is reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import Final

from ident.diagnosis.names import LAW

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
        unlisted: probability that it is none of them as they are written.
    """

    probabilities: Mapping[str, float]
    names: Mapping[str, float]
    alike: tuple[str, ...]
    log_odds: Mapping[str, float]
    unlisted: float

    def ambiguity_set(self, name: str) -> tuple[str, ...]:
        """Names up to a probability of `COVERAGE`, and those of candidates that are the same; `name` first.

        What is none of them as they are written is a cause without a name.
        """
        nameless = self.names.get(LAW, 0.0) + self.unlisted
        names = dict(sorted({**self.names, LAW: nameless}.items(), key=lambda entry: -entry[1]))
        return tuple(dict.fromkeys([name, *_covering(names), *map(_name_of, self.alike)]))

    @property
    def untold(self) -> tuple[str, ...]:
        """Keys of what is the same in these records, and of its name's places up to `COVERAGE` of their probability."""
        name = _name_of(self.alike[0])
        places = {key: each for key, each in self.probabilities.items() if _name_of(key) == name}
        return tuple(dict.fromkeys([*self.alike, *_covering(places)]))


def _covering(probabilities: Mapping[str, float]) -> list[str]:
    """The first of them that make up `COVERAGE` of all; none where all are zero."""
    before = accumulate(probabilities.values(), initial=0.0)
    total = sum(probabilities.values())
    return [one for one, reached in zip(probabilities, before, strict=False) if reached < COVERAGE * total]


def _name_of(key: str) -> str:
    return key.split("@")[0]
