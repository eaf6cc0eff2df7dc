"""Excitation optimised for the condition number of (25) inside the limits of vehicle and floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize
from threadpoolctl import threadpool_limits

from ident.campaign.axis import Axis
from ident.campaign.excitation import FourierSeries, motion_basis, resting_projection, series_of
from ident.campaign.steps import StepSpec
from ident.estimate.filters import Processing
from ident.vehicle.description import Limits

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array]
"""Position, velocity and acceleration of a coordinate, (N,) each."""

SAMPLES = 240
"""Points of a period at which excitation is judged."""

TORQUE_RESERVE = 0.7
"""Share of the peak torque that a planned motion may use; the rest is the controller's."""

ADHESION_RESERVE = 0.5
"""Share of the adhesion that a planned motion may use."""

HOLDING_RESERVE = 0.6
"""Share of the steering friction that may be asked to hold the wheels in lateral motion."""

INFORMATION_WEIGHT = 0.3
"""Weight of the information content beside the condition number: a well-shaped whisper is no excitation."""

MASK_STEEPNESS = 2.0
"""How decidedly a stuck sample nearby drops a row in the smooth image of the mask."""

CONDITION_ASKED = 5.3
"""Condition number beyond which information counts for little."""

EXCESS_WEIGHT = 3.0
"""Weight of log cond beyond that."""

STARTS = 6
GRAVITY = 9.81


@dataclass(frozen=True)
class Excitation:
    """An optimised excitation.

    Attributes:
        series: the motion of the coordinate.
        condition: of the axis' normalised normal matrix, as planned.
        binding: the limit that sets its size.
    """

    series: FourierSeries
    condition: float
    binding: str


@dataclass(frozen=True)
class Problem:
    """What an excitation is judged by."""

    spec: StepSpec
    axis: Axis
    limits: Limits
    gear_ratio: float
    mass: float
    processing: Processing

    def usage(self, motion: Motion) -> dict[str, float]:
        """Share of each limit that a motion (position, velocity, acceleration) uses; 1 is the limit."""
        position, velocity, acceleration = motion
        motor = np.abs(self.axis.torque(velocity, acceleration)) * self.axis.motor_torque
        speed, peak_acceleration = float(np.abs(velocity).max()), float(np.abs(acceleration).max())
        adhesion = self.limits.floor_friction * self.mass * GRAVITY / 4 * self.axis.wheel_load
        grip = motor.max() * self.gear_ratio / adhesion if adhesion > 0 else 0.0
        return {
            "stroke": float(np.abs(position).max()) / self.spec.stroke,
            "speed": speed / self.spec.speed,
            "acceleration": peak_acceleration / self.spec.acceleration,
            "motor speed": speed * self.axis.wheel_rate * self.gear_ratio / self.limits.motor_speed,
            "peak torque": float(motor.max()) / (TORQUE_RESERVE * self.limits.peak_torque),
            "rated torque": float(np.sqrt(np.mean(motor**2))) / self.limits.rated_torque,
            "adhesion": float(grip) / ADHESION_RESERVE,
            "steering friction": peak_acceleration / (HOLDING_RESERVE * self.axis.holding_acceleration),
        }

    def normal_matrix(self, motion: Motion) -> Array:
        """Mean outer product of the columns (s̈, ṡ, sgn ṡ) over moving samples, in units of their torques."""
        _, velocity, acceleration = motion
        threshold = 2 * self.processing.moving / self.axis.wheel_rate
        columns = np.stack([acceleration, velocity, np.tanh(3 * velocity / threshold)])
        columns *= np.array([[self.axis.inertia], [self.axis.viscous], [self.axis.coulomb]])
        columns *= np.sqrt(self._kept(np.abs(velocity) / threshold))
        return np.asarray(columns @ columns.T / len(velocity))

    def _kept(self, speed: Array) -> Array:
        """Smooth image of the mask: rows that the estimator keeps, `speed` in units of the threshold."""
        stuck = 1 / (1 + np.exp(6 * np.clip(speed - 1, -5, 5)))
        width = 2 * round(self.processing.guard / self.spec.period * len(speed)) + 1
        return np.asarray(np.exp(-MASK_STEEPNESS * width * ndimage.uniform_filter1d(stuck, width, mode="wrap")))


def condition_number(normal: Array) -> float:
    """cond of a normal matrix after scaling its columns to unit norm."""
    norms = np.sqrt(np.diag(normal))
    values = np.linalg.eigvalsh(normal / np.outer(norms, norms))
    return float(values[-1] / max(values[0], 1e-12))


def size_within_limits(motion: Motion, problem: Problem) -> tuple[float, str]:
    """Largest factor on a motion that keeps every limit, and the limit that binds there."""

    def usage(factor: float) -> dict[str, float]:
        position, velocity, acceleration = motion
        return problem.usage((factor * position, factor * velocity, factor * acceleration))

    def excess(logarithm: float) -> float:
        return max(usage(float(np.exp(logarithm))).values()) - 1.0

    factor = float(np.exp(optimize.brentq(excess, -12.0, 12.0, xtol=1e-6)))
    shares = usage(factor)
    return factor, max(shares, key=lambda name: shares[name])


def optimise(problem: Problem, generator: np.random.Generator) -> Excitation:
    """Best of several local searches from random shapes.

    The matrices are tiny: threads of the linear algebra library would spend three times the work on each other.

    Minimises log cond of the scaled normal matrix, plus a little of the log of the sum of relative variances.
    """
    spec = problem.spec
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    projection = resting_projection(spec.harmonics)
    position, velocity, acceleration = (basis @ projection for basis in motion_basis(time, spec.period, spec.harmonics))

    def motion_of(coefficients: Array) -> Motion:
        return position @ coefficients, velocity @ coefficients, acceleration @ coefficients

    def cost(coefficients: Array) -> float:
        size = 1 / max(problem.usage(motion_of(coefficients)).values())
        normal = problem.normal_matrix(motion_of(size * coefficients))
        variances = np.diag(np.linalg.inv(normal + 1e-12 * np.trace(normal) * np.eye(3)))
        condition = np.log(condition_number(normal))
        excess = max(condition - np.log(CONDITION_ASKED), 0.0)
        return float(condition + EXCESS_WEIGHT * excess + INFORMATION_WEIGHT * np.log(variances.sum()))

    starts = [generator.normal(size=2 * spec.harmonics) for _ in range(STARTS)]
    with threadpool_limits(limits=1, user_api="blas"):
        searches = [optimize.minimize(cost, start, method="L-BFGS-B", options={"maxiter": 60}) for start in starts]
    shape = min(searches, key=lambda found: float(found.fun)).x
    factor, binding = size_within_limits(motion_of(shape), problem)
    series = series_of(projection @ (factor * shape), spec.period)
    return Excitation(series, condition_number(problem.normal_matrix(motion_of(factor * shape))), binding)
