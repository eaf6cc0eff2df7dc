"""Who loses a place in the best set."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from ident.diagnosis.answer.standing import OPEN, Standing
from ident.diagnosis.check.against import deviations_against
from ident.diagnosis.check.remainder import mostly_tolerated
from ident.diagnosis.check.sized import ITS_OWN, SURELY, is_alone, is_foreign, is_sizeless
from ident.diagnosis.evidence.state import State
from ident.diagnosis.law.answer import curve_of
from ident.diagnosis.search.search import Search

DOUBTED: Final = 0.5
"""Probability of nothing in its place, or of what has lost it, from which a member is none."""

EXACT: Final = 0.01
"""Share of the held-out gap that a member must close beside others, whose columns are exact to about as much."""

PAID: Final = 0.05
"""Log of what is above the noise that a member must gain beside greater ones, if it closes less than is exact."""


def better(standing: Standing) -> tuple[Search, State] | None:
    """The search and its set without members that are no answer; None: all are.

    Less likely there than nothing or than a rival, a trifle, of no size, what confirming rows speak against, or making
    no difference.
    """
    search, members = standing.search, standing.state.members
    # The search, in whose other places something else stood, would take again what is doubted.
    if doubted := _doubted(standing):
        return _without(standing, doubted, search.passing_over(doubted, members))
    if (corrected := _corrected(standing)) is not None:
        return corrected
    # What follows asks for exact refits, which a set that loses a member before is not worth.
    if trifling := _trifling(standing):
        return _without(standing, trifling, search.passing_over(trifling, members))
    if contradicted := _contradicted(standing):
        return _without(standing, contradicted, search.refuting(contradicted))
    if vain := _closing_least(standing, _sizeless(standing) or _needless(standing)):
        # What trades for another has no size beside it and closes nothing more, and may be what is there.
        return _without(standing, vain, search.refuting(vain, members))
    return None


def _without(standing: Standing, lost: Sequence[int], search: Search) -> tuple[Search, State]:
    """The search and its set without members that have lost their places."""
    left = {index: one for index, one in standing.state.members.items() if index not in lost}
    return search, search.further(search.fitter.state(left, standing.state))


def _corrected(standing: Standing) -> tuple[Search, State] | None:
    """With the rival that is most ahead of a member in its place, evidence tempered; None: none is.

    What has lost a place to another once does not get it back.
    """
    ahead = {index: slot.ahead(standing.search.barred) for index, slot in standing.slots.items()}
    places = [(*one, index) for index, one in ahead.items() if one is not None]
    if not places:
        return None
    _, rival, index = max(places)
    search = standing.search.passing_over([index], standing.state.members)
    return search, search.further(standing.slots[index].rivals[rival])


def _doubted(standing: Standing) -> list[int]:
    """The member that is least likely to be there, if that is less likely than not.

    Or a law that the fitted rows do not show by themselves, which is not among those taken.
    """
    lost = {index: slot.lost(standing.search.stands_for(index)) for index, slot in standing.slots.items()}
    doubted = [index for index in lost if lost[index] > DOUBTED or index not in standing.taken.variants]
    return sorted(doubted, key=lambda index: -lost[index])[:1]


def _sizeless(standing: Standing) -> list[int]:
    """Places of all members that are of no size of their own."""
    return [place for place in range(standing.fitted.count) if not _has_size(standing, place)]


def _trifling(standing: Standing) -> list[int]:
    """All members that are no more than what is tolerated, or laws that are nowhere surely not zero."""
    taken = enumerate(standing.taken.variants)
    return [index for place, index in taken if _is_tolerated(standing, place) or not _is_sure(standing, index)]


def _is_sure(standing: Standing, index: int) -> bool:
    """Whether a law is surely not zero somewhere; a name says so by its size."""
    law = standing.taken.laws.get(index)
    if law is None:
        return True
    _, y, std = curve_of(law).T
    return bool(np.any(np.abs(y) > SURELY * std))


def _is_tolerated(standing: Standing, place: int) -> bool:
    """Whether a member is no more than what a model may have wrong in all rows in which it acts."""
    reached, blocks = standing.fitted.reached_by(place), [block for block, _ in standing.fitted.rows.blocks]
    acting = [pair for pair in zip(blocks, standing.fitted.floors.tolist(), strict=True) if pair[0].label in reached]
    return all(mostly_tolerated(*pair) for pair in acting) and standing.fitted.lacking[place] <= 0


def _contradicted(standing: Standing) -> list[int]:
    """The member that the confirming rows, to which nothing is fitted, surely speak against, and most."""
    fitted = standing.fitted
    scatter = standing.search.fitter.excess(standing.state, ~fitted.rows.confirming)
    found = zip(standing.taken.variants, deviations_against(fitted).tolist(), strict=True)
    against = {index: deviations / math.sqrt(scatter[index]) for index, deviations in found}
    surely = [index for index, one in against.items() if one > ITS_OWN]
    return sorted(surely, key=lambda index: -against[index])[:1]


def _needless(standing: Standing) -> list[int]:
    """Places of members that close next to nothing beside others, or where there is a gap to close."""
    trifles = [place for place in range(standing.fitted.count) if not _pays(standing, place)]
    return trifles if standing.fitted.count > 1 or standing.is_measurable else []


def _closing_least(standing: Standing, places: Sequence[int]) -> list[int]:
    """That one of some members."""
    members = tuple(standing.taken.variants)
    return [members[place] for place in sorted(places, key=standing.fitted.lacking.__getitem__)[:1]]


def _pays(standing: Standing, place: int) -> bool:
    """Whether a member closes what its columns are exact to, or much of what a greater one leaves."""
    return standing.fitted.lacking[place] >= EXACT or standing.fitted.gain(place) >= PAID


def _has_size(standing: Standing, place: int) -> bool:
    """Whether the numbers are of the effect's family, and the size is surely not zero, and its own.

    Numbers that trade for each other, as a friction and the speed at which it falls off, have wide deviations each:
    an effect of the family without which most of the held-out gap stays is surely not zero.
    """
    candidate, part = standing.fitted.candidate(place), standing.fitted.after.parts[place]
    if is_foreign(candidate, part):
        return False
    if not is_sizeless(candidate, part):
        return True
    return is_alone(part) and standing.is_measurable and standing.fitted.lacking[place] > OPEN
