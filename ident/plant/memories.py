"""Which parts of a vehicle have states of their own: springs, delays, filters, bristles, what depends on time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import methodcaller

from ident.plant.bristles import bristles_of
from ident.plant.places import DRIVES, ENCODERS, STEERING
from ident.plant.symbolic import Expression
from ident.plant.terms import Joint, Term

_COMPLIANCES, _GAPS, _DELAYS, _LAGS = (methodcaller(name) for name in ("compliances", "gaps", "delays", "lags"))


@dataclass(frozen=True)
class Memories:
    """Parts with states of their own, in the order of the states.

    Attributes:
        couplings: steering sides (0 left, 1 right) whose rear unit hangs on the front one by a spring.
        gears: wheels (0 to 3) whose motor turns on its own.
        drives: wheels whose torque acts later.
        encoders: steering sides whose angle is reported later.
        lags: wheels whose torque follows as a filter of first order does.
        bristles: joints whose friction bends bristles before it slides.
        elapsed: whether something depends on the time since the start of the campaign.
    """

    couplings: tuple[int, ...]
    gears: tuple[int, ...]
    drives: tuple[int, ...]
    encoders: tuple[int, ...]
    lags: tuple[int, ...]
    bristles: tuple[Joint, ...]
    elapsed: bool

    @property
    def flexible(self) -> bool:
        """Whether there is a spring."""
        return bool(self.couplings or self.gears)


def memories_of(terms: Sequence[Term]) -> Memories:
    """What some additions have states for."""

    def places(where: Sequence[str], *told: Callable[[Term], Mapping[str, Expression]]) -> tuple[int, ...]:
        found = {place for term in terms for tell in told for place in tell(term)}
        return tuple(index for index, place in enumerate(where) if place in found)

    return Memories(
        couplings=places(STEERING, _COMPLIANCES, _GAPS),
        gears=places(DRIVES, _COMPLIANCES, _GAPS),
        drives=places(DRIVES, _DELAYS),
        encoders=places(ENCODERS, _DELAYS),
        lags=places(DRIVES, _LAGS),
        bristles=tuple(bristles_of(terms)),
        elapsed=any(term.takes_time for term in terms),
    )
