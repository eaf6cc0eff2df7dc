"""What rows that nothing is fitted to say against an effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.check.fitted import Fitted
from ident.diagnosis.check.remainder import told_of
from ident.diagnosis.observations.linear import RANK

Array = NDArray[np.float64]


def deviations_against(fitted: Fitted) -> Array:
    """By how many deviations (K,) each effect makes the confirming rows less likely, all else refitted without it.

    The deviation is that of what the noise there, and what the fit leaves open of every number, do to the sum of
    squares.
    """
    rows, sets = fitted.rows, [fitted.found.variants, *(fitted.others(index) for index in range(fitted.count))]
    models = [rows.stack(list(fitted.held_out_refit(one).blocks)) for one in sets]
    white = fitted.found.whitener.apply(rows, rows.target[:, None] - np.stack(models, axis=1))
    white, told = white[rows.confirming], _told_rows(fitted)[rows.confirming]
    # Where the effects say nothing, the rows shall say nothing of them. What is white already has no edges there.
    without = white[:, 1:]
    whole = np.where(told[:, None], white[:, :1], without)
    added = without - whole
    deviation = 2 * np.sqrt(np.sum(added**2, axis=0) + _left_open(fitted, added))
    more = np.sum(whole**2, axis=0) - np.sum(without**2, axis=0)
    return np.asarray(np.divide(more, deviation, out=np.zeros_like(more), where=deviation > 0))


def _left_open(fitted: Fitted, added: Array) -> Array:
    """Variance (k,) along series (m, k) of white confirming rows of what the fitted rows leave open of the model."""
    columns = np.hstack([fitted.rows.baseline, fitted.regression.fitted_columns_of(fitted.found.variants)])
    white, confirming = fitted.found.whitener.apply(fitted.rows, columns), fitted.rows.confirming
    design = np.vstack([white[~confirming], fitted.regression.prior_jacobian(white.shape[1])])
    size = np.linalg.norm(design, axis=0)
    size[size == 0] = 1.0
    # The shortest x of Fᵀx = r has the square rᵀ(FᵀF)⁻¹r.
    shortest = np.linalg.lstsq((design / size).T, white[confirming].T @ added / size[:, None], rcond=RANK)[0]
    return np.asarray(np.sum(shortest**2, axis=0))


def _told_rows(fitted: Fitted) -> NDArray[np.bool_]:
    """Rows (n,) of which the effects say something."""
    if not fitted.told:
        return np.ones(len(fitted.rows), dtype=np.bool_)
    told = zip(fitted.rows.blocks, fitted.told, strict=True)
    return np.concatenate([told_of(kept, one, means=True) for (_, kept), one in told])
