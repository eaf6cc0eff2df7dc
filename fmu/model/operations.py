"""Expressions as a list of operations, each value once, before they are written as C."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import casadi as ca

from ident.plant.symbolic import Expression

INPUT: Final = "input"
"""An entry of an argument."""

CONSTANT: Final = "constant"

_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {
        getattr(ca, f"OP_{name.upper()}"): name
        for name in (
            *("add", "sub", "mul", "div", "neg", "sq", "sqrt", "twice", "inv", "fabs", "sign", "fmax", "fmin", "floor"),
            *("sin", "cos", "tan", "asin", "acos", "atan", "tanh", "exp", "log", "atan2", "pow", "constpow"),
            *("lt", "le", "eq", "ne", "not", "and", "or", "if_else_zero"),
        )
    }
)
"""CasADi's numbers of the operations that equations may have."""


@dataclass(frozen=True)
class Operation:
    """A value and how it is computed.

    Attributes:
        kind: an operation by its name, `INPUT` or `CONSTANT`.
        operands: numbers of other values.
        source: of an input, argument and place in it.
        number: of a constant.
    """

    kind: str
    operands: tuple[int, ...] = ()
    source: tuple[int, int] = (0, 0)
    number: float = 0.0


@dataclass(frozen=True)
class Listing:
    """Values in an order in which they can be computed.

    Attributes:
        operations: operands come before what is made of them.
        results: for each result the numbers of its values.
    """

    operations: tuple[Operation, ...]
    results: tuple[tuple[int, ...], ...]


def listing(arguments: Sequence[Expression], results: Sequence[Expression]) -> Listing:
    """Of dense results; what several values are divided by is inverted once.

    Raises:
        KeyError: an operation that is not known here.
    """
    function = ca.Function("listed", list(arguments), ca.cse([ca.densify(result) for result in results]))
    found: dict[Operation, int] = {}
    held: dict[int, int] = {}
    places = [[0] * result.numel() for result in results]
    for k in range(function.n_instructions()):
        kind, entering, leaving = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if kind == ca.OP_OUTPUT:
            places[leaving[0]][leaving[1]] = held[entering[0]]
        else:
            operation = _operation(function, k, kind, [held[slot] for slot in entering] if kind in _NAMES else entering)
            held[leaving[0]] = found.setdefault(operation, len(found))
    whole = Listing(tuple(found), tuple(map(tuple, places)))
    return _pruned(_with_inverses(whole))


def _operation(function: Any, k: int, kind: int, entering: Sequence[int]) -> Operation:
    if kind == ca.OP_INPUT:
        return Operation(INPUT, source=(entering[0], entering[1]))
    if kind == ca.OP_CONST:
        return Operation(CONSTANT, number=float(function.instruction_constant(k)))
    return Operation(_NAMES[kind], tuple(entering))


def _with_inverses(whole: Listing) -> Listing:
    """A division takes five times as long as a product."""
    operations = whole.operations
    divisors = Counter(each.operands[-1] for each in operations if each.kind in ("div", "inv"))
    found: dict[Operation, int] = {}
    moved: list[int] = []

    def number(operation: Operation) -> int:
        return found.setdefault(operation, len(found))

    for each in operations:
        operands = tuple(moved[operand] for operand in each.operands)
        divisor = each.operands[-1] if each.kind == "div" else -1
        if divisor >= 0 and divisors[divisor] > 1 and operations[divisor].kind != CONSTANT:
            inverse = number(Operation("inv", operands[1:]))
            moved.append(number(Operation("mul", (operands[0], inverse))))
        else:
            moved.append(number(replace(each, operands=operands)))
    return Listing(tuple(found), tuple(tuple(moved[place] for place in result) for result in whole.results))


def _pruned(whole: Listing) -> Listing:
    """Without values that no result needs."""
    needed = {place for result in whole.results for place in result}
    for number in range(len(whole.operations) - 1, -1, -1):
        if number in needed:
            needed.update(whole.operations[number].operands)
    kept = sorted(needed)
    moved = {number: place for place, number in enumerate(kept)}
    operations = (whole.operations[number] for number in kept)
    return Listing(
        tuple(replace(each, operands=tuple(moved[operand] for operand in each.operands)) for each in operations),
        tuple(tuple(moved[number] for number in result) for result in whole.results),
    )
