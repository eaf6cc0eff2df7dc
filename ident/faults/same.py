"""Effects of the machine that a fault of a record is the same as, whatever is driven."""

from __future__ import annotations

from ident.effects import EFFECTS
from ident.faults.hypothesis import Hypothesis


def same_as(hypothesis: Hypothesis) -> tuple[str, ...]:
    """Names as `effect@place`: a torque is linear in its gain, an encoder that is late has a delay, a wheel that seems
    to turn further is smaller."""
    place = hypothesis.place
    if place is None:
        return ()
    whole = len(place.columns) == len(place.group.members)
    fault = f"{hypothesis.name}@{'every ' if whole else ''}{place.group.name}"
    column = 0 if whole or len(place.columns) != 1 else place.columns[0]
    known = [(kind.name, kind.same_records[fault]) for kind in EFFECTS.values() if fault in kind.same_records]
    return tuple(f"{name}@{places[column]}" for name, places in known if whole or len(place.columns) == 1)
