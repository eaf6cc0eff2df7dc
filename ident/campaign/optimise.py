"""Excitation optimised for the condition number of (25) inside the limits of vehicle and floor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

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
"""Position, velocity and acceleration of a coordinate, (N,) each, or (m, N) of many motions."""

SAMPLES = 240
"""Points of a period at which an excitation is evaluated."""

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

STEP: Final = 1e-8
"""Step of the gradient's differences, of coefficients of size one."""

LIMITS: Final = (
    "stroke",
    "speed",
    "acceleration",
    "motor speed",
    "peak torque",
    "rated torque",
    "adhesion",
    "steering friction",
)
"""What can set the size of a motion."""


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
    """Criteria of an excitation."""

    spec: StepSpec
    axis: Axis
    limits: Limits
    gear_ratio: float
    mass: float
    processing: Processing

    def usage(self, motion: Motion) -> Array:
        """Share of each of the LIMITS that motions use, (8,) or (8, m); 1 is the limit."""
        position, velocity, acceleration = motion
        motor = np.abs(self.axis.torque(velocity, acceleration)) * self.axis.motor_torque
        stroke, speed, hardest, peak = (np.abs(part).max(axis=-1) for part in (position, velocity, acceleration, motor))
        adhesion = self.limits.floor_friction * self.mass * GRAVITY / 4 * self.axis.wheel_load
        grip = self.gear_ratio / adhesion if adhesion > 0 else 0.0
        return np.stack(
            [
                stroke / self.spec.stroke,
                speed / self.spec.speed,
                hardest / self.spec.acceleration,
                speed * self.axis.wheel_rate * self.gear_ratio / self.limits.motor_speed,
                peak / (TORQUE_RESERVE * self.limits.peak_torque),
                np.sqrt(np.mean(motor**2, axis=-1)) / self.limits.rated_torque,
                peak * grip / ADHESION_RESERVE,
                hardest / (HOLDING_RESERVE * self.axis.holding_acceleration),
            ]
        )

    def normal_matrix(self, motion: Motion) -> Array:
        """Mean outer product of the columns (s̈, ṡ, sgn ṡ) over moving samples, in units of their torques.

        Of one motion (3, 3), of many (m, 3, 3).
        """
        _, velocity, acceleration = motion
        threshold = 2 * self.processing.moving / self.axis.wheel_rate
        columns = np.stack([acceleration, velocity, np.tanh(3 * velocity / threshold)], axis=-2)
        columns *= np.array([[self.axis.inertia], [self.axis.viscous], [self.axis.coulomb]])
        columns *= np.sqrt(self._kept(np.abs(velocity) / threshold))[..., None, :]
        return np.asarray(columns @ np.swapaxes(columns, -1, -2) / velocity.shape[-1])

    def _kept(self, speed: Array) -> Array:
        """Smooth image of the mask: rows that the estimator keeps, `speed` in units of the threshold."""
        stuck = 1 / (1 + np.exp(6 * np.clip(speed - 1, -5, 5)))
        width = 2 * round(self.processing.guard / self.spec.period * speed.shape[-1]) + 1
        return np.asarray(np.exp(-MASK_STEEPNESS * width * ndimage.uniform_filter1d(stuck, width, mode="wrap")))


def condition_number(normal: Array) -> Array:
    """cond of normal matrices (..., 3, 3) after scaling their columns to unit norm, (...)."""
    norms = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    values = np.linalg.eigvalsh(normal / (norms[..., :, None] * norms[..., None, :]))
    return np.asarray(values[..., -1] / np.maximum(values[..., 0], 1e-12))


def size_within_limits(motion: Motion, problem: Problem) -> tuple[float, str]:
    """Largest factor on a motion that keeps every limit, and the limit that binds there."""

    def usage(factor: float) -> Array:
        position, velocity, acceleration = motion
        return problem.usage((factor * position, factor * velocity, factor * acceleration))

    def excess(logarithm: float) -> float:
        return float(usage(float(np.exp(logarithm))).max()) - 1.0

    factor = float(np.exp(optimize.brentq(excess, -12.0, 12.0, xtol=1e-6)))
    return factor, LIMITS[int(np.argmax(usage(factor)))]


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
        return coefficients @ position.T, coefficients @ velocity.T, coefficients @ acceleration.T

    def costs(shapes: Array) -> Array:
        moved, rate, change = motion_of(shapes)
        size = 1 / problem.usage((moved, rate, change)).max(axis=0)[:, None]
        normal = problem.normal_matrix((size * moved, size * rate, size * change))
        traces = np.trace(normal, axis1=-2, axis2=-1)[:, None, None]
        variances = np.trace(np.linalg.inv(normal + 1e-12 * traces * np.eye(3)), axis1=-2, axis2=-1)
        condition = np.log(condition_number(normal))
        excess = np.maximum(condition - np.log(CONDITION_ASKED), 0.0)
        return np.asarray(condition + EXCESS_WEIGHT * excess + INFORMATION_WEIGHT * np.log(variances))

    def cost_and_gradient(coefficients: Array) -> tuple[float, Array]:
        """All differences of a gradient at once: numpy takes little longer for thirteen motions than for one."""
        beside = coefficients + STEP * np.eye(len(coefficients))
        cost, *others = costs(np.vstack([coefficients, beside]))
        return float(cost), (np.array(others) - cost) / (np.diagonal(beside) - coefficients)

    starts = [generator.normal(size=2 * spec.harmonics) for _ in range(STARTS)]
    with threadpool_limits(limits=1, user_api="blas"):
        searches = [
            optimize.minimize(cost_and_gradient, start, jac=True, method="L-BFGS-B", options={"maxiter": 60})
            for start in starts
        ]
    shape = min(searches, key=lambda found: float(found.fun)).x
    factor, binding = size_within_limits(motion_of(shape), problem)
    series = series_of(projection @ (factor * shape), spec.period)
    condition = float(condition_number(problem.normal_matrix(motion_of(factor * shape))))
    return Excitation(series, condition, binding)
