"""Measured against modelled generalized torques, in time and folded over the periods of the excitation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.campaign.reference import sample_times
from ident.estimate.equations import Equations
from ident.estimate.result import Identification
from ident.records.repeats import repeats_of
from ident.report.rows import Role, role_of
from ident.vehicle.parameters import parameter_column

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Comparison:
    """Both sides of (24) for one coordinate of one step.

    Attributes:
        step, coordinate: where.
        role: what the step was used for.
        sample_time: [s].
        time: (N,) from the start of the step [s].
        measured: τ - Θ₂ p₂ (N,) [Nm or N]; τ alone for wheels in the air, where B_w is what is sought.
        modelled: Θ₁ p₁ (N,); Θ p for wheels in the air.
        moving: (N,) rows outside of stiction.
        period: (N,) number of the repeat, -1 outside of any.
    """

    step: str
    coordinate: str
    role: Role
    sample_time: float
    time: Array
    measured: Array
    modelled: Array
    moving: NDArray[np.bool_]
    period: NDArray[np.int64]

    @property
    def residual(self) -> Array:
        """Measured minus modelled (N,)."""
        return np.asarray(self.measured - self.modelled)

    def stuck_spans(self) -> list[tuple[float, float]]:
        """Beginning and end [s] of every run of rows in stiction."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], ~self.moving, [False]]).astype(np.int8)))
        last = len(self.time) - 1
        return [
            (float(self.time[start]), float(self.time[min(stop, last)]))
            for start, stop in zip(edges[::2], edges[1::2], strict=True)
        ]


@dataclass(frozen=True)
class Folded:
    """Residual over the phase of the excitation.

    Attributes:
        phase: (T,) time since the start of a period [s].
        periods: (P, T) residual of every repeat; NaN in stiction.
        mean: (T,) what repeats; NaN where a repeat is in stiction.
        noise: rms of what differs between repeats, corrected for the degrees of freedom.
    """

    phase: Array
    periods: Array
    mean: Array
    noise: float


def comparisons(identification: Identification) -> list[Comparison]:
    """Both sides of (24) for all rows, in the order of `identification.equations`."""
    return [_compare(equations, identification) for equations in identification.equations]


def _compare(equations: Equations, identification: Identification) -> Comparison:
    role = role_of(equations.step, identification)
    values = identification.values
    modelled = equations.regressor @ values
    known = np.zeros(len(modelled))
    if role in (Role.FIT, Role.VALIDATION):
        known = equations.regressor[:, parameter_column("B_w")] * identification["B_w"].value
    return Comparison(
        step=equations.step,
        coordinate=equations.coordinate,
        role=role,
        sample_time=equations.sample_time,
        time=equations.time - equations.time[0],
        measured=equations.torque - known,
        modelled=modelled - known,
        moving=equations.moving,
        period=equations.period,
    )


def folded(comparison: Comparison) -> Folded | None:
    """The residual folded over its repeats; None for fewer than two, or when no phase moves in all of them."""
    index = repeats_of(comparison.period)
    if len(index) < 2:
        return None
    residual: Array = np.where(comparison.moving[index], comparison.residual[index], np.nan)
    common = comparison.moving[index].all(axis=0)
    if not common.any():
        return None
    noise = float(np.sqrt(np.mean(residual[:, common].var(axis=0, ddof=1))))
    phase = sample_times(index.shape[1], comparison.sample_time)
    return Folded(phase, residual, residual.mean(axis=0), noise)
