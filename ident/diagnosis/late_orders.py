"""Orders of ripples that show once other causes are known: beside a delay, its spectrum hides those of the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.diagnosis.orders import price_of, shown_orders, waves
from ident.diagnosis.problem import Problem, Variant
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import Column
from ident.diagnosis.shapes import Shaped, search


def with_late_orders(found: Shaped) -> Shaped:
    """The search gone on with the orders that are left beside what it has taken, as often as that takes more."""
    while found.taken:
        grown = search(*_tried(found), found.taken)
        if not _causes(found) < _causes(grown):
            break
        found = grown
    return found


def _tried(found: Shaped) -> tuple[tuple[Problem, ...], Regression]:
    """The problems and their rows with a variant more for every order that is left."""
    first, layout = found.problems[0], found.regression.rows.layout
    owners = _causes(found)
    taken = [_variant(first, layout[one]) for one in found.taken]
    orders = shown_orders(first, _left_out(first, owners), taken)
    problems, rows = found.problems, found.regression.rows
    columns, more, end = [rows.columns], list(layout), rows.columns.shape[1]
    for number, (peaks, tried) in orders.items():
        before = len(first.candidates[number].variants)
        added = [waves(problem, problem.candidates[number], peaks) for problem in problems]
        problems = tuple(_with(problem, number, variants) for problem, variants in zip(problems, added, strict=True))
        for place, several in enumerate(zip(*added, strict=True)):
            stacked = rows.stack([column for one in several for column in one.columns], 2)
            columns.append(stacked)
            where = slice(end, end + 2)
            more.append(Column(number, before + place, where, -np.inf, (0.0, 0.0), price=price_of(tried)))
            end += 2
    wider = replace(rows, columns=np.hstack(columns), layout=tuple(more))
    return problems, Regression(problems[0], wider, found.regression.settings, found.regression.seed)


def _left_out(problem: Problem, owners: frozenset[int]) -> list[int]:
    """Candidates that are not taken, and that the records do not speak against."""
    numbered = enumerate(problem.candidates)
    return [number for number, one in numbered if number not in owners and not one.excluded]


def _variant(problem: Problem, column: Column) -> Variant:
    return problem.candidates[column.candidate].variants[column.variant]


def _with(problem: Problem, number: int, variants: tuple[Variant, ...]) -> Problem:
    candidates = list(problem.candidates)
    candidates[number] = replace(candidates[number], variants=(*candidates[number].variants, *variants))
    return replace(problem, candidates=tuple(candidates))


def _causes(found: Shaped) -> frozenset[int]:
    return frozenset(found.regression.owners[variant] for variant in found.taken)
