"""Expressions as C functions of plain arrays, without loops; what effects of size zero add is left out at run time."""

from __future__ import annotations

import heapq
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from fmu.model.conditions import ALWAYS, Condition, conditions
from fmu.model.operations import CONSTANT, INPUT, Listing, Operation, listing
from ident.plant.symbolic import Expression

PARAMETERS: Final = "p"
"""Name of the argument that has the sizes of effects."""

_WRITTEN: Final[Mapping[str, str]] = MappingProxyType(
    {
        **{name: f"{{0}} {sign} {{1}}" for name, sign in (("add", "+"), ("sub", "-"), ("mul", "*"), ("div", "/"))},
        **{name: f"{name}({{0}})" for name in ("sqrt", "fabs", "sin", "cos", "tan", "asin", "acos", "atan")},
        **{name: f"{name}({{0}})" for name in ("exp", "log", "floor")},
        **{name: f"{{0}} {sign} {{1}}" for name, sign in (("lt", "<"), ("le", "<="), ("eq", "=="), ("ne", "!="))},
        "tanh": "qo_tanh({0})",
        "neg": "-{0}",
        "sq": "{0} * {0}",
        "twice": "2.0 * {0}",
        "inv": "1.0 / {0}",
        "sign": "{0} < 0.0 ? -1.0 : {0} > 0.0 ? 1.0 : {0}",
        "fmax": "{0} > {1} ? {0} : {1}",
        "fmin": "{0} < {1} ? {0} : {1}",
        "atan2": "atan2({0}, {1})",
        "pow": "pow({0}, {1})",
        "constpow": "pow({0}, {1})",
        "not": "{0} == 0.0",
        "and": "{0} != 0.0 && {1} != 0.0",
        "or": "{0} != 0.0 || {1} != 0.0",
        "if_else_zero": "{0} != 0.0 ? {1} : 0.0",
    }
)
"""Operations in C, of operands that are names or numbers; they need `HEADERS`."""

HEADERS: Final = ("<math.h>", '"qo_tanh.h"')
"""What a file of such functions includes."""

_GIVEN: Final = (INPUT, CONSTANT)

_WIDTH: Final = 112


@dataclass(frozen=True)
class Routine:
    """A C function to be: `void qo_eq_<name>(const double *<argument>, ..., double *<result>, ...)`."""

    name: str
    arguments: Mapping[str, Expression]
    results: Mapping[str, Expression]

    @property
    def signature(self) -> str:
        """What a prototype has before its semicolon."""
        arguments = [f"const double *{name}" for name in self.arguments]
        results = [f"double *{name}" for name in self.results]
        return f"void qo_eq_{self.name}({', '.join(arguments + results)})"


@dataclass(frozen=True)
class _Block:
    """Values that are computed one after the other under a condition."""

    condition: Condition
    numbers: tuple[int, ...]


def c_function(routine: Routine, sizes: Collection[int]) -> str:
    """Definition of a routine in C89; `sizes` are the places of those parameters that are sizes of effects."""
    listed = listing(list(routine.arguments.values()), list(routine.results.values()))
    names = tuple(routine.arguments)
    held = conditions(listed, names.index(PARAMETERS) if PARAMETERS in names else -1, sizes)
    texts = [_text(number, operation, names) for number, operation in enumerate(listed.operations)]
    blocks = _blocks(listed, held)
    local = _local(listed, blocks)
    outside = [number for block in blocks for number in block.numbers if number not in local]
    read = {operation.source[0] for operation in listed.operations if operation.kind == INPUT}
    lines = [
        *_declarations(f"v{number} = 0.0" if held[number].tests else f"v{number}" for number in outside),
        *(line for block in blocks for line in _lines(block, listed, texts, local)),
        *(f"(void){name};" for place, name in enumerate(names) if place not in read),
        *(
            f"{name}[{place}] = {texts[number]};"
            for name, result in zip(routine.results, listed.results, strict=True)
            for place, number in enumerate(result)
        ),
    ]
    return "\n".join([routine.signature, "{", *(f"    {line}" for line in lines), "}", ""])


