"""What records say of a candidate that somebody knows: the most that a search, which does not know it, could find."""

from __future__ import annotations

import math
from collections.abc import Collection

from threadpoolctl import threadpool_limits

from ident.diagnosis.directions import directions
from ident.diagnosis.evidence import scatter
from ident.diagnosis.orders import with_orders
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import make_rows
from ident.diagnosis.settings import Settings

NOTHING = -math.inf
"""Log evidence of a candidate that the rows do not show at all, or that is none of them."""


def log_evidence_of(fit: Problem, confirm: Problem, keys: Collection[str], *, seed: int) -> dict[str, float]:
    """Log evidence of candidates, each by itself against nothing, in all rows, its best variant taken.

    The colour of the noise is that of what the variant leaves: who knows it need not allow for any other.

    Args:
        fit, confirm: the records.
        keys: of the candidates, `name@place`.
        seed: of the stretches' signs, which do not matter here.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        fit, confirm = with_orders((fit, confirm))
        regression = Regression(fit, make_rows(fit, confirm), Settings(), seed)
        variants = {key: [v for v in range(len(regression.owners)) if regression.key(v) == key] for key in keys}
        return {
            key: max((_log_evidence(regression, one) for one in own), default=NOTHING) for key, own in variants.items()
        }


def _log_evidence(regression: Regression, variant: int) -> float:
    """Half the scaled likelihood ratio of a variant, less the price of its coefficients."""
    column = regression.rows.layout[variant]
    white = regression.white(regression.colour_beside(regression.columns_of((variant,))), ())
    found = directions(white, [column])
    size = found.basis.shape[1]
    if not size:
        return NOTHING
    ratio = float(found.ratios(found.basis.T @ found.residual)[0])
    scaled = ratio / scatter(found.basis, found.residual, white.stretch)
    return float(0.5 * scaled - 0.5 * size * math.log(len(white.target)) - column.price)
