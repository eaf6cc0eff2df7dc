"""What an assessment says: a verdict, and the reasons that led to it."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass


class Verdict(enum.StrEnum):
    """What a result is worth, best first."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    UNUSABLE = "unusable"


class ReasonCode(enum.StrEnum):
    """Why a result is not good; faults of the record bear their own names beside these."""

    NOT_POSITIVE = "not_positive"
    IMPOSSIBLE_INERTIA = "impossible_inertia"
    PRIOR_CONFLICT = "prior_conflict"
    POORLY_EXCITED = "poorly_excited"
    INFLATED_STD = "inflated_std"
    BEYOND_STOPS = "beyond_stops"
    BEYOND_MOTOR_SPEED = "beyond_motor_speed"
    BEYOND_PEAK_TORQUE = "beyond_peak_torque"
    WRONG_POSTURE = "wrong_posture"
    ENCODERS_DISAGREE = "encoders_disagree"
    DOES_NOT_FIT = "does_not_fit"
    MODEL_ERROR = "model_error"
    REPEATS_DIFFER = "repeats_differ"
    HELD_OUT = "held_out"


@dataclass(frozen=True)
class Reason:
    """One finding that speaks against a result.

    Attributes:
        code: a `ReasonCode`, or the name of a fault of the record.
        channel: what it was found in: a parameter, a channel of the record, or `step.coordinate`.
        value, limit: what was found and what is tolerated, in the same unit.
        text: one sentence for people.
        verdict: what this finding alone makes of the result.
    """

    code: str
    channel: str
    value: float
    limit: float
    text: str
    verdict: Verdict


@dataclass(frozen=True)
class Assessment:
    """Reasons in order of weight; none make a result good."""

    reasons: tuple[Reason, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The gravest of all reasons."""
        order = list(Verdict)
        return max((reason.verdict for reason in self.reasons), key=order.index, default=Verdict.GOOD)


def assessment_of(reasons: Iterable[Reason]) -> Assessment:
    """An assessment with the gravest reasons first, otherwise in the order given."""
    order = list(Verdict)
    return Assessment(tuple(sorted(reasons, key=lambda reason: -order.index(reason.verdict))))
