"""The diagnosis of a servo axis, or of several coupled ones, from their records."""

from __future__ import annotations

from collections.abc import Sequence

from ident.gap.axis.problem import axis_problem, axis_reference, refuse_other_axes
from ident.gap.findings import Findings
from ident.gap.judge import judge
from ident.gap.split import split_problem
from ident.records.axis_record import AxisRecord


def diagnose_axis(
    fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord], *, seed: int, cutoff: float | None = None
) -> Findings:
    """What the model M a + Fv v + Fc sign(v) + offset lacks.

    Args:
        fit: records that causes are looked for in.
        confirm: independent records of the same axes; none: a part of `fit` confirms.
        seed: of the surrogates.
        cutoff: of the position filter [rad/s]; None: chosen from the records.

    Raises:
        RecordError: the records do not have the same axes.
        EstimationError: a record is too short, or an axis does not move.
    """
    refuse_other_axes([*fit, *confirm])
    reference = axis_reference(fit, cutoff)
    fitted = axis_problem(fit, reference)
    if confirm:
        return judge(fitted, axis_problem(confirm, reference), seed=seed)
    return judge(*split_problem(fitted), seed=seed)
