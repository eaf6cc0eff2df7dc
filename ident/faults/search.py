"""Every hypothesis by its likelihood: which channels are swapped, negated, scaled or late, in all steps or in one.

Most hypotheses are not even asked: what a step can gain is bounded by its loss as it is, and by the loss of everything
without it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ident.faults.balance import fit_balances
from ident.faults.channels import ALPHA, BETA, GROUPS, TORQUE, Group, Place, pairs, single, whole
from ident.faults.evidence import AS_IS, Evidence
from ident.faults.fault import FaultName
from ident.faults.hypothesis import FREE, Hypothesis, of_torques
from ident.faults.rolling import predicted_steering_rate, rates_of, rolls

Array = NDArray[np.float64]

UNITS: Final = (180 / math.pi, math.pi / 180, 1e3, 1e-3)
"""Factors between units that are mistaken for each other."""

DECADES: Final = 4.0
"""Factors are looked for over so many powers of ten, up and down."""

SURE: Final = math.log(1000)
"""Log odds at which a fault is named; what was searched through comes on top."""

FINALISTS: Final = 8
"""Hypotheses that are compared on everything, best first."""


@dataclass(frozen=True)
class Scored:
    """A hypothesis and the loss that it leaves, its own cost included."""

    hypothesis: Hypothesis
    loss: float


def searched(evidence: Evidence) -> list[Scored]:
    """The best hypotheses of swapped, negated and scaled channels, best first; empty where none can be sure."""
    steps = list(dict.fromkeys(segment.step for segment in evidence.segments))
    count = _count(len(steps))
    least = SURE + math.log(count)
    asked = [
        Scored(hypothesis, evidence.partial_loss(hypothesis) + cost(hypothesis, len(steps)))
        for step in (["", *steps] if len(steps) > 1 else [""])
        for group in GROUPS
        if _may_gain(evidence, group, step) > least
        for hypothesis in _hypotheses(evidence, group, step)
    ]
    asked.sort(key=lambda each: each.loss)
    if not asked or evidence.loss - asked[0].loss < SURE:
        return []
    first = [each.hypothesis for each in asked[:FINALISTS]]
    finalists = first + _of_all_angles(first)
    final = [Scored(each, evidence.loss_without(each) + cost(each, len(steps))) for each in finalists]
    return sorted(final, key=lambda each: each.loss)


def least_gain(evidence: Evidence) -> float:
    """Gain in log likelihood from which a fault is sure, all that is searched through allowed for."""
    return SURE + math.log(_count(len({segment.step for segment in evidence.segments})))


def _count(steps: int) -> int:
    """Hypotheses: swapped pairs, and every channel and group negated, scaled or late; in all steps or one."""
    places = sum(len(group.members) + 1 for group in GROUPS)
    return (sum(len(pairs(group)) for group in GROUPS) + 3 * places) * (steps + 1)


def cost(hypothesis: Hypothesis, steps: int) -> float:
    """Of a free value, and of being confined to one of several steps."""
    return FREE.get(hypothesis.name, 0.0) + (math.log(steps) if hypothesis.step else 0.0)


def _may_gain(evidence: Evidence, group: Group, step: str) -> float:
    """The most that a fault of a group in a step can take from the loss."""
    if group is not TORQUE:
        return sum(rolling.loss(AS_IS) for rolling in evidence.rollings if step in ("", rolling.step))
    others = [balance for balance in evidence.balances if step not in ("", balance.step)]
    if len(others) == len(evidence.balances):
        return 0.0
    without = fit_balances(others, evidence.vehicle.prior, [AS_IS] * len(others)).loss if others else 0.0
    return evidence.fit.loss - without


def _hypotheses(evidence: Evidence, group: Group, step: str) -> Iterator[Hypothesis]:
    places = [*(single(group, column) for column in range(len(group.members))), whole(group)]
    yield from (Hypothesis(FaultName.SWAPPED, place, step) for place in pairs(group))
    yield from (Hypothesis(FaultName.NEGATED, place, step) for place in places)
    yield from (each for place in places for each in _scaled(evidence, place, step))
    if group is TORQUE and not step:
        yield from _scaled(evidence, None, step)


def _of_all_angles(best: Sequence[Hypothesis]) -> list[Hypothesis]:
    """What the encoders alone do not show and looks like a fault of all torques."""
    steps = {each.step for each in best if of_torques(each) and each.place == whole(TORQUE)}
    negated = [Hypothesis(FaultName.NEGATED, whole(BETA), step) for step in steps]
    scaled = [Hypothesis(FaultName.SCALED, whole(BETA), step, unit, 0.01 * unit) for step in steps for unit in UNITS]
    return [each for each in (*negated, *scaled) if each not in best]


def _scaled(evidence: Evidence, place: Place | None, step: str) -> list[Hypothesis]:
    base = Hypothesis(FaultName.SCALED, place, step, 1.0)
    if place is not None and place.group is ALPHA:
        factors = {*_steering_factors(evidence, place, step), *UNITS}
        return [replace(base, value=factor, std=0.01 * factor) for factor in factors]

    def loss(exponent: float) -> float:
        return evidence.partial_loss(replace(base, value=10.0**exponent))

    exponent, std = best_of(loss, DECADES)
    factor = 10.0**exponent
    return [replace(base, value=factor, std=factor * math.log(10) * std)]


def _steering_factors(evidence: Evidence, place: Place, step: str) -> list[float]:
    """Steering rates as recorded over those that the wheels tell, all sides of a place together."""
    recorded, told = 0.0, 0.0
    for segment in evidence.segments:
        if rolls(segment) and step in ("", segment.step):
            rates = rates_of(segment)
            for side in place.columns:
                predicted = predicted_steering_rate(rates, evidence.vehicle.geometry, side)
                recorded += float(rates.steering[:, side] @ predicted)
                told += float(predicted @ predicted)
    return [recorded / told] if recorded > 0 and told > 0 else []


def best_of(loss: Callable[[float], float], reach: float, points: int = 17) -> tuple[float, float]:
    """Minimum of a loss within plus or minus `reach`, and the standard deviation that its curvature gives."""
    grid = np.linspace(-reach, reach, points)
    width = float(grid[1] - grid[0])
    start = float(grid[int(np.argmin([loss(float(each)) for each in grid]))])
    bounds = (start - width, start + width)
    found = minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": width * 1e-3, "maxiter": 24})
    at, step = float(found.x), width * 4e-3
    curvature = (loss(at + step) - 2 * loss(at) + loss(at - step)) / step**2
    return at, 1 / math.sqrt(curvature) if curvature > 0 else math.inf
