"""The estimate: the paper's path (22)-(25), with standard deviations that can be believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ident.errors import EstimationError
from ident.estimate.equations import Equations, column, usable_equations
from ident.estimate.filters import Processing
from ident.estimate.least_squares import LinearSystem, Solution, solve
from ident.estimate.noise import NoiseFloor, noise_floor
from ident.estimate.uncertainty import (
    LongRun,
    Scores,
    interval_factor,
    long_run_covariance,
    parameter_covariance,
)
from ident.records.record import Record, Step
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS

Array = NDArray[np.float64]

INDEPENDENT: Final = tuple(name for name in PARAMETER_NAMES if name != "B_w")
"""p₁ of (23): what steering, straight motion and rotation can tell apart (Table 1)."""

LIFTED: Final = ("d_vw", "d_cw", "B_w")
"""What a wheel in the air shows."""

INERTIAL: Final = {
    "C_l": Step.STEERING_LEFT,
    "C_r": Step.STEERING_RIGHT,
    "m_ch": Step.STRAIGHT,
    "C_ch": Step.ROTATION,
}
"""Inertias, which are never near zero, and the steps that excite them."""

FIT_STEPS: Final = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION, Step.LATERAL)
VALIDATION_STEPS: Final = (Step.LANE_CHANGE,)

POOR_RELATIVE_HALF_WIDTH = 0.5
"""A parameter whose 95 % half-width exceeds this fraction of its value is said to be poorly excited."""


@dataclass(frozen=True)
class KnownInertia:
    """B_w from elsewhere: data sheet or earlier identification [kg m²]."""

    value: float
    std: float
    source: str


@dataclass(frozen=True)
class Estimate:
    """One identified parameter.

    Attributes:
        name, unit: by the paper's symbol.
        value, std: SI.
        ci95: two-sided interval.
        naive_std: what white residuals of one size would give, as the paper's Table 2.
        b_w_std: the part of `std` that comes from the uncertainty of B_w.
        independence: norm of the parameter's column after projection on the others, over its norm: 1 is
            excitation that nothing else imitates, 0 is none.
        method: how it was found.
    """

    name: str
    unit: str
    value: float
    std: float
    ci95: tuple[float, float]
    naive_std: float
    b_w_std: float
    independence: float
    method: str

    @property
    def poor(self) -> bool:
        """Whether the interval is too wide to build on, or the value negative, which none of these can be."""
        half_width = (self.ci95[1] - self.ci95[0]) / 2
        return not half_width < POOR_RELATIVE_HALF_WIDTH * self.value


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes:
        estimates: eleven, in the order of (18).
        correlation: (11, 11).
        condition: cond(Θ₁ᵀΘ₁), unit-norm columns, unweighted, on measured, filtered and masked rows.
        floors: signal, residual, noise and model error of every step that was used or validated.
        equations: all rows, fitted ones first, for plots.
        processing: the filters and thresholds used.
    """

    estimates: tuple[Estimate, ...]
    correlation: Array
    condition: float
    floors: tuple[NoiseFloor, ...]
    equations: tuple[Equations, ...]
    processing: Processing

    @property
    def values(self) -> Array:
        """p (11,)."""
        return np.array([estimate.value for estimate in self.estimates])

    def __getitem__(self, name: str) -> Estimate:
        """One estimate by its symbol."""
        return self.estimates[PARAMETER_NAMES.index(name)]


@dataclass(frozen=True)
class _Fit:
    """A solved system with its error covariance."""

    system: LinearSystem
    solution: Solution
    covariance: Array
    naive_covariance: Array
    long_run: LongRun


def identify(
    record: Record,
    geometry: Geometry,
    *,
    known_inertia: KnownInertia | None = None,
    processing: Processing | None = None,
) -> Identification:
    """Identify p (18) from a record of the campaign.

    Args:
        record: steps as driven; steps the estimator does not know are passed over.
        geometry: of the vehicle.
        known_inertia: B_w; needed where the record holds no `wheel_lifted` step, otherwise it takes its place.
        processing: filters and thresholds.

    Raises:
        EstimationError: a step or an excitation is missing, named.
    """
    processing = processing or Processing()
    equations = usable_equations(list(record.segments), geometry, processing)
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return _identify(equations, known_inertia, processing)


def _identify(
    equations: Sequence[Equations], known_inertia: KnownInertia | None, processing: Processing
) -> Identification:
    inertia, lifted = _wheel_inertia(equations, known_inertia)
    rows = [equation for equation in equations if equation.step in FIT_STEPS]
    fit = _fit(rows, INDEPENDENT, {"B_w": inertia.value})
    sensitivity = _sensitivity_to_inertia(fit, rows)
    covariance = _joint_covariance(fit, sensitivity, inertia.std)
    estimates = [
        _estimate(fit, index, covariance[index, index], abs(sensitivity[index]) * inertia.std)
        for index in range(len(INDEPENDENT))
    ]
    _refuse_unexcited(estimates)
    values = np.array([*(estimate.value for estimate in estimates), inertia.value])
    deviations = np.sqrt(np.diag(covariance))
    return Identification(
        estimates=(*estimates, _inertia_estimate(inertia, lifted)),
        correlation=covariance / np.outer(deviations, deviations),
        condition=fit.solution.condition,
        floors=tuple(noise_floor(equation, values) for equation in equations),
        equations=tuple(equations),
        processing=processing,
    )


