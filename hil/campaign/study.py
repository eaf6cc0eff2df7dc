"""How good an identification is where the truth is known: errors, intervals and coverage over many runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.identify import Identification
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

TOLERANCES: Final = {
    "C_l": 5.0,
    "d_vl": 2.5,
    "d_cl": 1.0,
    "C_r": 5.0,
    "d_vr": 2.5,
    "d_cr": 1.0,
    "m_ch": 0.3,
    "C_ch": 0.3,
    "d_vw": 2.5,
    "d_cw": 1.0,
    "B_w": 1.0,
}
"""What the emulated prototype must be identified to [% of the true value]."""


@dataclass(frozen=True)
class Accuracy:
    """One parameter over all runs, in % of its true value.

    Attributes:
        name: by the paper's symbol.
        median_error: median of the absolute errors.
        bias: mean error.
        scatter: standard deviation of the errors.
        half_width: median half-width of the 95 % intervals.
        covered: runs whose interval holds the truth.
        runs: number of runs.
    """

    name: str
    median_error: float
    bias: float
    scatter: float
    half_width: float
    covered: int
    runs: int


@dataclass(frozen=True)
class Outcome:
    """What is kept of one run.

    Attributes:
        seed: of excitation and noise.
        values: (11,).
        intervals: (11, 2).
        condition: cond(Θ₁ᵀΘ₁).
        steering_nrmse, drive_nrmse: of the lane change, outside stiction.
    """

    seed: int
    values: Array
    intervals: Array
    condition: float
    steering_nrmse: float
    drive_nrmse: float


def outcome_of(seed: int, result: Identification) -> Outcome:
    """The numbers of one run."""
    nrmse = {(floor.step, floor.coordinate): floor.nrmse for floor in result.floors}
    return Outcome(
        seed=seed,
        values=result.values,
        intervals=np.array([estimate.ci95 for estimate in result.estimates]),
        condition=result.condition,
        steering_nrmse=nrmse["lane_change", "alpha_v"],
        drive_nrmse=nrmse["lane_change", "x"],
    )


def accuracy(outcomes: Sequence[Outcome], truth: Parameters) -> list[Accuracy]:
    """Errors and coverage of every parameter."""
    values = np.stack([outcome.values for outcome in outcomes])
    intervals = np.stack([outcome.intervals for outcome in outcomes])
    errors = 100 * (values / truth.values - 1)
    half_widths = 50 * (intervals[:, :, 1] - intervals[:, :, 0]) / truth.values
    held = (intervals[:, :, 0] <= truth.values) & (truth.values <= intervals[:, :, 1])
    return [
        Accuracy(
            name=name,
            median_error=float(np.median(np.abs(errors[:, index]))),
            bias=float(errors[:, index].mean()),
            scatter=float(errors[:, index].std(ddof=1)) if len(outcomes) > 1 else 0.0,
            half_width=float(np.median(half_widths[:, index])),
            covered=int(held[:, index].sum()),
            runs=len(outcomes),
        )
        for index, name in enumerate(PARAMETER_NAMES)
    ]


def coverage(rows: Iterable[Accuracy]) -> float:
    """Share of all parameter-run pairs whose interval holds the truth."""
    listed = list(rows)
    return sum(row.covered for row in listed) / sum(row.runs for row in listed)
