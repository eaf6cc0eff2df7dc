"""What to drive next: what splits an ambiguity, or shows what these records cannot show."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.causes.library import DRIFTS
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, Drive, Experiment
from ident.diagnosis.vehicle.experiment.information import NOTHING, Imagined
from ident.diagnosis.vehicle.experiment.visibility import FORETOLD, Sight, Visibility
from ident.effects import Effect
from ident.records.record import Record, base_step

Array = NDArray[np.float64]

LIGHTEST: Final = 0.09
"""Difference of known loads, over the vehicle's mass, that counts as the tenth that the experiment asks for [-]."""

SMALLEST: Final = 0.5
"""Size of an effect that the model has, over the one that the experiment asks for, from which it counts [-]."""

LEAST: Final = 0.05
"""Information from which an experiment is worth while [bit]."""

AS_MUCH: Final = 0.1
"""Share of the information within which two experiments tell as much."""

UNLIKELY: Final = 0.01
"""Probability up to which nothing is asked of what may stand in a place."""

FEW: Final = 3
"""Rivals that advice names."""


@dataclass(frozen=True)
class Driven:
    """What a diagnosis is made from.

    Attributes:
        loads: steps by name, with the known loads that each was driven with over the mass of the vehicle [-].
        given: effects that the model has.
    """

    loads: Mapping[str, Collection[float]]
    given: Sequence[Effect] = ()

    def only(self, steps: Collection[str]) -> Driven:
        """The same without other steps."""
        return replace(self, loads={step: loads for step, loads in self.loads.items() if step in steps})


def driven_steps(records: Iterable[Record], mass: float, given: Sequence[Effect] = ()) -> Driven:
    """What records hold of a vehicle of some mass [kg], judged by a model with some effects."""
    loads: dict[str, set[float]] = {}
    for segment in (segment for record in records for segment in record.segments):
        loads.setdefault(segment.step, set()).add(segment.payload / mass)
    return Driven(loads, given)


def next_experiment(findings: Findings, driven: Driven, visibility: Visibility) -> str | None:
    """Advice to a person: of what is not driven yet, what is expected to tell most.

    Args:
        findings: of a diagnosis.
        driven: what it was made from.
        visibility: of the vehicle.

    Returns:
        None where nothing is in doubt that another experiment would clear up.
    """
    doubts = [doubt for cause in findings.causes if (doubt := _doubt_of(cause)) is not None]
    hidden = frozenset(findings.invisible) & FORETOLD
    if not doubts and not hidden:
        return None
    told = {name: _told_by(name, doubts, hidden, visibility) for name in _open(driven)}
    most = max((sum(each) for each in told.values()), default=0.0)
    if most < LEAST:
        return None
    # Of those that tell as much, the easiest.
    best = next(name for name, each in told.items() if sum(each) > (1 - AS_MUCH) * most)
    aims = [doubt.aim for doubt, bits in zip(doubts, told[best], strict=False) if bits > AS_MUCH * most]
    seen = [name for name in sorted(hidden) if _seen(name, visibility.of(best, hidden))]
    if seen or not aims:
        aims.append(f"to see {' and '.join(seen or sorted(hidden))} as well" if hidden else doubts[0].aim)
    aim = " and ".join(aims)
    return f"{aim[0].upper()}{aim[1:]}: {DIAGNOSTIC[best].advice} (expected to tell {most:.2g} bit)."


def hidden_effects(driven: Driven, visibility: Visibility) -> frozenset[EffectName]:
    """Effects that an experiment of these steps cannot show, by the equations.

    What breaks the equations, a sliding wheel for one, can look like them; they are not candidates. Changed parameters
    are: they are hidden only as long as the parameters are free.
    """
    done = ["four steps", *(name for name in DIAGNOSTIC if name not in _open(driven))]
    names = {key.partition("@")[0] for key in visibility["four steps"]} - set(DRIFTS)
    return frozenset(
        EffectName(name) for name in names if not any(_seen(name, visibility[experiment]) for experiment in done)
    )


