"""What to drive next: what splits an ambiguity, or shows what these records cannot show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from ident.gap.findings import Findings
from ident.gap.vehicle.ideal import DIAGNOSTIC
from ident.gap.vehicle.library import DRIFTS
from ident.gap.vehicle.visibility import Sight
from ident.gap.vehicle.visibility_table import stored_table
from ident.vehicle.effects import EffectName


def next_experiment(findings: Findings, steps: Collection[str]) -> str | None:
    """Advice to a person.

    Args:
        findings: of a diagnosis.
        steps: names that it was made from.

    Returns:
        None where nothing is in doubt that another experiment would clear up.
    """
    diagnosis = findings.diagnosis()
    for effect in diagnosis.effects:
        rivals = [name for name in effect.ambiguity_set if name != effect.name]
        advice = _splitting(f"{effect.name}@{effect.where}", rivals, steps) if rivals else None
        if advice is not None:
            return f"To tell {effect.name} from {' and '.join(rivals)}: {advice}."
    return _showing(diagnosis.invisible, steps)


def hidden_effects(steps: Iterable[str]) -> frozenset[EffectName]:
    """Effects that an experiment of these steps cannot show, by the equations.

    What breaks the equations, a sliding wheel for one, can look like them; they are not candidates. Changed parameters
    are: they are hidden only as long as the parameters are free.
    """
    driven = frozenset(steps)
    done = ["four steps", *(name for name in DIAGNOSTIC if name not in _open(driven))]
    names = {key.partition("@")[0] for key in stored_table()["four steps"]} - set(DRIFTS)
    return frozenset(
        EffectName(name) for name in names if not any(_seen(name, stored_table()[experiment]) for experiment in done)
    )


def _splitting(key: str, rivals: Sequence[str], steps: Collection[str]) -> str | None:
    """Of the experiments not driven yet, the first that leaves none of the rivals alike."""
    for name in _open(steps):
        sight = stored_table()[name].get(key)
        if sight is not None and sight.visible and not set(sight.alike_effects(key.partition("@")[0])) & set(rivals):
            return DIAGNOSTIC[name].advice
    return None


def _showing(invisible: Sequence[str], steps: Collection[str]) -> str | None:
    """Of the experiments not driven yet, the one that shows most of what is invisible."""
    shown = {name: [effect for effect in invisible if _seen(effect, stored_table()[name])] for name in _open(steps)}
    best = max(shown, key=lambda name: len(shown[name]), default=None)
    if best is None or not shown[best]:
        return None
    return f"To see {' and '.join(shown[best])} as well: {DIAGNOSTIC[best].advice}."


def _open(steps: Collection[str]) -> list[str]:
    return [
        name
        for name, experiment in DIAGNOSTIC.items()
        if not all(any(step.startswith(drive.name) for step in steps) for drive in experiment.drives)
    ]


def _seen(effect: str, sights: Mapping[str, Sight]) -> bool:
    return any(sight.visible for key, sight in sights.items() if key.partition("@")[0] == effect)
