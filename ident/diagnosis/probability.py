"""From log evidence to probabilities, and from those to sets of names that the records do not tell apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np

from ident.diagnosis.evidence import cosines, origins
from ident.diagnosis.regression import Regression, Slot
from ident.vehicle.quantities import read_toml

ALIKE: Final = 0.995
"""Cosine beside the baseline, with what was fitted, above which a candidate of as many numbers is the same here."""


@dataclass(frozen=True)
class Calibration:
    """How log evidence becomes probability.

    Attributes:
        temperature: by which log evidence is divided.
        none: log odds of no effect against any one, before the data.
        ceiling: largest probability that is ever given.
        coverage: of an ambiguity set.
    """

    temperature: float
    none: float
    ceiling: float
    coverage: float


@cache
def calibration() -> Calibration:
    """The calibration in the package's data."""
    with resources.as_file(resources.files("ident.diagnosis") / "data" / "calibration.toml") as path:
        document = read_toml(Path(path))
    return Calibration(**{name: float(document[name]) for name in Calibration.__annotations__})


@dataclass(frozen=True)
class Ranked:
    """What may stand in one place of an explanation.

    Attributes:
        probabilities: of every candidate by key, most probable first; what is missing to one is no effect.
        names: of every effect by name, whatever its place.
        alike: keys that are the same as the one taken in these records, itself first.
        log_evidence: of every candidate by key, against nothing in this place, the greatest first.
    """

    probabilities: Mapping[str, float]
    names: Mapping[str, float]
    alike: tuple[str, ...]
    log_evidence: Mapping[str, float] = field(default_factory=dict)

    @property
    def probability(self) -> float:
        """That the name taken is right, or one of a candidate that is the same in these records."""
        return sum(self.names.get(name, 0.0) for name in {key.split("@")[0] for key in self.alike})

    def ambiguity_set(self, name: str, coverage: float) -> tuple[str, ...]:
        """Names up to a probability, and those of candidates that are the same; `name` first."""
        total, chosen, reached = sum(self.names.values()), [name], 0.0
        for other, probability in self.names.items():
            if total == 0 or reached >= coverage * total:
                break
            reached += probability
            chosen.append(other)
        chosen += [key.split("@")[0] for key in self.alike]
        return tuple(dict.fromkeys(chosen))


def rank(regression: Regression, slot: Slot, variant: int, settings: Calibration) -> Ranked:
    """Probabilities of the contenders of a slot, the one taken among them."""
    keys = [regression.key(contender) for contender in slot.variants]
    scaled = np.append(slot.log_evidence, settings.none) / settings.temperature
    weights = np.exp(scaled - scaled.max())
    weights /= weights.sum()
    probabilities = dict(zip(keys, weights[:-1].tolist(), strict=True))
    names: dict[str, float] = {}
    for key, probability in probabilities.items():
        name = key.split("@")[0]
        names[name] = names.get(name, 0.0) + probability
    ordered = dict(sorted(names.items(), key=lambda entry: -entry[1]))
    same = tuple(regression.key(other) for other in alike(regression, slot, variant))
    evidence = dict(sorted(zip(keys, slot.log_evidence.tolist(), strict=True), key=lambda entry: -entry[1]))
    return Ranked(probabilities, ordered, same, evidence)


def alike(regression: Regression, slot: Slot, variant: int) -> list[int]:
    """Variants that are the same as the one taken in these records, itself first, one a candidate."""
    evidence = slot.evidence
    sizes = evidence.directions.sizes[origins(regression.rows.layout)]
    same = (cosines(evidence, variant) > ALIKE) & (sizes == sizes[variant]) & np.isfinite(evidence.log_evidence)
    found: dict[str, int] = {regression.key(variant): variant}
    for other in sorted(np.flatnonzero(same).tolist(), key=lambda one: -float(evidence.log_evidence[one])):
        found.setdefault(regression.key(other), other)
    return list(found.values())