@dataclass(frozen=True)
class _Doubt:
    """What may stand in the place of a cause.

    Attributes:
        key, values: of the cause.
        probabilities: of all that may be there, by key, and of nothing.
    """

    key: str
    values: Array
    probabilities: Mapping[str, float]

    @property
    def aim(self) -> str:
        """What an experiment is for that splits it."""
        likely = sorted((key for key in self.probabilities if key not in (self.key, NOTHING)), key=self._rank)
        own, rivals = self.key.partition("@")[0], likely[:FEW]
        names = dict.fromkeys(key.partition("@")[0] for key in rivals)
        if not rivals:
            return f"to tell {own} from nothing"
        if own not in names:
            return f"to tell {own} from {' and '.join(names)}"
        return f"to tell {self.key} from {' and '.join(rivals)}"

    def _rank(self, key: str) -> float:
        return -self.probabilities[key]


def _doubt_of(cause: Cause) -> _Doubt | None:
    """None of a law: what its function does in another experiment is not known."""
    key = cause.candidate.key
    known = {one: log for one, log in cause.ranked.log_odds.items() if one.partition("@")[0] in FORETOLD}
    if cause.law is not None or key not in known:
        return None
    odds = {NOTHING: 0.0, **known}
    whole = float(logsumexp(list(odds.values())))
    probabilities = {one: math.exp(log - whole) for one, log in odds.items()}
    kept = {one: p for one, p in probabilities.items() if p > UNLIKELY or one == key}
    return _Doubt(key, cause.part.values, {one: p / sum(kept.values()) for one, p in kept.items()})


def _told_by(
    experiment: str, doubts: Sequence[_Doubt], hidden: frozenset[str], visibility: Visibility
) -> Sequence[float]:
    """Information that an experiment is expected to bring on every doubt, and on hidden effects [bit]."""
    asked = {key.partition("@")[0] for doubt in doubts for key in doubt.probabilities if key != NOTHING}
    four, further = visibility.imagined(experiment, frozenset(asked | hidden))
    assert further is not None
    values = visibility.vehicle.prior.values
    imagined = Imagined(four, further, np.append(values, np.zeros(len(four.names) - len(values))))
    found = []
    for doubt in doubts:
        mean = imagined.found(doubt.key, doubt.values)
        others = {key: imagined.like(mean, key) for key in doubt.probabilities if key != doubt.key}
        found.append(imagined.information(doubt.probabilities, {doubt.key: mean, **others}))
    if hidden:
        prior = _prior([candidate.key for candidate in four.candidates if candidate.effect in hidden])
        found.append(imagined.information(prior, {key: imagined.usual(key) for key in prior}))
    return found


def _prior(keys: Sequence[str]) -> dict[str, float]:
    """Of some causes and of nothing: every name as likely, of a name every place (`hypotheses`)."""
    places = Counter(key.partition("@")[0] for key in keys)
    odds = {NOTHING: 1.0, **{key: 1 / (len(EffectName) * places[key.partition("@")[0]]) for key in keys}}
    return {key: one / sum(odds.values()) for key, one in odds.items()}


def _open(driven: Driven) -> list[str]:
    return [name for name, experiment in DIAGNOSTIC.items() if not _is_done(experiment, driven)]


def _is_done(experiment: Experiment, driven: Driven) -> bool:
    known = all(any(_is_at_least(effect, asked) for effect in driven.given) for asked in experiment.given)
    return known and all(_is_driven(drive, driven) for drive in experiment.drives)


def _is_at_least(effect: Effect, asked: Effect) -> bool:
    return (effect.name, effect.where) == (asked.name, asked.where) and abs(effect.size) >= SMALLEST * asked.size


def _is_driven(drive: Drive, driven: Driven) -> bool:
    """With a load: whether the motion was driven with and without one, whatever its steps are called; else by name."""
    if not drive.payload:
        return any(step.startswith(drive.name) for step in driven.loads)
    loads = [load for step, those in driven.loads.items() if base_step(step) is drive.step for load in those]
    return max(loads, default=0.0) - min(loads, default=0.0) >= LIGHTEST


def _seen(effect: str, sights: Mapping[str, Sight]) -> bool:
    return any(sight.visible for key, sight in sights.items() if key.partition("@")[0] == effect)
