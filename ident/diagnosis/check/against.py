"""What rows that nothing is fitted to say against an effect."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.check.fitted import Fitted
from ident.diagnosis.check.remainder import told_of
from ident.diagnosis.observations.linear import RANK

Array = NDArray[np.float64]


def deviations_against(fitted: Fitted, index: int) -> float:
    """By how many deviations an effect makes the confirming rows less likely, all else refitted without it.

    The deviation is that of what the noise there, and what the fit leaves open of every number, do to the sum of
    squares.

    Args:
        fitted: all effects.
        index: of the one.
    """
    rows = fitted.rows
    models = [fitted.held_out_refit(variants).blocks for variants in (fitted.found.variants, fitted.others(index))]
    left = np.stack([rows.target - rows.stack(list(one)) for one in models], axis=1)
    # Where the effects say nothing, the rows shall say nothing of them.
    untold = ~_told_rows(fitted)
    left[untold, 0] = left[untold, 1]
    whole, without = fitted.found.whitener.apply(rows, left)[rows.confirming].T
    added = without - whole
    variance = float(added @ added) + _left_open(fitted, added)
    return float(whole @ whole - without @ without) / (2 * math.sqrt(variance)) if variance > 0 else 0.0


def _left_open(fitted: Fitted, added: Array) -> float:
    """Variance along a series (m,) of white confirming rows of what the fitted rows leave open of the model."""
    columns = np.hstack([fitted.rows.baseline, fitted.regression.columns_of(fitted.found.variants)])
    white, confirming = fitted.found.whitener.apply(fitted.rows, columns), fitted.rows.confirming
    design = np.vstack([white[~confirming], fitted.regression.prior_jacobian(white.shape[1])])
    size = np.linalg.norm(design, axis=0)
    size[size == 0] = 1.0
    # The shortest x of Fᵀx = r has the square rᵀ(FᵀF)⁻¹r.
    shortest = np.linalg.lstsq((design / size).T, white[confirming].T @ added / size, rcond=RANK)[0]
    return float(shortest @ shortest)


def _told_rows(fitted: Fitted) -> NDArray[np.bool_]:
    """Rows (n,) of which the effects say something."""
    if not fitted.told:
        return np.ones(len(fitted.rows), dtype=np.bool_)
    told = zip(fitted.rows.blocks, fitted.told, strict=True)
    return np.concatenate([told_of(kept, one, means=True) for (_, kept), one in told])
