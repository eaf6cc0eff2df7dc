"""Parameters that no vehicle can have, or not this one, and standard deviations that say too little."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ident.assessment.verdict import Reason, ReasonCode, Verdict
from ident.estimate.result import Estimate, Identification
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

GYRATION: Final = (0.2, 1.0, 1.5)
"""Radius of gyration of the chassis over the half diagonal of its steering axes: below the first and above the second
no usual platform, above the third no body. A uniform plate that just covers the axes has 0.58, all mass at the axes
has 1; more asks for a body that overhangs its axes, and 1.5 for all of the mass at the rim of a body half as large
again.
"""

CONFLICT: Final = 3.0
"""Difference from the prior in standard deviations of both; eleven priors at random exceed it in 3 % of all cases."""

IMPOSSIBLE_FACTOR: Final = 3.0
"""A mass or an inertia in conflict with its prior, and this many times as large or small, is another vehicle's, or of
another scale: both are known from scales and drawings."""

INFLATION: Final = 100.0
"""Standard deviation without the share of B_w, over the naive one; 20 at most on sound campaigns, where friction
fluctuates slowly."""


def value_reasons(identification: Identification, vehicle: VehicleDescription) -> Iterator[Reason]:
    """What speaks against the parameters themselves."""
    for estimate in identification.estimates:
        yield from _sign(estimate)
        yield from _excitation(estimate)
        yield from _inflation(estimate)
        yield from _conflict(estimate, vehicle.prior)
    yield from _gyration(identification, vehicle.geometry)


def _inertial(estimate: Estimate) -> bool:
    return estimate.unit.startswith("kg")


def _sign(estimate: Estimate) -> Iterator[Reason]:
    if estimate.value > 0:
        return
    kind = "mass or inertia" if _inertial(estimate) else "friction"
    certain = _inertial(estimate) or estimate.ci95[1] < 0
    text = (
        f"{estimate.name} = {estimate.value:.4g} ± {estimate.std:.2g} {estimate.unit}: no {kind} is negative or zero. "
        + ("The record or the vehicle file is wrong." if certain else "It cannot be distinguished from zero here.")
    )
    verdict = Verdict.UNUSABLE if certain else Verdict.DOUBTFUL
    yield Reason(ReasonCode.NOT_POSITIVE, estimate.name, estimate.value, 0.0, text, verdict)


def _excitation(estimate: Estimate) -> Iterator[Reason]:
    if estimate.quality != "poor":
        return
    half_width = (estimate.ci95[1] - estimate.ci95[0]) / 2 / estimate.value
    text = f"{estimate.name} is poorly excited: its 95 % interval is ±{100 * half_width:.0f} % of its value."
    yield Reason(ReasonCode.POORLY_EXCITED, estimate.name, half_width, 0.5, text, Verdict.DOUBTFUL)


def _inflation(estimate: Estimate) -> Iterator[Reason]:
    own = math.sqrt(max(estimate.std**2 - estimate.b_w_std**2, 0.0))
    ratio = own / estimate.naive_std if estimate.naive_std > 0 else 0.0
    if ratio <= INFLATION:
        return
    text = (
        f"The standard deviation of {estimate.name} is {ratio:.0f} times that of white residuals: something that "
        "repeats or fluctuates slowly is not in the model."
    )
    yield Reason(ReasonCode.INFLATED_STD, estimate.name, ratio, INFLATION, text, Verdict.DOUBTFUL)


def _conflict(estimate: Estimate, prior: Parameters) -> Iterator[Reason]:
    expected, own = prior[estimate.name], prior.std_of(estimate.name)
    spread = math.hypot(estimate.std, own)
    if not own > 0 or abs(estimate.value - expected) <= CONFLICT * spread:
        return
    distance = abs(estimate.value - expected) / spread
    factor = max(abs(estimate.value) / expected, expected / max(abs(estimate.value), 1e-300)) if expected else math.inf
    impossible = _inertial(estimate) and factor > IMPOSSIBLE_FACTOR
    text = (
        f"{estimate.name} = {estimate.value:.4g} {estimate.unit}, but the vehicle file expects {expected:.4g} ± "
        f"{own:.2g}: {distance:.0f} standard deviations apart. Units, gear ratio and torque constant scale it; "
        "if they are right, so is not the prior."
    )
    verdict = Verdict.UNUSABLE if impossible else Verdict.DOUBTFUL
    yield Reason(ReasonCode.PRIOR_CONFLICT, estimate.name, distance, CONFLICT, text, verdict)


def _gyration(identification: Identification, geometry: Geometry) -> Iterator[Reason]:
    mass, inertia = identification["m_ch"].value, identification["C_ch"].value
    if not (mass > 0 and inertia > 0):
        return
    half_diagonal = math.hypot(geometry.wheelbase, geometry.track_width) / 2
    ratio = math.sqrt(inertia / mass) / half_diagonal
    low, high, impossible = GYRATION
    if low <= ratio <= high:
        return
    limit = low if ratio < low else high
    text = (
        f"C_ch and m_ch ask for a radius of gyration of {ratio * half_diagonal:.3g} m, {ratio:.2f} times the half "
        f"diagonal of the steering axes; platforms have {low:g} to {high:g} of it."
    )
    verdict = Verdict.UNUSABLE if ratio > impossible else Verdict.DOUBTFUL
    yield Reason(ReasonCode.IMPOSSIBLE_INERTIA, "C_ch", ratio, limit, text, verdict)
