"""The estimate: the paper's path (22)-(25), with standard deviations that can be believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ident.errors import EstimationError
from ident.estimate.equations import Equations, usable_equations
from ident.estimate.filters import Processing
from ident.estimate.lag import lag_of
from ident.estimate.least_squares import ORDINARY, Estimator, LinearSystem, Solution
from ident.estimate.noise import noise_floor
from ident.estimate.result import Estimate, Identification, KnownInertia
from ident.estimate.uncertainty import ErrorCovariance, FittedRows, correlation_of, error_covariance, interval_factor
from ident.records.record import FOUR_STEPS, Record, Step
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS, parameter_column

Array = NDArray[np.float64]

INDEPENDENT: Final = tuple(name for name in PARAMETER_NAMES if name != "B_w")
"""p₁ of (23): what steering, straight motion and rotation can tell apart (Table 1)."""

LIFTED: Final = ("d_vw", "d_cw", "B_w")
"""What a wheel in the air shows."""

_INERTIA: Final = LIFTED.index("B_w")

INERTIAL: Final = {
    "C_l": Step.STEERING_LEFT,
    "C_r": Step.STEERING_RIGHT,
    "m_ch": Step.STRAIGHT,
    "C_ch": Step.ROTATION,
}
"""Inertias, which are never near zero, and the steps that excite them."""

FIT_STEPS: Final = (*FOUR_STEPS, Step.LATERAL)
VALIDATION_STEPS: Final = (Step.LANE_CHANGE,)


@dataclass(frozen=True)
class _Fit:
    """A solved system, its rows as they were fitted, and its error covariance."""

    system: LinearSystem
    solution: Solution
    parts: tuple[FittedRows, ...]
    error: ErrorCovariance
    naive_covariance: Array
    method: str


def identify(
    record: Record,
    geometry: Geometry,
    *,
    known_inertia: KnownInertia | None = None,
    processing: Processing | None = None,
    estimator: Estimator = ORDINARY,
) -> Identification:
    """Identify p (18) from a record of the campaign.

    Args:
        record: steps as driven; steps the estimator does not know are passed over.
        geometry: of the vehicle.
        known_inertia: B_w; needed where the record holds no `wheel_lifted` step, otherwise it takes its place.
        processing: filters and thresholds.
        estimator: solves the rows; ordinary least squares, or another one of `ident.estimate.least_squares`.

    Raises:
        EstimationError: a step or an excitation is missing, named.
    """
    processing = processing or Processing()
    equations = usable_equations(list(record.segments), geometry, processing)
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return _identify(equations, known_inertia, processing, estimator)


def _identify(
    equations: Sequence[Equations], known: KnownInertia | None, processing: Processing, estimator: Estimator
) -> Identification:
    inertia, lifted = _wheel_inertia(equations, known, estimator)
    rows = [equation for equation in equations if equation.step in FIT_STEPS]
    fit = _fit(rows, INDEPENDENT, {"B_w": inertia.value}, estimator)
    sensitivity = _sensitivity_to_inertia(fit, rows)
    error = _joint_error(fit, sensitivity, inertia.std, _freedom_of_inertia(lifted))
    estimates = [
        _estimate(fit, index, error, abs(sensitivity[index]) * inertia.std) for index in range(len(INDEPENDENT))
    ]
    _refuse_unexcited(estimates)
    values = np.array([*(estimate.value for estimate in estimates), inertia.value])
    return Identification(
        estimates=(*estimates, _inertia_estimate(inertia, lifted)),
        correlation=correlation_of(error.matrix),
        condition=fit.solution.condition,
        floors=tuple(noise_floor(equation, values) for equation in equations),
        lag=lag_of(fit.parts, [row.growth for row in rows]),
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


def _wheel_inertia(
    equations: Sequence[Equations], known: KnownInertia | None, estimator: Estimator
) -> tuple[KnownInertia, _Fit | None]:
    if known is not None:
        return known, None
    rows = [equation for equation in equations if equation.step == Step.WHEEL_LIFTED]
    if not rows:
        raise EstimationError(
            "The record holds no step wheel_lifted, so B_w cannot be found.",
            "Give B_w with its standard deviation (--b-w 0.121 --b-w-std 0.01), or drive wheel_lifted.",
        )
    fit = _fit(rows, LIFTED, {}, estimator)
    std = float(np.sqrt(fit.error.matrix[_INERTIA, _INERTIA]))
    return KnownInertia(float(fit.solution.values[_INERTIA]), std, "wheel_lifted"), fit


def _freedom_of_inertia(fit: _Fit | None) -> float:
    """Degrees of freedom of B_w's standard deviation; one that is given is taken as known."""
    return np.inf if fit is None else float(fit.error.degrees_of_freedom[_INERTIA])


