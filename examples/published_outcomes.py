"""What is expected of a published record, and how an answer of the diagnosis compares with it."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from ident.diagnosis.diagnosis import Diagnosis, NamedEffect

NONE: Final = "none"
"""Expected where no law closes anything worth a name."""

GRAVITY: Final = ("com_offset", "gravity_load", "law angle", "law other_axis")
"""What gravity is called, over the own angle or a sum with others."""
PERIODIC: Final = ("torque_ripple", "law angle")
SPEED: Final = ("stribeck", "quadratic_drag", "law rate")
TIME: Final = ("friction_warming", "law time x direction")
INERTIA: Final = ("inertia_position", "law angle x acceleration")
ASYMMETRY: Final = ("asymmetric_viscous", "law rate")
FRICTION_ANGLE: Final = ("friction_position", "law angle x direction")

VARIABLES: Final[Mapping[str, str]] = {
    "asymmetric_viscous": "rate",
    "stribeck": "rate",
    "quadratic_drag": "rate",
    "com_offset": "angle",
    "gravity_load": "angle",
    "torque_ripple": "angle",
    "friction_position": "angle",
    "inertia_position": "angle",
    "friction_load": "load",
    "friction_warming": "time",
    "presliding": "path_since_reversal",
    "time_delay": "load_rate",
    "torque_filter": "load_rate",
    "elasticity": "load_second_rate",
    "law other_axis": "angle",
}
"""What a cause depends on; a law says it itself."""


class Outcome(enum.Enum):
    """How an answer compares with what was expected."""

    RIGHT = "right"
    SET = "in its set"
    VARIABLE = "right variable"
    UNKNOWN = "unknown"
    MISSED = "missed"
    REFUSED = "refused"
    WRONG = "wrong"


@dataclass(frozen=True)
class Row:
    """One diagnosis.

    Attributes:
        machine: of `MACHINES`.
        title: which part of it.
        axes: of the record.
        fit, confirm: files below the folder of the repository; none that confirm: a part of the others does.
        cutoff: of the low pass of the independent analysis [Hz].
        expected: by place, causes that are right.
        closed: by place, share of the held-out gap that the best law closed in the independent analysis.
    """

    machine: str
    title: str
    axes: tuple[str, ...]
    fit: tuple[str, ...]
    confirm: tuple[str, ...]
    cutoff: float
    expected: Mapping[str, tuple[str, ...]]
    closed: Mapping[str, float]


def cause_of(effect: NamedEffect) -> str:
    """A name, or the word law and what it is a function of."""
    if effect.law is None:
        return effect.name
    return f"law {effect.law.variable}" + (f" x {effect.law.partner}" if effect.law.partner else "")


def _alike(effect: NamedEffect) -> list[str]:
    """The cause, and laws of what the records do not tell from its variable."""
    return [cause_of(effect), *(f"law {other.variable}" for other in effect.alternatives if other.variable)]


def _variable(cause: str) -> str:
    return VARIABLES.get(cause, cause.removeprefix("law ").partition(" x ")[0])


def _expected_of(row: Row, effect: NamedEffect) -> frozenset[str]:
    return frozenset(row.expected.get(effect.where.partition("<")[0], ()))


def outcome_of(row: Row, diagnosis: Diagnosis) -> Outcome:
    """The cause that closes most of the gap, against what was expected of its place."""
    if not diagnosis.verdict.explains:
        nothing = all(NONE in causes for causes in row.expected.values())
        said = Outcome.UNKNOWN if diagnosis.verdict.value == "unknown" else Outcome.MISSED
        return Outcome.RIGHT if nothing and said is Outcome.MISSED else said
    strongest = max(diagnosis.effects, key=lambda effect: effect.gap_closed_held_out)
    cause, expected = cause_of(strongest), _expected_of(row, strongest)
    if cause in expected:
        return Outcome.RIGHT
    if not expected.isdisjoint(_alike(strongest)):
        return Outcome.SET
    return Outcome.VARIABLE if _variable(cause) in map(_variable, expected) else Outcome.WRONG


def words(row: Row, diagnosis: Diagnosis) -> str:
    """The verdict, and its causes with what each closes, strongest first."""
    effects = sorted(diagnosis.effects, key=lambda effect: -effect.gap_closed_held_out)
    told = [
        f"{' or '.join(_alike(e))}@{e.where} {e.gap_closed_held_out:.2f}"
        + (" (not expected)" if _expected_of(row, e).isdisjoint(_alike(e)) else "")
        for e in effects
    ]
    return f"{diagnosis.verdict}: {', '.join(told)}" if told else str(diagnosis.verdict)
