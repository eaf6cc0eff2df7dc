"""Channels that are late: the encoders against each other, the torques against the motion.

Lateness is small against what a vehicle may lack, so steps are weighed by their own misfit here, down to a floor. A
lateness that is the same in all steps and that takes nearly all of what does not fit is one of the clock; a compliance
or friction leaves most of it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.faults.balance import DRIVES, fit_balances
from ident.faults.channels import ALPHA, BETA, TORQUE, Place, single, whole
from ident.faults.evidence import AS_IS, Evidence
from ident.faults.fault import FaultName
from ident.faults.hypothesis import Hypothesis
from ident.faults.search import Scored, best_of, cost, least_gain

Array = NDArray[np.float64]

FINE: Final = 0.01
"""Misfit below which a step is as good as it gets, root mean square."""

FARTHEST: Final = 0.25
"""Lateness that is looked for at once [s]; what is later is found by and by."""

ITERATIONS: Final = 6
"""Undone and looked for again at most so often: columns of lateness are tangents."""

SETTLED: Final = 2e-4
"""Change from which it is looked for no more [s]."""

PLACES: Final = (
    whole(TORQUE),
    *(single(group, column) for group in (TORQUE, BETA, ALPHA) for column in range(len(group.members))),
    whole(BETA),
    whole(ALPHA),
)


def latest(evidence: Evidence) -> list[Scored]:
    """Late channels by their loss, best first; empty where none gains enough to be sure."""
    base, least = fine_loss(evidence), least_gain(evidence)
    first = [_first(evidence, place) for place in PLACES]
    promising = [each for each in first if base - each.loss > least]
    promising.sort(key=lambda each: each.loss)
    found = [_refined(evidence, each.hypothesis) for each in promising[:3]]
    return sorted((each for each in found if base - each.loss > least), key=lambda each: each.loss)


def fine_loss(evidence: Evidence, place: Place | None = None, late: float = 0.0) -> float:
    """Negative log likelihood, every step by its own misfit, with a channel so late undone by its tangent."""
    torques, angles = np.zeros(DRIVES), np.zeros(DRIVES + len(ALPHA.members))
    if place is not None and place.group is TORQUE:
        torques[list(place.columns)] = late
    elif place is not None:
        angles[[column + (DRIVES if place.group is ALPHA else 0) for column in place.columns]] = late
    mixings = [AS_IS] * len(evidence.balances)
    fit = fit_balances(evidence.balances, evidence.vehicle.prior, mixings, late=torques, unmodelled=FINE)
    slid = ((rolling.weight, rolling.misfit(AS_IS, angles)) for rolling in evidence.rollings)
    return fit.loss + sum(weight / 2 * math.log1p(misfit / FINE**2) for weight, misfit in slid)


def _first(evidence: Evidence, place: Place) -> Scored:
    def loss(late: float) -> float:
        return fine_loss(evidence, place, late)

    late, std = best_of(loss, FARTHEST, points=11)
    hypothesis = Hypothesis(FaultName.LATE, place, "", late, std)
    return Scored(hypothesis, loss(late) + cost(hypothesis, 1))


def _refined(evidence: Evidence, hypothesis: Hypothesis) -> Scored:
    """Undone, and looked for in what is left, until nothing is."""
    for _ in range(ITERATIONS):
        after = evidence.without(hypothesis)
        rest = _first(after, hypothesis.place) if hypothesis.place is not None else None
        if rest is None or abs(rest.hypothesis.value) < SETTLED:
            break
        value = hypothesis.value + rest.hypothesis.value
        hypothesis = replace(hypothesis, value=value, std=rest.hypothesis.std)
    return Scored(hypothesis, fine_loss(evidence.without(hypothesis)) + cost(hypothesis, 1))
