"""Effects that are not linear in their size, seen again at the size that was found.

The search knows an effect by its columns, taken near zero. Of a large one, what the columns miss looks like another
effect. So each effect taken gets one more variant, the shape that it has at the values fitted, before the search goes
on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.linear import least_squares
from ident.diagnosis.problem import Problem, Variant
from ident.diagnosis.refit import Part, refit
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import Column
from ident.diagnosis.search import extended, joined, settled, without
from ident.diagnosis.whitening import Whitener

Array = NDArray[np.float64]

NEGLIGIBLE: Final = 1.0
"""Sum of squares, in units of the noise, that the columns of an effect may miss of it."""

ROUNDS: Final = 20
"""Of growth and shaping at most; a handful of them end every search but one that goes in circles."""


@dataclass(frozen=True)
class Shaped:
    """What the search has come to.

    Attributes:
        problems: to fit and to confirm, candidates with the variants added.
        regression: of them.
        taken: variants, in the order of the search.
    """

    problems: tuple[Problem, ...]
    regression: Regression
    taken: tuple[int, ...]


def search(problems: Sequence[Problem], regression: Regression, taken: tuple[int, ...] = ()) -> Shaped:
    """Forward in singles and pairs; every effect by its shape before the next one is looked for.

    Two effects can each take the other's place once they have their shapes: the one found first stands then. What is
    `taken` beforehand is given up where the others make it superfluous.
    """
    found, seen = Shaped(tuple(problems), regression, settled(regression, taken)), dict[frozenset[int], Shaped]()
    for _ in range(ROUNDS):
        grown = extended(found.regression, found.taken)
        if grown == found.taken:
            break
        now, next_ones = _owners(found.regression, found.taken), _owners(found.regression, grown)
        seen.setdefault(now, found)
        if next_ones != now and next_ones in seen:
            found = seen[next_ones]
            break
        found = _against_rivals(shaped(found.problems, found.regression, grown))
    # Not before: as columns, such a whole is less than its parts, which have their shapes already.
    whole = joined(found.regression, found.taken, found.regression.broad)
    return found if whole == found.taken else shaped(found.problems, found.regression, whole)


def _against_rivals(found: Shaped) -> Shaped:
    """Effects by their shapes against those that may stand in their places, by theirs."""
    taken, before = found.taken, len(found.regression.rows.layout)
    for place in range(len(taken)):
        for rival in _rivals(found, place, before):
            instead = (*taken[:place], rival, *taken[place + 1 :])
            found = replace(shaped(found.problems, found.regression, instead, (place,)), taken=taken)
    added = len(found.regression.rows.layout) > before
    return replace(found, taken=settled(found.regression, taken)) if added else found


def _rivals(found: Shaped, place: int, before: int) -> list[int]:
    """Variants that come as near to the column of an effect as its shape changed the evidence, for better or worse.

    Those without any other shape than their column, or whose shape is known since there were `before` variants, are not
    among them.
    """
    regression, variant = found.regression, found.taken[place]
    layout, owners = regression.rows.layout, regression.owners
    origin = layout[variant].shape_of
    if origin is None:
        return []
    slot = regression.slot(without(found.taken, place), regression.whitener(found.taken))
    log_evidence = slot.evidence.log_evidence
    if not np.isfinite(log_evidence[[origin, variant]]).all():
        return []
    least = log_evidence[origin] - abs(log_evidence[variant] - log_evidence[origin])
    known = {*_owners(regression, found.taken), *owners[before:]}
    return [
        one
        for one in slot.variants
        if log_evidence[one] > least
        and owners[one] not in known
        and found.problems[0].candidates[owners[one]].contribution is not None
    ]


def _owners(regression: Regression, taken: tuple[int, ...]) -> frozenset[int]:
    return frozenset(regression.owners[variant] for variant in taken)


def shaped(
    problems: Sequence[Problem], regression: Regression, taken: tuple[int, ...], places: Sequence[int] | None = None
) -> Shaped:
    """Effects by the shapes that they have at their fitted values, where their columns miss something.

    Args:
        problems, regression: to fit and to confirm.
        taken: variants that are fitted together.
        places: of those that get a shape among them; None: all.
    """
    owners, candidates = regression.owners, problems[0].candidates
    if all(candidates[owners[variant]].contribution is None for variant in taken):
        return Shaped(tuple(problems), regression, taken)
    rows, whitener = regression.rows, regression.whitener(taken)
    parts = refit(problems, regression, taken, whitener, np.ones(len(rows), dtype=bool)).parts
    changed, columns, layout, now = list(problems), [rows.columns], list(rows.layout), list(taken)
    for place, (variant, part) in enumerate(zip(taken, parts, strict=True)):
        if places is not None and place not in places:
            continue
        size, column = abs(float(part.values[0])), rows.stack(part.added)[:, None]
        if size == 0 or _missed(regression, whitener, variant, column) < NEGLIGIBLE:
            continue
        number, end = owners[variant], layout[-1].place.stop
        now[place] = len(layout)
        origin = layout[variant].shape_of if layout[variant].shape_of is not None else variant
        count = len(changed[0].candidates[number].variants)
        layout.append(Column(number, count, slice(end, end + 1), 0.0, (0.0, 0.0), shape_of=origin))
        columns.append(column / size)
        changed = _with_variant(changed, number, part, size)
    wider = replace(rows, columns=np.hstack(columns), layout=tuple(layout))
    again = Regression(changed[0], wider, regression.settings, regression.seed) if tuple(now) != taken else regression
    return Shaped(tuple(changed), again, tuple(now))


def _missed(regression: Regression, whitener: Whitener, variant: int, column: Array) -> float:
    """Sum of squares of a whitened column that the columns of a variant cannot make."""
    rows = regression.rows
    white = whitener.apply(rows, np.hstack([regression.columns_of((variant,)), column]))
    left = white[:, -1] - white[:, :-1] @ least_squares(white[:, :-1], white[:, -1])
    return float(left @ left)


def _with_variant(problems: Sequence[Problem], number: int, part: Part, size: float) -> list[Problem]:
    changed, end = [], 0
    for problem in problems:
        series = part.added[end : end + len(problem.blocks)]
        end += len(problem.blocks)
        variant = Variant(tuple(None if one is None else one[:, None] / size for one in series), _scaled(part, size))
        candidates = list(problem.candidates)
        candidates[number] = replace(candidates[number], variants=(*candidates[number].variants, variant))
        changed.append(replace(problem, candidates=tuple(candidates)))
    return changed


def _scaled(part: Part, size: float) -> Callable[[Array], Array]:
    """Coefficient of the shape -> all numbers of the effect, the first of them in proportion."""

    def start(coefficients: Array) -> Array:
        numbers = part.numbers.copy()
        numbers[0] *= float(coefficients[0]) / size
        return numbers

    return start
