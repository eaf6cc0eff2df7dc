"""How good an identification is where the truth is known: errors, intervals and coverage over many runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ident.estimate.result import Identification
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

STATED: Final = 0.95
"""How often an interval holds the truth, by its own word."""

TOGETHER: Final = (0.935, 0.965)
"""Between which all parameters' intervals together must hold it."""

CHANCE: Final = 0.01
"""Below which chance does not explain how rarely a single parameter's intervals hold it."""


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
class Coverage:
    """How often the intervals of one parameter held the truth.

    Attributes:
        name: by the paper's symbol.
        covered: runs whose interval holds the truth.
        runs: number of runs.
    """

    name: str
    covered: int
    runs: int

    @property
    def chance(self) -> float:
        """Probability of so few or fewer, were each interval to hold the truth as often as it states."""
        return float(stats.binom.cdf(self.covered, self.runs, STATED))


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


def coverage(rows: Iterable[Accuracy | Coverage]) -> float:
    """Share of all parameter-run pairs whose interval holds the truth."""
    listed = list(rows)
    return sum(row.covered for row in listed) / sum(row.runs for row in listed)


def coverages(vehicles: Iterable[Iterable[Accuracy]]) -> list[Coverage]:
    """Coverage of every parameter over all vehicles."""
    by_parameter = zip(*vehicles, strict=True)
    return [
        Coverage(rows[0].name, sum(row.covered for row in rows), sum(row.runs for row in rows)) for rows in by_parameter
    ]


def honest(found: Iterable[Coverage]) -> bool:
    """Whether intervals keep their word: all together within TOGETHER, none too rarely by more than chance."""
    listed = list(found)
    lowest, highest = TOGETHER
    return lowest <= coverage(listed) <= highest and all(one.chance >= CHANCE for one in listed)
