"""Balance of forces: how far the torques of a record contradict its motion and what is known of the vehicle.

In every step the generalized torque is linear in the parameters and in the reported torques:

    Theta p = sum_ij c_i M_ij u_j

with c_i the torque per unit of drive i and M what a fault makes of the torques: swapped, negated, scaled. A torque that
is late by t adds t times its derivative. So the moments of Theta, of all c_i u_j and of c_i u'_i, taken once a step,
answer every such question without going through the samples again.

Torques show in a second place: whoever drives a vehicle of four drives lets those that move one coordinate share its
load, so a drive that bears much more or less than its part, or the other sign, stands out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import Processing, differentiate, moving_rows
from ident.faults.rolling import independent_samples, rates_of
from ident.plant import dynamics, kinematics
from ident.records.record import Segment, base_step
from ident.vehicle.geometry import WHEELS, Geometry
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS, Parameters

Array = NDArray[np.float64]

UNMODELLED: Final = 0.1
"""Torque that the model lacks, over the torque, that a sound vehicle may show: the largest effects of the library."""

SHARING: Final = 0.3
"""Deviation of a drive's torque from its part, over the torque, that a sound vehicle may show."""

FREEDOM: Final = 3.0
"""Degrees of freedom of Student's distribution for a prior value: now and then a guess is far off its own std."""

UNSTATED: Final = 0.1
"""Standard uncertainty of a prior value that comes without one, relative to it."""

COUNT: Final = len(PARAMETER_NAMES)
ORDERS: Final = np.array([2 if unit.startswith("kg") else unit.count("s/rad") for unit in PARAMETER_UNITS.values()])
"""Derivative of the angles that a parameter multiplies."""
DRIVES: Final = len(WHEELS)
WHEEL_ROWS: Final = slice(5, 9)
PUNCTUAL: Final = np.zeros(DRIVES)
REWEIGHTED: Final = 8
"""Fits with weights from the one before; more change nothing."""


@dataclass(frozen=True)
class Balance:
    """Moments of one coordinate of one step, over the rows that move.

    Attributes:
        step, coordinate: which.
        moments: (31, 31) of [Theta, c_i u_j, c_i u'_i], i slow.
        torques: (4, 4) moments of the torques over all rows.
        part: (4, 4) projection of torques on the parts of the load, zero where they need not share.
        weight: number of independent samples.
    """

    step: str
    coordinate: str
    moments: Array
    torques: Array
    part: Array
    weight: float

    def unshared(self, mixing: Array) -> float:
        """Mean square of the torques beyond their parts, over theirs [-]."""
        if not np.any(self.part):
            return 0.0
        torques = mixing @ self.torques @ mixing.T
        power = float(np.trace(torques))
        return float(np.trace((np.eye(DRIVES) - self.part) @ torques)) / power if power > 0 else 0.0


@dataclass(frozen=True)
class Fit:
    """How well the torques fit.

    Attributes:
        values: (11,) parameters.
        loss: negative log likelihood, prior included.
        misfit: largest of the steps, root mean square over that of the torque [-].
    """

    values: Array
    loss: float
    misfit: float


def balances_of(segments: Sequence[Segment], geometry: Geometry, processing: Processing) -> list[Balance]:
    """Moments of all steps that the estimator knows, of segments that are smooth already."""
    known = [(segment, base_step(segment.step)) for segment in segments]
    return [
        balance
        for segment, step in known
        if step in ROWS
        for balance in _balances(segment, ROWS[step], geometry, processing)
    ]


def _balances(segment: Segment, spec: RowsOfStep, geometry: Geometry, processing: Processing) -> list[Balance]:
    rates = rates_of(segment)
    twist = kinematics.odometry(rates.alpha, rates.steering, rates.wheels, geometry)
    velocity = np.hstack([twist, rates.steering, rates.wheels])
    acceleration = differentiate(velocity, segment.sample_time)
    torque_rates = differentiate(segment.motor_torques, segment.sample_time)
    if spec.mode is None:
        theta = dynamics.regressor(velocity, acceleration)[:, WHEEL_ROWS]
        per_drive = np.broadcast_to(geometry.gear_ratio * np.eye(DRIVES), (len(segment), DRIVES, DRIVES))
        names = spec.coordinates
    else:
        theta = dynamics.projected_regressor(spec.mode, rates.alpha, velocity, acceleration, geometry)
        per_drive = dynamics.projected_input(spec.mode, rates.alpha, geometry)
        names = kinematics.GENERALIZED_VELOCITIES[spec.mode]
    found = []
    for name in spec.coordinates:
        row = names.index(name)
        joints = [WHEEL_ROWS.start + row] if spec.mode is None else list(spec.joints)
        moving = moving_rows(velocity[:, joints], processing, segment.sample_time)
        if not moving.any():
            continue
        products = per_drive[:, row, :, None] * segment.motor_torques[:, None, :]
        lagging = per_drive[:, row] * torque_rates
        design = np.hstack([theta[:, row], products.reshape(len(segment), -1), lagging])[moving]
        found.append(
            Balance(
                segment.step,
                name,
                design.T @ design / len(design),
                segment.motor_torques.T @ segment.motor_torques / len(segment),
                _part(per_drive[:, row]) if len(spec.coordinates) == 1 else np.zeros((DRIVES, DRIVES)),
                independent_samples(velocity[:, joints], segment.sample_time) * float(np.mean(moving)),
            )
        )
    return found


