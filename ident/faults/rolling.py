"""Wheels that roll: how far the encoders of a record contradict each other and the geometry.

Eight rolling constraints stand against three velocities of the chassis: wheel and steering angles predict each other.
What no velocity of the chassis explains is sliding, and it is linear in the wheel rates:

    sliding = P (A_alpha alpha' - r sum_ij e_i M_ij beta'_j),   P = 1 - C (C'C)^-1 C'

with C the columns of the chassis and M what a fault makes of the wheels: swapped, negated, scaled. An encoder that is
late by t adds t times its second derivative. So the moments of these columns, taken once a step, answer every such
question without going through the samples again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.campaign.steps import EXCITATIONS
from ident.estimate.filters import differentiate
from ident.plant import kinematics
from ident.records.record import Segment, Step, base_step
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

SLIDING: Final = 0.1
"""Sliding over rolling that a sound vehicle may show: worn tyres, wheels off their adhesion, late encoders."""

POSTURE: Final = 0.1
"""Deviation of a mean steering angle from that of its step that no misadjusted encoder has [rad]."""

THINNED: Final = 0.04
"""Interval of the samples that are looked at [s]: rates need closer ones, their moments do not."""

LATERAL: Final = 4
"""Rows of the constraints before the longitudinal ones."""
SIDES: Final = 2
PUNCTUAL: Final = np.zeros(len(WHEELS) + SIDES)


@dataclass(frozen=True)
class Rates:
    """Angles and rates of a segment.

    Attributes:
        alpha: (N, 2) [rad].
        steering, wheels: (N, 2), (N, 4) [rad/s].
    """

    alpha: Array
    steering: Array
    wheels: Array


@dataclass(frozen=True)
class Rolling:
    """Moments of one segment on the floor.

    Attributes:
        step: its name.
        moments: (23, 23) of the sliding velocities of [A_alpha alpha', -r e_i beta'_j, -r e_i beta''_i, A_k alpha''_k],
            i slow [m²/s²].
        rolled: (4, 4) moments of the wheels' rolling velocities [m²/s²].
        posture: mean square deviation of the steering angles that it holds from those it is driven at, over POSTURE².
        weight: number of independent samples of its motion.
    """

    step: str
    moments: Array
    rolled: Array
    posture: float
    weight: float

    def misfit(self, mixing: Array, late: Array = PUNCTUAL) -> float:
        """Mean square sliding over rolling [-].

        Args:
            mixing: (4, 4) true wheel angles over recorded ones.
            late: (6,) lateness of wheel and steering encoders [s], small.
        """
        full = np.concatenate([[1.0], mixing.ravel(), late])
        power = float(np.trace(mixing @ self.rolled @ mixing.T))
        return max(float(full @ self.moments @ full), 0.0) / power if power > 0 else 0.0

    def loss(self, mixing: Array) -> float:
        """Negative log likelihood of a misfit whose size is known only roughly (Student)."""
        return self.weight / 2 * (math.log1p(self.misfit(mixing) / SLIDING**2) + math.log1p(self.posture))


def rates_of(segment: Segment) -> Rates:
    """Angles and rates of a segment that is smooth already."""
    dt = segment.sample_time
    steering, wheels = (differentiate(angles, dt) for angles in (segment.steering_angles, segment.wheel_angles))
    return Rates(segment.steering_angles, steering, wheels)


def rolls(segment: Segment) -> bool:
    """Whether the wheels of a segment are known to be on the floor."""
    return base_step(segment.step) not in (None, Step.WHEEL_LIFTED)


def rolling_of(segment: Segment, geometry: Geometry) -> Rolling:
    """Moments of a segment that is smooth already."""
    rates, dt = rates_of(segment), segment.sample_time
    thin = slice(None, None, max(1, round(THINNED / dt)))
    turning, spinning = (differentiate(each, dt)[thin] for each in (rates.steering, rates.wheels))
    steering, wheels = rates.steering[thin], rates.wheels[thin]
    matrix = kinematics.constraint_matrix(rates.alpha[thin], geometry)
    projection = _off_chassis(matrix[:, :, :3])
    side = projection @ matrix[:, :, 3:5]
    wheel = -geometry.wheel_radius * projection[:, :, LATERAL:]
    columns = [
        (side * steering[:, None]).sum(axis=2, keepdims=True),
        (wheel[..., None] * wheels[:, None, None, :]).reshape(*wheel.shape[:2], -1),
        wheel * spinning[:, None],
        side * turning[:, None],
    ]
    design = np.concatenate(columns, axis=2)
    design = design.reshape(-1, design.shape[2])
    return Rolling(
        segment.step,
        design.T @ design / len(wheels),
        geometry.wheel_radius**2 * wheels.T @ wheels / len(wheels),
        _posture(segment, geometry),
        independent_samples(rates.wheels, dt),
    )


def _off_chassis(chassis: Array) -> Array:
    """Projection (N, 8, 8) on what no velocity of the chassis (N, 8, 3) moves."""
    normal = np.einsum("nki,nkj->nij", chassis, chassis)
    inverse = np.linalg.solve(normal, np.swapaxes(chassis, 1, 2))
    return np.asarray(np.eye(chassis.shape[1]) - chassis @ inverse)


def predicted_wheel_rate(rates: Rates, geometry: Geometry, wheel: int) -> Array:
    """Rate of a wheel (N,) by all other encoders [rad/s]."""
    matrix = kinematics.constraint_matrix(rates.alpha, geometry)
    row = LATERAL + wheel
    kept = [other for other in range(matrix.shape[1]) if other != row]
    steered = np.einsum("nij,nj->ni", matrix[:, :, 3:5], rates.steering)
    told = steered + np.einsum("nij,nj->ni", matrix[:, :, 5:], rates.wheels)
    chassis = matrix[:, kept, :3]
    normal = np.einsum("nki,nkj->nij", chassis, chassis)
    twist = np.linalg.solve(normal, -np.einsum("nki,nk->ni", chassis, told[:, kept])[..., None])[..., 0]
    along = np.einsum("nj,nj->n", matrix[:, row, :3], twist) + steered[:, row]
    return np.asarray(along / geometry.wheel_radius)


def predicted_steering_rate(rates: Rates, geometry: Geometry, side: int) -> Array:
    """Steering rate of a side (N,) by its wheels, which roll differently by nothing else in most steps [rad/s]."""
    front, rear = rates.wheels[:, SIDES * side], rates.wheels[:, SIDES * side + 1]
    return np.asarray((1 - 2 * side) * (rear - front) / (2 * geometry.lever_ratio))


def independent_samples(rates: Array, sample_time: float) -> float:
    """Twice the bandwidth of a motion (N, n) times its duration: so many values determine it (Shannon).

    The bandwidth is the rms frequency of the rates: the power of their derivative over their own, its root.
    """
    power = float(np.mean(rates**2))
    if power <= 0:
        return 0.0
    change = float(np.mean(differentiate(rates, sample_time) ** 2))
    return 2 * len(rates) * sample_time * math.sqrt(change / power) / (2 * math.pi)


def _posture(segment: Segment, geometry: Geometry) -> float:
    """Of the steering angles that a step holds; angles beyond the stops count in every step."""
    reach = np.max(np.abs(segment.steering_angles), axis=0)
    off = np.maximum(reach - geometry.steering_limit, 0.0) / POSTURE
    step = base_step(segment.step)
    spec = EXCITATIONS.get(step) if step is not None else None
    if spec is not None and spec.mode is not None:
        held = np.array([name != spec.coordinate for name in ("alpha_l", "alpha_r")])
        mean = np.mean(segment.steering_angles, axis=0)
        off = np.hypot(off, held * (mean - spec.steering(geometry)) / POSTURE)
    return float(np.mean(off**2))
