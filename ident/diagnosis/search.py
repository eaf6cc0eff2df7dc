"""The search for causes: one at a time, in pairs where none helps alone, each confirmed before it counts.

The order of the steps is what keeps false alarms down (see docs/gap.md): whiten, compare with surrogates over all
candidates at once, confirm on rows that took no part in the fit, then look at every effect found again, the others
given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ident.diagnosis.pairs import best_pair
from ident.diagnosis.regression import Regression, Slot, Whole
from ident.diagnosis.settings import Settings
from ident.diagnosis.whitening import Whitening


@dataclass(frozen=True)
class Taken:
    """Effects that an answer consists of.

    Attributes:
        variants: of them.
        whitener: of what they leave.
    """

    variants: tuple[int, ...]
    whitener: Whitening


@dataclass(frozen=True)
class Found(Taken):
    """What the search ends with.

    Attributes:
        slots: what may stand in the place of each one taken, the others given.
        rest: what may stand beside them.
    """

    slots: tuple[Slot, ...]
    rest: Slot


def extended(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    """One effect or pair more, and every effect in doubt again; those taken where nothing more is believed."""
    if len(taken) >= regression.settings.most:
        return taken
    grown = _grown(regression, taken)
    if grown == taken:
        return taken
    revised = settled(regression, grown)
    return taken if set(revised) <= set(taken) else revised


def concluded(regression: Regression, taken: tuple[int, ...]) -> Found:
    """What can be said of effects that are taken."""
    whitener = regression.whitener(taken)
    slots = tuple(regression.slot(without(taken, index), whitener) for index in range(len(taken)))
    return Found(taken, whitener, slots, regression.slot(taken, whitener))


def _grown(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    settings = regression.settings
    slot = regression.slot(taken, regression.whitener(taken))
    if not slot.variants:
        return taken
    best, evidence = slot.variants[0], slot.evidence
    if _believed(slot, best, settings, alone=not taken):
        return (*taken, best)
    if len(taken) + 2 > settings.most:
        return taken
    pair = best_pair(evidence, regression.owners, len(regression.rows))
    if pair is None or pair.significance > settings.pair_level or pair.log_evidence < evidence.log_evidence[best]:
        return taken
    return (*taken, pair.first, pair.second)


def _believed(slot: Slot, variant: int, settings: Settings, *, alone: bool) -> bool:
    """Larger than chance over all candidates, seen in the fit, and confirmed."""
    evidence, least = slot.evidence, settings.least if alone else settings.beside
    large = evidence.log_evidence[variant] > least and evidence.significance <= settings.level
    return bool(large and slot.seen[variant])


def settled(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    """Replace what another candidate explains better, drop what the others make superfluous, until nothing changes."""
    for _ in range(2 * len(taken)):
        changed = _revised(regression, joined(regression, taken, regression.wholes))
        if changed == taken:
            break
        taken = changed
    return taken


def _revised(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    whitener = regression.whitener(taken)
    for index, variant in enumerate(taken):
        slot = regression.slot(without(taken, index), whitener)
        best = slot.variants[0] if slot.variants else variant
        log_evidence = slot.evidence.log_evidence
        if log_evidence[best] > log_evidence[variant] + regression.settings.lead:
            return (*taken[:index], best, *taken[index + 1 :])
        if not _believed(slot, variant, regression.settings, alone=len(taken) == 1):
            return without(taken, index)
    return taken


def joined(regression: Regression, taken: tuple[int, ...], wholes: Sequence[Whole]) -> tuple[int, ...]:
    """One cause for several where it alone is all of them, in whatever shape they are."""
    owners = [regression.owners[variant] for variant in taken]
    for whole, several in wholes:
        if several <= set(owners):
            first = min(owners.index(owner) for owner in several)
            others = [(place, variant) for place, variant in enumerate(taken) if owners[place] not in several]
            return tuple(variant for _, variant in sorted([*others, (first, whole)]))
    return taken


def without(taken: tuple[int, ...], index: int) -> tuple[int, ...]:
    """All variants taken but one."""
    return (*taken[:index], *taken[index + 1 :])
