"""What to drive next: what splits an ambiguity, or shows what these records cannot show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from ident.diagnosis.findings import Findings
from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.ideal import DIAGNOSTIC, Drive, Experiment
from ident.diagnosis.vehicle.library import DRIFTS
from ident.diagnosis.vehicle.visibility import Sight, Visibility
from ident.effects import Effect
from ident.records.record import Record, base_step

LIGHTEST: Final = 0.09
"""Difference of known loads, over the vehicle's mass, that counts as the tenth that the experiment asks for [-]."""

SMALLEST: Final = 0.5
"""Size of an effect that the model has, over the one that the experiment asks for, from which it counts [-]."""


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
    """Advice to a person.

    Args:
        findings: of a diagnosis.
        driven: what it was made from.
        visibility: of the vehicle.

    Returns:
        None where nothing is in doubt that another experiment would clear up.
    """
    diagnosis = findings.diagnosis()
    for effect in diagnosis.effects:
        rivals = [name for name in effect.ambiguity_set if name != effect.name]
        advice = _splitting(f"{effect.name}@{effect.where}", rivals, driven, visibility) if rivals else None
        if advice is not None:
            return f"To tell {effect.name} from {' and '.join(rivals)}: {advice}."
    return _showing(diagnosis.invisible, driven, visibility)


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


def _splitting(key: str, rivals: Sequence[str], driven: Driven, visibility: Visibility) -> str | None:
    """Of the experiments not driven yet, the first that leaves none of the rivals alike."""
    effect = key.partition("@")[0]
    for name in _open(driven):
        sight = visibility.of(name, (effect, *rivals)).get(key)
        if sight is not None and sight.visible and not set(sight.alike_effects(effect)) & set(rivals):
            return DIAGNOSTIC[name].advice
    return None


def _showing(invisible: Sequence[str], driven: Driven, visibility: Visibility) -> str | None:
    """Of the experiments not driven yet, the one that shows most of what is invisible."""
    if not invisible:
        return None
    shown = {
        name: [effect for effect in invisible if _seen(effect, visibility.of(name, invisible))]
        for name in _open(driven)
    }
    best = max(shown, key=lambda name: len(shown[name]), default=None)
    if best is None or not shown[best]:
        return None
    return f"To see {' and '.join(shown[best])} as well: {DIAGNOSTIC[best].advice}."


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
