"""A function over many samples of which only the last argument changes: what that has no part in is computed once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.plant.vectorised import Inputs, Instruction, Vectorised, count_of, run, value_of

Array = NDArray[np.float64]


class Prepared:
    """A vectorised function, all of its arguments but the last given.

    Args:
        function: of two arguments at least.
        fixed: all but the last, as for a call; one of them for every sample (N, n).

    Attributes:
        touched: numbers of the entries that the last argument has a part in.
    """

    def __init__(self, function: Vectorised, *fixed: Array) -> None:
        self._samples, self._last = count_of(fixed), len(fixed)
        self._parts = [(part, _rest(function.program, inputs)) for part, inputs in function.chunks(fixed)]
        rest, self._entries = self._parts[0][1], len(function.places[0])
        self.touched = tuple(sorted(targets[1] for code, _, targets, _ in rest.program if code == ca.OP_OUTPUT))

    def entries(self, last: Array) -> Array:
        """(len(touched), N) of the entries touched, for a last argument (n,)."""
        result = np.empty((self._entries, self._samples))
        inputs: Inputs = {(self._last, element): value for element, value in enumerate(last)}
        for part, rest in self._parts:
            run(rest.program, inputs, dict(rest.known), result[:, part])
        return result[list(self.touched)]


@dataclass(frozen=True)
class _Rest:
    """What is left to do for some of the samples.

    Attributes:
        program: instructions that the last argument has a part in.
        known: what they need of everything else, under negative numbers.
    """

    program: Sequence[Instruction]
    known: Mapping[int, Any]


def _rest(program: Sequence[Instruction], inputs: Inputs) -> _Rest:
    """What is left of a program when everything is done that the last argument has no part in."""
    work, known = dict[int, Any](), dict[int, Any]()
    left, waiting = list[Instruction](), set[int]()

    def operand(place: int) -> int:
        if place in waiting:
            return place
        known[-1 - len(known)] = work[place]
        return -len(known)

    for instruction in program:
        code, sources, targets, constant = instruction
        if code == ca.OP_INPUT and sources not in inputs:
            left.append(instruction)
            waiting.add(targets[0])
        elif code not in (ca.OP_INPUT, ca.OP_CONST) and not waiting.isdisjoint(sources):
            left.append((code, tuple(map(operand, sources)), targets, constant))
            waiting.update(targets[:1] if code != ca.OP_OUTPUT else ())
        elif code != ca.OP_OUTPUT:
            # Places are used again: what stood here may have waited.
            waiting.discard(targets[0])
            work[targets[0]] = value_of(instruction, inputs, work)
    return _Rest(left, known)
