"""The states that a solver eliminates before it solves for those that are coupled, as straight code without a loop.

Of (shift I - J) k = r the first states, the rates of chassis and steering, are coupled densely; the others hang on them
and on a few of their own kind: a wheel on its floor, an angle on its rate, the memory of a joint on its lagged load. LU
decomposition with the pivots on the diagonal, in an order that fills little; its factors are computed once for a step,
and used for each of its stages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ident.plant.symbolic import Expression


@dataclass(frozen=True)
class Elimination:
    """What the solver does with a Jacobian, symbols and results.

    Attributes:
        jacobian: its nonzeros, symbols.
        shift: symbol.
        factors: of the states eliminated, from jacobian and shift; `held` are symbols for them.
        matrix: what is left for the coupled states, by rows.
        held: symbols of the factors.
        right: right side, symbols.
        reduced: the same with the states eliminated; of the coupled ones first.
        solved: symbols: the solution of the coupled states, then what `reduced` has of the others.
        solution: of all states.
    """

    jacobian: Expression
    shift: Expression
    factors: Expression
    matrix: Expression
    held: Expression
    right: Expression
    reduced: Expression
    solved: Expression
    solution: Expression


@dataclass(frozen=True)
class _Pivot:
    """One state eliminated.

    Attributes:
        state: which.
        reciprocal: of the pivot.
        below: row -> what is subtracted of the pivot's row.
        beside: column -> the pivot's row.
    """

    state: int
    reciprocal: Expression
    below: dict[int, Expression]
    beside: dict[int, Expression]


def elimination(jacobian: Expression, coupled: int) -> Elimination:
    """Of a Jacobian (n, n), whose first states are coupled; entries that are constant are written as such."""
    count, entries = jacobian.size1(), jacobian.nonzeros()
    symbols, shift = ca.SX.sym("jacobian", len(entries)), ca.SX.sym("shift")
    values = [entry if entry.is_constant() else symbols[place] for place, entry in enumerate(entries)]
    matrix = {index: {index: shift} for index in range(count)}
    for row, column, value in zip(*jacobian.sparsity().get_triplet(), values, strict=True):
        matrix[row][column] = matrix[row].get(column, 0) - value
    pivots = _eliminate(matrix, coupled)
    left = ca.vertcat(*(matrix[row].get(column, ca.SX(0)) for row in range(coupled) for column in range(coupled)))
    computed = [value for pivot in pivots for value in _values(pivot) if not value.is_constant()]
    held = ca.SX.sym("factors", len(computed))
    right, solved = ca.SX.sym("right", count), ca.SX.sym("solved", count)
    kept = _named(pivots, iter(ca.vertsplit(held)))
    return Elimination(
        symbols, shift, ca.vertcat(*computed), left, held, right, _forward(kept, right), solved, _back(kept, solved)
    )


def _eliminate(matrix: dict[int, dict[int, Any]], coupled: int) -> list[_Pivot]:
    """Eliminate all rows from `coupled` on; those before are left changed."""
    waiting, pivots = set(range(coupled, len(matrix))), []
    while waiting:
        state = min(sorted(waiting), key=lambda each: _work(matrix, each))
        waiting.remove(state)
        row = matrix.pop(state)
        reciprocal = 1 / row.pop(state)
        below = {other: entries.pop(state) * reciprocal for other, entries in matrix.items() if state in entries}
        for other, factor in below.items():
            for column, value in row.items():
                matrix[other][column] = matrix[other].get(column, 0) - factor * value
        pivots.append(_Pivot(state, reciprocal, below, row))
    return pivots


def _work(matrix: dict[int, dict[int, Any]], state: int) -> int:
    """Products that eliminating a state takes (Markowitz)."""
    below = sum(state in entries for other, entries in matrix.items() if other != state)
    return below * (len(matrix[state]) - 1)


def _values(pivot: _Pivot) -> list[Expression]:
    return [pivot.reciprocal, *pivot.below.values(), *pivot.beside.values()]


def _named(pivots: list[_Pivot], names: Any) -> list[_Pivot]:
    """The same with a symbol for each value that is computed."""

    def name(value: Expression) -> Expression:
        return value if value.is_constant() else next(names)

    return [
        _Pivot(
            pivot.state,
            name(pivot.reciprocal),
            {row: name(value) for row, value in pivot.below.items()},
            {column: name(value) for column, value in pivot.beside.items()},
        )
        for pivot in pivots
    ]


def _forward(pivots: list[_Pivot], right: Expression) -> Expression:
    values = ca.vertsplit(right)
    for pivot in pivots:
        for row, factor in pivot.below.items():
            values[row] -= factor * values[pivot.state]
    return ca.vertcat(*values)


def _back(pivots: list[_Pivot], solved: Expression) -> Expression:
    values = ca.vertsplit(solved)
    for pivot in reversed(pivots):
        known = sum((value * values[column] for column, value in pivot.beside.items()), ca.SX(0))
        values[pivot.state] = (values[pivot.state] - known) * pivot.reciprocal
    return ca.vertcat(*values)