def _part(per_drive: Array) -> Array:
    """Projection on the smallest torques that move one coordinate, of a posture that is held (N, 4)."""
    direction = np.mean(per_drive, axis=0)
    return np.outer(direction, direction) / float(direction @ direction)


def fit_balances(
    balances: Sequence[Balance],
    prior: Parameters,
    mixings: Sequence[Array],
    *,
    late: Array = PUNCTUAL,
    unmodelled: float = UNMODELLED,
    stretch: float = 1.0,
) -> Fit:
    """Parameters that fit all steps at once, each in proportion to its own misfit, and how likely they are.

    Args:
        balances: of all steps.
        prior: what is known before.
        mixings: (4, 4) a balance, true torques over reported ones.
        late: (4,) lateness of the torques [s], small.
        unmodelled: torque that the model may lack, over the torque.
        stretch: recorded time over true time; rates and accelerations grow with it and with its square.
    """
    moments = _moments(balances, [np.concatenate([mixing.ravel(), late]) for mixing in mixings], stretch**ORDERS)
    misfits = np.full(len(balances), unmodelled**2)
    values, std = prior.values, prior_std(prior)

    def away(found: Array) -> Array:
        return ((found - prior.values) / std) ** 2

    for _ in range(REWEIGHTED):
        precision = (FREEDOM + 1) / (FREEDOM + away(values)) / std**2
        values = _solved(moments, prior.values, precision, misfits)
        misfits = unmodelled**2 + moments.misfits(values)
    triples = zip(balances, mixings, misfits, strict=True)
    loss = sum(
        balance.weight / 2 * (math.log(misfit / unmodelled**2) + math.log1p(balance.unshared(mixing) / SHARING**2))
        for balance, mixing, misfit in triples
    )
    loss += float(np.sum((FREEDOM + 1) / 2 * np.log1p(away(values) / FREEDOM)))
    return Fit(values, loss, math.sqrt(max(float(np.max(misfits, initial=0.0)) - unmodelled**2, 0.0)))


@dataclass(frozen=True)
class _Moments:
    """Of all balances, over the power of the generalized torque as it is told; zero where that has none.

    Attributes:
        theta: (B, 11, 11) of the parameters' columns, stretched.
        crossed: (B, 11) of those with the torque.
        weights: (B,) numbers of independent samples.
    """

    theta: Array
    crossed: Array
    weights: Array

    def misfits(self, values: Array) -> Array:
        """(B,) mean squares of what parameters (11,) leave of the torque, over the torque's [-]."""
        return np.maximum(self.theta @ values @ values - 2 * self.crossed @ values + 1, 0.0)


def _moments(balances: Sequence[Balance], told: Sequence[Array], columns: Array) -> _Moments:
    """With weights (20,) of the torques and their rates for each, and factors (11,) on the parameters' columns."""
    weights = np.array([balance.weight for balance in balances])
    told_by, size = DRIVES**2 + DRIVES, len(balances)
    whole = np.array([balance.moments for balance in balances]).reshape(size, COUNT + told_by, COUNT + told_by)
    torques = np.array(told).reshape(size, told_by, 1)
    crossed = (whole[:, :COUNT, COUNT:] @ torques)[..., 0] * columns
    powers = (np.swapaxes(torques, 1, 2) @ whole[:, COUNT:, COUNT:] @ torques)[:, 0, 0]
    over = np.divide(1.0, powers, out=np.zeros(size), where=powers > 0)
    theta = whole[:, :COUNT, :COUNT] * np.outer(columns, columns)
    return _Moments(theta * over[:, None, None], crossed * over[:, None], weights)


def _solved(moments: _Moments, known: Array, precision: Array, misfits: Array) -> Array:
    """Least squares with every balance weighted by its misfit, about values (11,) known so precisely before."""
    scales = moments.weights / misfits
    normal = np.diag(precision) + np.einsum("b,bij->ij", scales, moments.theta)
    right = known * precision + scales @ moments.crossed
    root = 1 / np.sqrt(np.diag(normal))
    scaled, wanted = normal * root * root[:, None], root * right
    # Where nothing but the prior tells a combination it may drown in rounding: least norm then.
    found = np.linalg.lstsq(scaled, wanted, rcond=None)[0]
    if np.any(found < 0):
        # Masses, inertias and frictions are not negative, and torques of the wrong sign must not make them so.
        powers, turn = np.linalg.eigh(scaled)
        half = np.sqrt(np.maximum(powers, np.finfo(float).eps * powers[-1]))
        found = nnls(half[:, None] * turn.T, (turn.T @ wanted) / half)[0]
    return np.asarray(root * found)


def prior_std(prior: Parameters) -> Array:
    """Standard uncertainties (11,) of the prior, of every value one."""
    least = UNSTATED * np.maximum(np.abs(prior.values), np.finfo(float).tiny)
    return np.where(prior.std > 0, prior.std, least)
