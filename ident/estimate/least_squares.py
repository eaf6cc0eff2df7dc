"""Estimators of (24): column-scaled least squares (25), and the same with weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ident.errors import EstimationError

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-3
"""Smallest singular value of the unit-norm columns, relative to the largest, that counts as excited."""


@dataclass(frozen=True)
class LinearSystem:
    """Stacked rows Θ₁ p₁ = τ - Θ₂ p₂ of (24).

    Attributes:
        names: of the n unknown parameters.
        regressor: Θ₁ (M, n).
        torque: right-hand side (M,).
        part: (M,) number of the step and coordinate that a row comes from; None where all come from one.
    """

    names: tuple[str, ...]
    regressor: Array
    torque: Array
    part: NDArray[np.int64] | None = None


@dataclass(frozen=True)
class Solution:
    """What an estimator found.

    Attributes:
        values: p₁ (n,).
        influence: ψ (M, n): errors e of the rows move the values by ψᵀ e. Standard deviations are made of that.
        normal_inverse: (Θ₁ᵀΘ₁)⁻¹ (n, n).
        condition: cond(Θ₁ᵀΘ₁) with unit-norm columns, the number printed in the paper's section 7.
        residual: τ - Θ₁ p₁ (M,).
    """

    values: Array
    influence: Array
    normal_inverse: Array
    condition: float
    residual: Array


class Estimator(Protocol):
    """Solves the rows of a campaign."""

    @property
    def name(self) -> str:
        """As results name the method."""

    def __call__(self, system: LinearSystem) -> Solution:
        """Solve a system.

        Raises:
            EstimationError: a parameter has no excitation, or a combination of parameters has none; named.
        """


@dataclass(frozen=True)
class LeastSquares:
    """(25): all rows count alike."""

    name: str = "least squares"

    def __call__(self, system: LinearSystem) -> Solution:
        """Solve (25).

        Raises:
            EstimationError: a parameter has no excitation, or a combination of parameters has none; named.
        """
        return solve(system)


@dataclass(frozen=True)
class WeightedLeastSquares:
    """Each part counts by the variance of its own residual under ordinary least squares (feasible generalized LS).

    Better where steps or coordinates are of different noise, a little worse where they are not: the variances are
    estimated. Noise that changes within a part, and its colour, are not weighted.
    """

    name: str = "weighted least squares"

    def __call__(self, system: LinearSystem) -> Solution:
        """Solve twice: for the residuals, and with their weights.

        Raises:
            EstimationError: a parameter has no excitation, or a combination of parameters has none; named.
        """
        plain = solve(system)
        if system.part is None:
            return plain
        squares = np.bincount(system.part, plain.residual**2)
        mean = squares / np.maximum(np.bincount(system.part), 1)
        weight = 1 / np.sqrt(np.maximum(mean, _LEAST * mean.max()))[system.part]
        weighted = solve(replace(system, regressor=system.regressor * weight[:, None], torque=system.torque * weight))
        return replace(
            plain,
            values=weighted.values,
            influence=weighted.influence * weight[:, None],
            residual=system.torque - system.regressor @ weighted.values,
        )


ORDINARY: Final = LeastSquares()
"""What the paper does, and what is done where nobody says otherwise."""

_LEAST: Final = 1e-6
"""Smallest variance of a part over the largest that a weight believes."""


def solve(system: LinearSystem) -> Solution:
    """Solve (25); W holds the inverse column norms, so that Θ₁ W has unit-norm columns.

    Raises:
        EstimationError: a parameter has no excitation, or a combination of parameters has none; named.
    """
    scale = np.linalg.norm(system.regressor, axis=0)
    _refuse_missing(system.names, scale)
    scaled = system.regressor / scale
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    _refuse_dependent(system.names, singular, right)
    values = right.T @ ((left.T @ system.torque) / singular) / scale
    normal_inverse = (right.T / singular**2) @ right / np.outer(scale, scale)
    return Solution(
        values=values,
        influence=system.regressor @ normal_inverse,
        normal_inverse=normal_inverse,
        condition=float((singular[0] / singular[-1]) ** 2),
        residual=system.torque - system.regressor @ values,
    )


def _refuse_missing(names: Sequence[str], scale: Array) -> None:
    missing = [name for name, norm in zip(names, scale, strict=True) if not norm > 0]
    if missing:
        raise EstimationError(
            f"Nothing in the data excites {', '.join(missing)}.",
            "Add the step that does (steering_left: C_l d_vl d_cl; steering_right: C_r d_vr d_cr; straight: "
            "m_ch; rotation: C_ch; wheel_lifted: B_w), with motion above the stiction threshold.",
        )


def _refuse_dependent(names: Sequence[str], singular: Array, right: Array) -> None:
    if singular[-1] >= RANK_TOLERANCE * singular[0]:
        return
    weak = right[-1]
    involved = [name for name, weight in zip(names, weak, strict=True) if abs(weight) > 0.3]
    raise EstimationError(
        f"The excitation does not tell {' from '.join(involved)} (singular values down to "
        f"{singular[-1] / singular[0]:.1e} of the largest).",
        "Drive with more varied speeds and larger accelerations.",
    )
