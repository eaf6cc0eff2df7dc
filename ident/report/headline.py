"""The first line of an answer: the cause in words with its number, and what it leaves of the worst held-out step."""

from __future__ import annotations

import string
from collections.abc import Sequence
from types import MappingProxyType
from typing import Final

from ident.diagnosis.diagnosis import Diagnosis, NamedEffect, Unseen, Verdict
from ident.diagnosis.vehicle.unseen import LANE_CHANGE, REPEATED
from ident.effects import EFFECTS
from ident.report.digits import percent, plain, quantity_text, significant
from ident.report.law_text import law_words

ABOVE: Final = 1.5
"""Times the noise from which a held-out step is said to be unexplained."""

SOME: Final = 0.01
"""Share of a gap that must be closed to be spoken of."""

MOST_CAUSES: Final = 2
"""That are put into words; the others are counted."""

STEPS: Final = MappingProxyType({REPEATED: "the held-out steps", LANE_CHANGE: "the lane change"})

CHANNELS: Final = MappingProxyType(
    {"kinematic": "rolling constraints", "dynamic": "torques", "outcome": "simulated motions"}
)

_CORNERS: Final = MappingProxyType({"fl": "front left", "rl": "rear left", "fr": "front right", "rr": "rear right"})

_GROUPS: Final = MappingProxyType(
    {
        "chassis": "vehicle",
        "wheels": "all wheels",
        "drives": "all drives",
        "steering": "both steering units",
        "encoders": "both steering encoders",
    }
)

_NONE: Final = "Nothing is missing: what is left is noise, as far as these records can tell."
_NONE_REPEATS: Final = "Nothing is missing in the steps that repeat."
_UNKNOWN: Final = "Something is missing that the library has no name for."


def headline(diagnosis: Diagnosis) -> str:
    """One or two sentences, the number in them.

    Neither that nothing is missing nor that a gap is closed is said over a held-out step above its noise.

    Args:
        diagnosis: the answer.
    """
    worst = worst_left(diagnosis.unseen)
    left = worst is not None and worst.gap.after > ABOVE
    if diagnosis.verdict is Verdict.NONE:
        return _nothing(worst if left else None)
    if diagnosis.verdict is Verdict.UNKNOWN:
        return _UNKNOWN if worst is None or not left else f"{_UNKNOWN} {_at_noise(worst)}."
    return f"{_causes(diagnosis.effects)} {_explained(diagnosis, worst if left else None)}"


def worst_left(unseen: Sequence[Unseen]) -> Unseen | None:
    """The step and channel that is furthest above its noise with the causes in the model."""
    return max(unseen, key=lambda one: one.gap.after, default=None)


def effect_words(effect: NamedEffect) -> str:
    """A cause in words, with its numbers and without its place."""
    if effect.law is not None:
        return law_words(effect.law)
    numbers = {name: quantity_text(one.value, one.std, one.unit) for name, one in effect.parameters.items()}
    kind = EFFECTS.get(effect.name)
    if kind is not None and _fields(kind.words) <= numbers.keys():
        return kind.words.format_map(numbers)
    return f"{plain(effect.name)}, {', '.join(f'{plain(name)} {text}' for name, text in numbers.items())}"


def place_words(where: str) -> str:
    """A place of the vehicle, or of an axis, as people say it."""
    kind, _, corner = where.partition("_")
    if corner in _CORNERS:
        return f"{_CORNERS[corner]} {kind}"
    return _GROUPS.get(where, where if where.startswith(("d_", "m_", "C_", "B_")) else plain(where))


def _causes(effects: Sequence[NamedEffect]) -> str:
    texts = [f"{place_words(one.where)}: {effect_words(one)}{_elsewhere(one)}" for one in effects[:MOST_CAUSES]]
    more = len(effects) - MOST_CAUSES
    text = "; ".join(texts) + (f"; and {more} more" if more > 0 else "")
    return f"{text[:1].upper()}{text[1:]}."


def _elsewhere(effect: NamedEffect) -> str:
    """Where else it may be, by numbers of its own there."""
    places = [place_words(where) for where in effect.elsewhere]
    if not places:
        return ""
    where = places[0] if len(places) == 1 else f"one of {len(places)} other places"
    return f" (or it is at {where}, by another number)"


def _explained(diagnosis: Diagnosis, left: Unseen | None) -> str:
    subject = "It explains" if len(diagnosis.effects) == 1 else "They explain"
    gap, closed = diagnosis.gap, percent(min(max(diagnosis.gap.closed, 0.0), 1.0))
    if left is not None:
        best = max((one for one in diagnosis.unseen if one.steps == left.steps), key=_power_closed)
        if best.gap.closed < SOME:
            return (
                f"{subject} {closed} of the gap of the other steps. But {_at_noise(left)}, and that has no cause yet."
            )
        size = f"at {significant(left.gap.after, 2)} times the noise, and that has no cause yet"
        rest = f"they stay {size}" if best is left else f"its {CHANNELS[left.channel]} stay {size}"
        of = f"the {CHANNELS[best.channel]} of {STEPS[best.steps]}"
        return f"{subject} {percent(best.gap.closed)} of the gap of {of}; {rest}."
    if gap.after > ABOVE:
        return f"{subject} {closed} of the gap; {significant(gap.after, 2)} times the noise are left without a cause."
    return f"{subject} {closed} of the gap; what is left is noise."


def _power_closed(one: Unseen) -> float:
    return one.gap.before**2 - one.gap.after**2


def _nothing(left: Unseen | None) -> str:
    if left is None:
        return _NONE
    if left.steps == LANE_CHANGE:
        return f"{_NONE_REPEATS} But {_at_noise(left)}, and that has no cause yet."
    return f"No cause was found, but {_at_noise(left)}."


def _at_noise(left: Unseen) -> str:
    size = significant(left.gap.after, 2)
    return f"the {CHANNELS[left.channel]} of {STEPS[left.steps]} are at {size} times the noise"


def _fields(words: str) -> frozenset[str]:
    return frozenset(name for _, name, _, _ in string.Formatter().parse(words) if name)