def _refuse_unexcited(estimates: Sequence[Estimate]) -> None:
    """An inertia is positive; one that is smaller than its standard deviation was not excited, only not quite zero."""
    lost = [estimate for estimate in estimates if estimate.name in INERTIAL and estimate.std > abs(estimate.value)]
    if lost:
        named = ", ".join(f"{e.name} ({e.value:.3g} ± {e.std:.3g} {e.unit})" for e in lost)
        steps = ", ".join(f"{e.name}: {INERTIAL[e.name]}" for e in lost)
        raise EstimationError(
            f"The data hardly excite {named}.",
            f"Add or repeat the step that does, with more acceleration ({steps}). If it was fast, the model lacks "
            "something: quasiomni diagnose says what.",
        )


def _wheel_inertia(equations: Sequence[Equations], known: KnownInertia | None) -> tuple[KnownInertia, _Fit | None]:
    if known is not None:
        return known, None
    rows = [equation for equation in equations if equation.step == Step.WHEEL_LIFTED]
    if not rows:
        raise EstimationError(
            "The record holds no step wheel_lifted, so B_w cannot be found.",
            "Give B_w with its standard deviation (--b-w 0.121 --b-w-std 0.01), or drive wheel_lifted.",
        )
    fit = _fit(rows, LIFTED, {})
    index = LIFTED.index("B_w")
    std = float(np.sqrt(fit.covariance[index, index]))
    return KnownInertia(float(fit.solution.values[index]), std, "wheel_lifted"), fit


def _fit(rows: Sequence[Equations], names: tuple[str, ...], known: dict[str, float]) -> _Fit:
    if not rows:
        raise EstimationError(
            "The record holds none of the steps of an identification.",
            f"It needs {', '.join(FIT_STEPS)} by these names in the channel step.",
        )
    columns = [column(name) for name in names]
    theta = np.concatenate([row.regressor[row.moving] for row in rows])
    torque = np.concatenate([row.torque[row.moving] for row in rows])
    for name, value in known.items():
        torque = torque - theta[:, column(name)] * value
    system = LinearSystem(names, theta[:, columns], torque)
    solution = solve(system)
    long_run = long_run_covariance(_scores(rows, solution, columns))
    freedom = max(len(torque) - len(names), 1)
    return _Fit(
        system=system,
        solution=solution,
        covariance=parameter_covariance(solution.normal_inverse, long_run),
        naive_covariance=solution.normal_inverse * float(solution.residual @ solution.residual) / freedom,
        long_run=long_run,
    )


def _scores(rows: Sequence[Equations], solution: Solution, columns: list[int]) -> list[Scores]:
    """xₜ eₜ of every part, on the parts' own time axis, zero where rows were dropped."""
    counts = np.cumsum([int(row.moving.sum()) for row in rows])[:-1]
    parts = []
    for row, residual in zip(rows, np.split(solution.residual, counts), strict=True):
        values = np.zeros((len(row.torque), len(columns)))
        values[row.moving] = row.regressor[row.moving][:, columns] * residual[:, None]
        parts.append(Scores(values, row.period, row.sample_time))
    return parts


def _sensitivity_to_inertia(fit: _Fit, rows: Sequence[Equations]) -> Array:
    """∂p₁/∂B_w = -(Θ₁ᵀΘ₁)⁻¹ Θ₁ᵀΘ₂, (n,)."""
    theta = np.concatenate([row.regressor[row.moving, column("B_w")] for row in rows])
    return np.asarray(-fit.solution.normal_inverse @ (fit.system.regressor.T @ theta))


def _joint_covariance(fit: _Fit, sensitivity: Array, inertia_std: float) -> Array:
    """Covariance of all eleven: that of p₁ at known B_w, plus what the uncertainty of B_w adds."""
    size = len(sensitivity)
    gradient = np.append(sensitivity, 1.0) * inertia_std
    joint = np.outer(gradient, gradient)
    joint[:size, :size] += fit.covariance
    if inertia_std == 0.0:
        joint[size, size] = np.finfo(float).tiny
    return joint


def _estimate(fit: _Fit, index: int, variance: float, b_w_std: float) -> Estimate:
    name = fit.system.names[index]
    value, std = float(fit.solution.values[index]), float(np.sqrt(variance))
    half_width = interval_factor(fit.long_run.degrees_of_freedom) * std
    return Estimate(
        name=name,
        unit=PARAMETER_UNITS[name],
        value=value,
        std=std,
        ci95=(value - half_width, value + half_width),
        naive_std=float(np.sqrt(fit.naive_covariance[index, index])),
        b_w_std=b_w_std,
        independence=_independence(fit, index),
        method="least squares",
    )


def _independence(fit: _Fit, index: int) -> float:
    norm = float(np.linalg.norm(fit.system.regressor[:, index]))
    return float(1 / (np.sqrt(fit.solution.normal_inverse[index, index]) * norm))


def _inertia_estimate(inertia: KnownInertia, fit: _Fit | None) -> Estimate:
    if fit is not None:
        return _estimate(fit, LIFTED.index("B_w"), inertia.std**2, inertia.std)
    half_width = interval_factor(np.inf) * inertia.std
    return Estimate(
        name="B_w",
        unit=PARAMETER_UNITS["B_w"],
        value=inertia.value,
        std=inertia.std,
        ci95=(inertia.value - half_width, inertia.value + half_width),
        naive_std=inertia.std,
        b_w_std=inertia.std,
        independence=float("nan"),
        method=inertia.source,
    )
