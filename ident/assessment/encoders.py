"""Encoders against each other: each reading beside what the others and the geometry say that it should be.

A step moves one generalized velocity s, and (4) gives the rate of every encoder, z_c = d_c s. Without channel c the
others still give s, hence ẑ_c = d_c Σ d_i z_i / Σ d_i², i ≠ c. The slope of z_c over ẑ_c is one when wheels roll,
angles are what they are said to be, and the geometry is that of the vehicle. A slope that is off by e moves s by e
times the weight d_c² / Σ d_i² of the channel, or by e itself where s is the steering that the channel reads, and the
inertia that the step shows by as much; where that is more than the interval of the inertia, the interval does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.assessment.verdict import Reason, ReasonCode, Verdict
from ident.estimate.equations import ROWS, motion_of
from ident.estimate.filters import Processing
from ident.estimate.identify import FIT_STEPS, INERTIAL
from ident.estimate.result import Identification
from ident.plant import kinematics
from ident.records.record import Record, Segment, Step
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

CHANNELS: Final = ("alpha_l", "alpha_r", *(f"beta_{wheel}" for wheel in WHEELS))

IMPOSSIBLE: Final = 0.2
"""Slope this far from one: no wear, slip or tyre does that; a sign, a unit, a gear ratio or another channel does."""

SMALLEST: Final = 0.002
"""Slope this near to one is not doubted: a fifth of a millimetre of a wheel of 0.1 m."""

MOVES: Final = 0.02
"""A channel takes part in a step if its expected rate has this share of the largest one, rms."""

_RATES: Final = 3
"""Where the encoder rates begin in q̇: after the twist."""

_SHOWN: Final = {step: name for name, step in INERTIAL.items()} | {Step.LATERAL: "m_ch"}
"""The inertia that a step shows."""


@dataclass(frozen=True)
class Slope:
    """One channel in one step.

    Attributes:
        step, channel: which.
        slope: of the measured over the expected rate [-].
        weight: of the channel in the generalized velocity [-].
    """

    step: Step
    channel: str
    slope: float
    weight: float


def slopes(segment: Segment, geometry: Geometry, processing: Processing) -> list[Slope]:
    """Slopes of the channels that a step of the fit moves; none of other steps, nor where nothing moves."""
    if segment.step not in FIT_STEPS:
        return []
    step = Step(segment.step)
    mode, (coordinate,) = ROWS[step].mode, ROWS[step].coordinates
    assert mode is not None
    motion = motion_of(segment, geometry, processing)
    column = kinematics.GENERALIZED_VELOCITIES[mode].index(coordinate)
    direction = kinematics.complement(mode, motion.alpha, geometry)[:, _RATES:, column]
    return _slopes(step, coordinate, motion.rates[:, _RATES:], direction)


def _slopes(step: Step, coordinate: str, rates: Array, direction: Array) -> list[Slope]:
    """From encoder rates and the direction (N, 6) in which the step moves them."""
    products, squares = direction * rates, direction**2
    others = (products.sum(axis=1, keepdims=True) - products) / (squares.sum(axis=1, keepdims=True) - squares)
    expected = direction * others
    size = np.sqrt(np.mean(expected**2, axis=0))
    weight = np.mean(squares / squares.sum(axis=1, keepdims=True), axis=0)
    return [
        Slope(
            step,
            name,
            slope=float(rates[:, index] @ expected[:, index] / np.sum(expected[:, index] ** 2)),
            weight=1.0 if name == coordinate else float(weight[index]),
        )
        for index, name in enumerate(CHANNELS)
        if size.max() > 0 and size[index] > MOVES * size.max()
    ]


def encoder_reasons(record: Record, identification: Identification, geometry: Geometry) -> Iterator[Reason]:
    """The channel of each step that fits least to the others, where that matters."""
    for segment in record.segments:
        found = slopes(segment, geometry, identification.processing)
        if found:
            worst = max(found, key=lambda one: abs(one.slope - 1) * one.weight)
            yield from _reason(worst, identification)


def _reason(worst: Slope, identification: Identification) -> Iterator[Reason]:
    estimate = identification[_SHOWN[worst.step]]
    error = abs(worst.slope - 1)
    half_width = (estimate.ci95[1] - estimate.ci95[0]) / 2 / max(abs(estimate.value), np.finfo(float).tiny)
    limit = max(SMALLEST, half_width / worst.weight)
    impossible = error > IMPOSSIBLE
    if error <= limit and not impossible:
        return
    text = (
        f"In {worst.step}, {worst.channel} moves {worst.slope:.4g} times as far as the other encoders and the geometry "
        f"say, which moves {estimate.name} by more than its interval. "
        + ("No wear or slip does that: look at sign, unit, order and gear ratio." if impossible else _WORN)
    )
    verdict = Verdict.UNUSABLE if impossible else Verdict.DOUBTFUL
    yield Reason(ReasonCode.ENCODERS_DISAGREE, worst.channel, error, min(limit, IMPOSSIBLE), text, verdict)


_WORN: Final = "A wheel slips or is worn, an encoder is not what it is taken for, or a length is wrong."
