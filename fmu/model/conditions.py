"""When a value has to be computed at all: effects of size zero add nothing, and take no time.

A value *vanishes* with some sizes if it is zero where all of them are: a size itself, its product with anything, a sum
of such. It is *needed* unless all that is made of it is multiplied with what vanishes. Both are sets of sizes, one of
which must not be zero; where they all are, the value is left at zero. Nothing jumps: what is left out is exactly zero,
or is multiplied with it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from fmu.model.operations import INPUT, Listing, Operation

Sizes = frozenset[int]
"""Places of sizes among the parameters; one of them has to be other than zero."""


@dataclass(frozen=True)
class Condition:
    """When a value is computed; None is always.

    Attributes:
        vanishing: else it is zero.
        needed: else nobody asks.
    """

    vanishing: Sizes | None = None
    needed: Sizes | None = None

    @property
    def tests(self) -> tuple[Sizes, ...]:
        """Sets of sizes, of each of which one must not be zero."""
        return tuple(dict.fromkeys(each for each in (self.vanishing, self.needed) if each is not None))


ALWAYS = Condition()

_PASSING = frozenset({"neg", "sq", "sqrt", "twice", "fabs", "sign", "sin", "tan", "asin", "atan", "tanh"})
"""Operations that make zero of zero."""


def conditions(listed: Listing, argument: int, sizes: Collection[int]) -> list[Condition]:
    """Of each value of a listing, whose parameters are an argument, and some of those the sizes of effects."""
    vanishing = _vanishing(listed, argument, frozenset(sizes))
    needed = _needed(listed, vanishing)
    return [Condition(*both) for both in zip(vanishing, needed, strict=True)]


def _vanishing(listed: Listing, argument: int, sizes: Sizes) -> list[Sizes | None]:
    found: list[Sizes | None] = []
    for each in listed.operations:
        if each.kind == INPUT:
            place = each.source[1]
            found.append(frozenset({place}) if each.source[0] == argument and place in sizes else None)
        else:
            found.append(_with_operands(each, [found[operand] for operand in each.operands]))
    return found


def _with_operands(operation: Operation, operands: list[Sizes | None]) -> Sizes | None:
    known = [each for each in operands if each is not None]
    if operation.kind == "mul" and known:
        return min(known, key=len)
    if operation.kind in ("add", "sub", "fmax", "fmin") and len(known) == 2:
        return known[0] | known[1]
    if operation.kind in _PASSING or operation.kind == "div":
        return operands[0]
    return None


def _needed(listed: Listing, vanishing: list[Sizes | None]) -> list[Sizes | None]:
    """From the results back; None is always."""
    count = len(listed.operations)
    asked: list[list[Sizes | None]] = [[] for _ in range(count)]
    for result in listed.results:
        for number in result:
            asked[number].append(None)
    found: list[Sizes | None] = [None] * count
    for number in range(count - 1, -1, -1):
        wanted = [each for each in asked[number] if each is not None]
        found[number] = frozenset().union(*wanted) if len(wanted) == len(asked[number]) else None
        operation = listed.operations[number]
        for place, operand in enumerate(operation.operands):
            other = vanishing[operation.operands[1 - place]] if operation.kind == "mul" else None
            asked[operand].append(_narrower(found[number], other))
    return found


def _narrower(one: Sizes | None, other: Sizes | None) -> Sizes | None:
    """Of two conditions that both hold, one alone; it holds as well."""
    known = [each for each in (one, other) if each is not None]
    return min(known, key=len, default=None)
