"""What records say of a candidate that somebody knows: the most that a search, which does not know it, could find."""

from __future__ import annotations

import math
from collections.abc import Collection

from threadpoolctl import threadpool_limits

from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.asked import asked_of

NOTHING = -math.inf
"""Log evidence of a candidate that the rows do not show at all, or that is none of them."""


def log_evidence_of(fit: Problem, confirm: Problem, keys: Collection[str]) -> dict[str, float]:
    """Log evidence of candidates, each by itself against nothing, in all rows, its numbers integrated.

    Who knows a candidate pays nothing for its choice among names and places.

    Args:
        fit, confirm: the records.
        keys: of the candidates, `name@place`.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        asked = asked_of(with_orders((fit, confirm)))
        fitter, nothing = asked.fitter, asked.fitter.nothing
        tables = fitter.among_all(nothing).tables()
        found = dict.fromkeys(keys, NOTHING)
        for index, hypothesis in enumerate(asked.design.hypotheses):
            table = tables.get(index)
            if hypothesis.key in found and table is not None and table.is_there and index not in fitter.invisible:
                with_it = fitter.state({index: table.best}, nothing).log_posterior + hypothesis.choice
                found[hypothesis.key] = with_it - nothing.log_posterior
        return found