def _text(number: int, operation: Operation, names: Sequence[str]) -> str:
    """What stands for a value where it is used."""
    if operation.kind == INPUT:
        return f"{names[operation.source[0]]}[{operation.source[1]}]"
    if operation.kind == CONSTANT:
        return repr(operation.number) if operation.number >= 0 else f"({operation.number!r})"
    return f"v{number}"


class _Queue:
    """Values that can be computed, by their condition and in their order."""

    def __init__(self, listed: Listing, held: Sequence[Condition]) -> None:
        computed = [operation.kind not in _GIVEN for operation in listed.operations]
        self._held = held
        self._ready: dict[Condition, list[int]] = {ALWAYS: []}
        self._users: list[list[int]] = [[] for _ in computed]
        self._waiting = [0] * len(computed)
        for number in (number for number, wanted in enumerate(computed) if wanted):
            operands = {operand for operand in listed.operations[number].operands if computed[operand]}
            self._waiting[number] = len(operands)
            for operand in operands:
                self._users[operand].append(number)
            if not operands:
                self._add(number)

    def _add(self, number: int) -> None:
        heapq.heappush(self._ready.setdefault(self._held[number], []), number)

    def next_condition(self) -> Condition | None:
        """What needs no test, then that of most values; None where everything is computed."""
        best = ALWAYS if self._ready[ALWAYS] else max(self._ready, key=lambda each: len(self._ready[each]))
        return best if self._ready[best] else None

    def take(self, condition: Condition) -> Iterator[int]:
        """All that can be computed under a condition, one made possible by the other."""
        while self._ready[condition]:
            number = heapq.heappop(self._ready[condition])
            yield number
            for user in self._users[number]:
                self._waiting[user] -= 1
                if self._waiting[user] == 0:
                    self._add(user)


def _blocks(listed: Listing, held: Sequence[Condition]) -> list[_Block]:
    """As few as come of it: whatever has the condition at hand is computed before another one is tested."""
    queue, blocks = _Queue(listed, held), []
    while (condition := queue.next_condition()) is not None:
        blocks.append(_Block(condition, tuple(queue.take(condition))))
    return blocks


def _local(listed: Listing, blocks: Sequence[_Block]) -> set[int]:
    """Values that nothing outside of their block uses, of blocks with a condition."""
    block_of = {number: place for place, block in enumerate(blocks) for number in block.numbers}
    leaving = {number for result in listed.results for number in result}
    for number, place in block_of.items():
        leaving.update(operand for operand in listed.operations[number].operands if block_of.get(operand) != place)
    return {number for block in blocks if block.condition.tests for number in block.numbers if number not in leaving}


def _lines(block: _Block, listed: Listing, texts: Sequence[str], local: Collection[int]) -> Iterator[str]:
    assignments = []
    for number in block.numbers:
        operation = listed.operations[number]
        value = _WRITTEN[operation.kind].format(*(texts[operand] for operand in operation.operands))
        assignments.append(f"v{number} = {value};")
    if not block.condition.tests:
        yield from assignments
        return
    yield f"if ({_test(block.condition)}) {{"
    for line in (*_declarations(f"v{number}" for number in block.numbers if number in local), *assignments):
        yield f"    {line}"
    yield "}"


def _test(condition: Condition) -> str:
    """Of all sets of sizes, one is not zero."""
    alternatives = [
        " || ".join(f"{PARAMETERS}[{place}] != 0.0" for place in sorted(sizes)) for sizes in condition.tests
    ]
    return alternatives[0] if len(alternatives) == 1 else " && ".join(f"({each})" for each in alternatives)


def _declarations(names: Iterable[str]) -> list[str]:
    """In lines of a readable length; `v1 = 0.0` does not break in two."""
    joined = ", ".join(name.replace(" ", "_") for name in names)
    return [f"double {line.rstrip(',')};".replace("_", " ") for line in textwrap.wrap(joined, _WIDTH)]
