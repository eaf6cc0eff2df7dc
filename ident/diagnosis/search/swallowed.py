"""What noise without repeats may have swallowed: a law that is smooth in its variable, and no white noise in time.

Where nothing repeats, noise is whatever is left, and an autoregression predicts a law as well as it predicts noise. So
rows are asked once more with the noise beside the law that explains most of what is left, colour apart. Which of both
is likelier, noise or law, their posteriors say: that of a noise has the determinant of its covariance in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.law.learning import Designs
from ident.diagnosis.observations.linear import orthonormal
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.observations.whitening import Left
from ident.diagnosis.problem import Problem

Array = NDArray[np.float64]


def beside_a_law(problem: Problem, rows: Rows, designs: Designs, left: Left) -> Left | None:
    """What is left beside the law that explains most of it; None where there are no laws.

    Args:
        problem: whose laws are asked for.
        rows: of it.
        designs: of its laws.
        left: what a set leaves of the rows.
    """
    level = rows.levels(left.residual)
    target, model = left.residual / level, orthonormal(rows.baseline / level[:, None])
    best, explained = None, 0.0
    for number, dependence in enumerate(problem.dependences):
        # What is made of a measured acceleration has the noise of the rows in it.
        if dependence.is_noisy or designs.knots(number) is None:
            continue
        columns = designs.columns(number) / level[:, None]
        basis = orthonormal(columns - model @ (model.T @ columns))
        power = float(np.sum((basis.T @ target) ** 2))
        if power > explained:
            best, explained = basis, power
    if best is None:
        return None
    return Left(level * (target - best @ (best.T @ target)), left.fitted + best.shape[1])
