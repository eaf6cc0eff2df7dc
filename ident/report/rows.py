"""Rows of the tables, shared by terminal and HTML so that both say the same."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from ident.campaign.loops import LoopDesign
from ident.estimate.identify import FIT_STEPS, VALIDATION_STEPS
from ident.estimate.noise import NoiseFloor
from ident.estimate.result import Estimate, Identification
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

MEANINGS: Final = {
    "C_l": "inertia, left steering",
    "d_vl": "viscous friction, left steering",
    "d_cl": "Coulomb friction, left steering",
    "C_r": "inertia, right steering",
    "d_vr": "viscous friction, right steering",
    "d_cr": "Coulomb friction, right steering",
    "m_ch": "mass of the vehicle",
    "C_ch": "yaw inertia of the chassis",
    "d_vw": "viscous friction of a wheel drive",
    "d_cw": "Coulomb friction of a wheel drive",
    "B_w": "inertia of a wheel drive",
}
"""(18) in words; m_ch holds the steering units, B_w motor, gear and wheel."""

LEAST_SQUARES: Final = "least squares"
"""`Estimate.method` of what the record itself shows."""


class Role(enum.Enum):
    """What the rows of a step are used for."""

    FIT = "fit"
    INERTIA = "B_w"
    VALIDATION = "check"
    SHOWN = "not used"


@dataclass(frozen=True)
class ParameterRow:
    """One parameter beside what else is known of it.

    Attributes:
        estimate: as identified.
        meaning: in words.
        truth: true value, where it is known.
        paper: value and std of Table 2, where asked for.
    """

    estimate: Estimate
    meaning: str
    truth: float | None
    paper: tuple[float, float] | None

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval over the value [-]."""
        return (self.estimate.ci95[1] - self.estimate.ci95[0]) / 2 / abs(self.estimate.value)

    @property
    def error(self) -> float | None:
        """Value over truth, minus one [-]."""
        return None if self.truth is None else self.estimate.value / self.truth - 1

    @property
    def error_in_std(self) -> float | None:
        """Error in standard deviations; None where there is no truth or no std."""
        if self.truth is None or not self.estimate.std > 0:
            return None
        return (self.estimate.value - self.truth) / self.estimate.std

    @property
    def covered(self) -> bool | None:
        """Whether the 95 % interval holds the truth."""
        low, high = self.estimate.ci95
        return None if self.truth is None else low <= self.truth <= high

    @property
    def inflation(self) -> float:
        """Std over the naive one [-]; NaN where there is no std."""
        return self.estimate.std / self.estimate.naive_std if self.estimate.naive_std > 0 else float("nan")

    @property
    def inertia_share(self) -> float:
        """Share of the variance that comes from the uncertainty of B_w [-]; NaN where there is no std."""
        return (self.estimate.b_w_std / self.estimate.std) ** 2 if self.estimate.std > 0 else float("nan")


@dataclass(frozen=True)
class StepRow:
    """One generalized torque of one step.

    Attributes:
        floor: its rms values.
        role: what it was used for.
        kept: share of its samples outside of stiction and standstill [-].
    """

    floor: NoiseFloor
    role: Role
    kept: float

    @property
    def unit(self) -> str:
        """Of the generalized torque."""
        return self.floor.unit


@dataclass(frozen=True)
class LoopRow:
    """One control loop."""

    coordinate: str
    design: LoopDesign


def parameter_rows(
    identification: Identification, truth: Parameters | None = None, paper: Parameters | None = None
) -> list[ParameterRow]:
    """Eleven rows in the order of (18)."""
    return [
        ParameterRow(
            estimate=identification[name],
            meaning=MEANINGS[name],
            truth=None if truth is None else truth[name],
            paper=None if paper is None else (paper[name], paper.std_of(name)),
        )
        for name in PARAMETER_NAMES
    ]


def role_of(step: str, identification: Identification) -> Role:
    """What the estimator used a step for."""
    if step in FIT_STEPS:
        return Role.FIT
    if step in VALIDATION_STEPS:
        return Role.VALIDATION
    return Role.INERTIA if identification["B_w"].method == LEAST_SQUARES else Role.SHOWN


def step_rows(identification: Identification) -> list[StepRow]:
    """A row for every coordinate of every step that the estimator knows."""
    return [
        StepRow(floor, role_of(floor.step, identification), float(equations.moving.mean()))
        for floor, equations in zip(identification.floors, identification.equations, strict=True)
    ]


def loop_rows(designs: Mapping[str, LoopDesign]) -> list[LoopRow]:
    """A row a loop; the four wheels in the air share one design and one row."""
    rows = {name if not name.startswith("beta_") else "beta": design for name, design in designs.items()}
    return [LoopRow(name, design) for name, design in rows.items()]
