"""Column-scaled least squares (25), with known parameters moved to the right-hand side (24)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
    """

    names: tuple[str, ...]
    regressor: Array
    torque: Array


@dataclass(frozen=True)
class Solution:
    """Least-squares solution.

    Attributes:
        values: (n,).
        normal_inverse: (Θ₁ᵀΘ₁)⁻¹ (n, n).
        condition: cond(Θ₁ᵀΘ₁) with unit-norm columns, the number printed in the paper's section 7.
        residual: τ - Θ₁ p₁ (M,).
    """

    values: Array
    normal_inverse: Array
    condition: float
    residual: Array


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
    inverse = (right.T / singular**2) @ right
    return Solution(
        values=values,
        normal_inverse=inverse / np.outer(scale, scale),
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
