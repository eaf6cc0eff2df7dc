"""What stands near a law: the rows that it acts in, and the effect of the library that can add most of what it adds."""

from __future__ import annotations

from collections.abc import Collection

from ident.diagnosis.evidence import cosines
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression, Slot
from ident.diagnosis.rows import Column


def channel_of(problem: Problem, column: Column) -> str:
    """Of the rows in which a variant acts."""
    series = problem.candidates[column.candidate].variants[column.variant].columns
    return str(next(block.channel for block, one in zip(problem.blocks, series, strict=True) if one is not None))


def nearest_name(regression: Regression, slot: Slot, variant: int, laws: Collection[int]) -> tuple[str, float] | None:
    """Key of the effect that can add most of what a law adds, and the cosine of both; None where none can.

    Args:
        regression: of the rows.
        slot: place of the law in the explanation.
        variant: of the law.
        laws: candidates that are laws themselves.
    """
    cosine, owners = cosines(slot.evidence, variant), regression.owners
    named = [other for other in range(len(owners)) if owners[other] not in laws and cosine[other] > 0]
    best = max(named, key=lambda other: float(cosine[other]), default=None)
    return None if best is None else (regression.key(best), float(cosine[best]))
