"""The estimate of a servo axis, by the least squares and the standard deviations of the vehicle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import EstimationError
from ident.estimate.axis.processing import PARAMETERS, AxisEquations, AxisProcessing, axis_equations
from ident.estimate.least_squares import LinearSystem, Solution, solve
from ident.estimate.uncertainty import ErrorCovariance, FittedRows, correlation_of, error_covariance, interval_factor
from ident.records.axis_record import AxisKind, AxisRecord

Array = NDArray[np.float64]

PARAMETER_UNITS: Final = {
    AxisKind.LINEAR: {"M": "kg", "Fv": "N s/m", "Fc": "N", "offset": "N"},
    AxisKind.ROTARY: {"M": "kg m^2", "Fv": "Nm s/rad", "Fc": "Nm", "offset": "Nm"},
}


@dataclass(frozen=True)
class AxisEstimate:
    """One identified parameter.

    Attributes:
        name, unit: by the symbol in M a + Fv v + Fc sign(v) + offset.
        value, std: SI; `std` stays right under coloured residuals.
        ci95: two-sided interval.
        naive_std: what white residuals of one size would give.
    """

    name: str
    unit: str
    value: float
    std: float
    ci95: tuple[float, float]
    naive_std: float


@dataclass(frozen=True)
class AxisIdentification:
    """Result of an identification of one axis.

    Attributes:
        axis: its name in the record, empty for a single axis.
        estimates: four, in the order M, Fv, Fc, offset.
        correlation: (4, 4).
        condition: cond(ΘᵀΘ) with unit-norm columns, the same number as for the vehicle.
        regressor_condition: cond(Θ) without scaling, which the EMPS publication prints.
        relative_error: norm of the residual over norm of the effort [-].
        residual_std: of the residual [N or Nm].
        equations: the rows, for plots.
        residual: (M,) effort minus model [N or Nm].
    """

    axis: str
    estimates: tuple[AxisEstimate, ...]
    correlation: Array
    condition: float
    regressor_condition: float
    relative_error: float
    residual_std: float
    equations: AxisEquations = field(repr=False)
    residual: Array = field(repr=False)

    @property
    def values(self) -> Array:
        """M, Fv, Fc, offset (4,)."""
        return np.array([estimate.value for estimate in self.estimates])

    def __getitem__(self, name: str) -> AxisEstimate:
        """One estimate by its symbol."""
        return self.estimates[PARAMETERS.index(name)]


def identify_axes(record: AxisRecord, processing: AxisProcessing) -> tuple[AxisIdentification, ...]:
    """Identify every axis of a record, each by itself.

    Raises:
        EstimationError: the record is too short, or its motion does not excite a parameter, named with the axis.
    """
    return tuple(identify_axis(record, processing, axis.name) for axis in record.axes)


def identify_axis(record: AxisRecord, processing: AxisProcessing, axis: str | None = None) -> AxisIdentification:
    """Identify one axis; `axis` is its name in the record and may be left out where there is but one.

    Raises:
        RecordError: there is no such axis, or several and none is named.
        EstimationError: the record is too short, or its motion does not excite a parameter, named.
    """
    signals = record.axis(axis)
    equations = axis_equations(record, signals, processing)
    solution = _solve(equations, f"{record.source}, {signals.label}")
    kept = np.ones(len(solution.residual), dtype=bool)
    rows = FittedRows(
        equations.regressor, solution.influence, solution.residual, kept, equations.period, equations.sample_time
    )
    error = error_covariance([rows])
    return AxisIdentification(
        axis=signals.name,
        estimates=_estimates(solution, error, signals.kind),
        correlation=correlation_of(error.matrix),
        condition=solution.condition,
        regressor_condition=float(np.linalg.cond(equations.regressor)),
        relative_error=float(np.linalg.norm(solution.residual) / np.linalg.norm(equations.effort)),
        residual_std=float(np.std(solution.residual, ddof=1)),
        equations=equations,
        residual=solution.residual,
    )


def _solve(equations: AxisEquations, where: str) -> Solution:
    try:
        return solve(LinearSystem(PARAMETERS, equations.regressor, equations.effort))
    except EstimationError as error:
        raise EstimationError(
            f"{where}: {error.what}",
            "Move the axis both ways, at several speeds and with accelerations that the effort shows.",
        ) from error


def _estimates(solution: Solution, error: ErrorCovariance, kind: AxisKind) -> tuple[AxisEstimate, ...]:
    freedom = len(solution.residual) - len(PARAMETERS)
    white = float(solution.residual @ solution.residual) / freedom
    deviations = np.sqrt(np.diag(error.matrix))
    factors = [interval_factor(float(freedom)) for freedom in error.degrees_of_freedom]
    return tuple(
        AxisEstimate(
            name=name,
            unit=PARAMETER_UNITS[kind][name],
            value=float(value),
            std=float(std),
            ci95=(float(value - factor * std), float(value + factor * std)),
            naive_std=float(np.sqrt(white * inverse)),
        )
        for name, value, std, factor, inverse in zip(
            PARAMETERS, solution.values, deviations, factors, np.diag(solution.normal_inverse), strict=True
        )
    )