def _fit(rows: Sequence[Equations], names: tuple[str, ...], known: dict[str, float], estimator: Estimator) -> _Fit:
    if not rows:
        raise EstimationError(
            "The record holds none of the steps of an identification.",
            f"It needs {', '.join(FIT_STEPS)} by these names in the channel step.",
        )
    columns = [parameter_column(name) for name in names]
    theta = np.concatenate([row.regressor[row.moving] for row in rows])
    torque = np.concatenate([row.torque[row.moving] for row in rows])
    for name, value in known.items():
        torque = torque - theta[:, parameter_column(name)] * value
    part = np.repeat(np.arange(len(rows)), [int(row.moving.sum()) for row in rows])
    system = LinearSystem(names, theta[:, columns], torque, part)
    solution = estimator(system)
    parts = _fitted_rows(rows, solution, columns)
    freedom = max(len(torque) - len(names), 1)
    return _Fit(
        system=system,
        solution=solution,
        parts=tuple(parts),
        error=error_covariance(parts),
        naive_covariance=solution.influence.T
        @ solution.influence
        * float(solution.residual @ solution.residual)
        / freedom,
        method=estimator.name,
    )


def _fitted_rows(rows: Sequence[Equations], solution: Solution, columns: list[int]) -> list[FittedRows]:
    """The rows of a fit, every part on its own time axis; residual and influence are zero in dropped rows."""
    counts = np.cumsum([int(row.moving.sum()) for row in rows])[:-1]
    parts = []
    fitted = zip(rows, np.split(solution.residual, counts), np.split(solution.influence, counts), strict=True)
    for row, left, psi in fitted:
        residual, influence = np.zeros(len(row.torque)), np.zeros((len(row.torque), len(columns)))
        residual[row.moving], influence[row.moving] = left, psi
        parts.append(
            FittedRows(row.regressor[:, columns], influence, residual, row.moving, row.period, row.sample_time)
        )
    return parts


def _sensitivity_to_inertia(fit: _Fit, rows: Sequence[Equations]) -> Array:
    """∂p₁/∂B_w = -ψᵀΘ₂, (n,)."""
    theta = np.concatenate([row.regressor[row.moving, parameter_column("B_w")] for row in rows])
    return np.asarray(-fit.solution.influence.T @ theta)


def _joint_error(fit: _Fit, sensitivity: Array, inertia_std: float, inertia_freedom: float) -> ErrorCovariance:
    """Error of all eleven: that of p₁ at known B_w, plus what the uncertainty of B_w adds."""
    size = len(sensitivity)
    at_known = np.zeros((size + 1, size + 1))
    at_known[:size, :size] = fit.error.matrix
    gradient = np.append(sensitivity, 1.0) * inertia_std
    by_inertia = np.outer(gradient, gradient)
    if inertia_std == 0.0:
        by_inertia[size, size] = np.finfo(float).tiny
    return ErrorCovariance.total(
        [
            ErrorCovariance(at_known, np.append(fit.error.degrees_of_freedom, np.inf)),
            ErrorCovariance(by_inertia, np.full(size + 1, inertia_freedom)),
        ]
    )


def _estimate(fit: _Fit, index: int, error: ErrorCovariance, b_w_std: float) -> Estimate:
    name = fit.system.names[index]
    value, std = float(fit.solution.values[index]), float(np.sqrt(error.matrix[index, index]))
    half_width = interval_factor(float(error.degrees_of_freedom[index])) * std
    return Estimate(
        name=name,
        unit=PARAMETER_UNITS[name],
        value=value,
        std=std,
        ci95=(value - half_width, value + half_width),
        naive_std=float(np.sqrt(fit.naive_covariance[index, index])),
        b_w_std=b_w_std,
        independence=_independence(fit, index),
        method=fit.method,
    )


def _independence(fit: _Fit, index: int) -> float:
    norm = float(np.linalg.norm(fit.system.regressor[:, index]))
    return float(1 / (np.sqrt(fit.solution.normal_inverse[index, index]) * norm))


def _inertia_estimate(inertia: KnownInertia, fit: _Fit | None) -> Estimate:
    if fit is not None:
        return _estimate(fit, _INERTIA, fit.error, inertia.std)
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
