"""CasADi functions over many samples at once: one numpy operation an instruction, instead of one call a sample.

CasADi's own virtual machine runs through the instructions sample by sample; with thousands of samples and thousands of
instructions numpy is about ten times faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from types import MappingProxyType
from typing import Any, Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

OPERATIONS: Final[Mapping[int, Callable[..., Any]]] = MappingProxyType(
    {
        ca.OP_ASSIGN: lambda x: x,
        ca.OP_ADD: np.add,
        ca.OP_SUB: np.subtract,
        ca.OP_MUL: np.multiply,
        ca.OP_DIV: np.divide,
        ca.OP_NEG: np.negative,
        ca.OP_INV: np.reciprocal,
        ca.OP_SQ: np.square,
        ca.OP_SQRT: np.sqrt,
        ca.OP_TWICE: lambda x: x + x,
        ca.OP_POW: np.power,
        ca.OP_CONSTPOW: np.power,
        ca.OP_EXP: np.exp,
        ca.OP_LOG: np.log,
        ca.OP_SIN: np.sin,
        ca.OP_COS: np.cos,
        ca.OP_TAN: np.tan,
        ca.OP_ATAN: np.arctan,
        ca.OP_ATAN2: np.arctan2,
        ca.OP_TANH: np.tanh,
        ca.OP_FABS: np.abs,
        ca.OP_SIGN: np.sign,
        ca.OP_FLOOR: np.floor,
        ca.OP_LT: np.less,
        ca.OP_NOT: np.logical_not,
        ca.OP_IF_ELSE_ZERO: lambda condition, x: np.where(condition, x, 0.0),
        ca.OP_FMIN: np.minimum,
        ca.OP_FMAX: np.maximum,
    }
)

CHUNK: Final = 8192
"""Samples at a time: so many that calling numpy costs little, so few that they stay in the processor's cache."""

Instruction = tuple[int, tuple[int, ...], tuple[int, ...], float]
"""CasADi's code of the operation, where its operands are, where its result goes, value of a constant."""

Inputs = Mapping[tuple[int, ...], Any]
"""Elements of arguments, by (argument, element)."""


class Vectorised:
    """A CasADi function of one output, ready for arrays.

    Args:
        function: of SX expressions.

    Attributes:
        shape: rows and columns of its output.
        places: rows (E,) and columns (E,) of the entries of its output that are no structural zeros.
        program: its instructions, in their order.
        inputs: (argument, element) of all that its output depends on.

    Raises:
        ValueError: it holds an operation that has no numpy counterpart here.
    """

    def __init__(self, function: Any) -> None:
        self.shape: tuple[int, int] = function.size_out(0)
        pattern = function.sparsity_out(0)
        self.places = (np.array(pattern.row(), dtype=np.int64), np.array(pattern.get_col(), dtype=np.int64))
        self.program = [_instruction(function, index) for index in range(function.n_instructions())]
        self.inputs = _inputs(self.program)
        unknown = {code for code, *_ in self.program} - OPERATIONS.keys() - {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
        if unknown:
            raise ValueError(f"no numpy counterpart of the CasADi operations {sorted(unknown)}")

    def only(self, columns: Sequence[int]) -> Vectorised:
        """The same function with some columns of its output alone, in this order, and of its program what they need.

        Args:
            columns: their numbers, each once.
        """
        kept = [np.flatnonzero(self.places[1] == column) for column in columns]
        entries = np.concatenate(kept)
        found = copy(self)
        found.shape = self.shape[0], len(columns)
        found.places = self.places[0][entries], np.repeat(np.arange(len(columns)), [len(one) for one in kept])
        found.program = _needed(self.program, {entry: number for number, entry in enumerate(entries.tolist())})
        found.inputs = _inputs(found.program)
        return found

    def __call__(self, *arguments: Array) -> Array:
        """Outputs (N, rows, columns) for arguments (N, n), or (n,) where they are the same for all samples."""
        return self.matrices(self.entries(*arguments))

    def matrices(self, entries: Array) -> Array:
        """Outputs (N, rows, columns) made of their entries (E, N)."""
        rows, width = self.shape
        if len(entries) == rows * width:
            return entries.reshape(width, rows, entries.shape[1]).transpose(2, 1, 0)
        whole = np.zeros((width, rows, entries.shape[1]))
        whole[self.places[1], self.places[0]] = entries
        return whole.transpose(2, 1, 0)

    def entries(self, *arguments: Array) -> Array:
        """The outputs that are no structural zeros, (E, N) at `places`; arguments as for the call."""
        result = np.empty((len(self.places[0]), count_of(arguments)))
        for part, inputs in self.chunks(arguments):
            run(self.program, inputs, {}, result[:, part])
        return result

    def chunks(self, arguments: Sequence[Array]) -> Iterator[tuple[slice, Inputs]]:
        """What the program reads of as many of its arguments as are given, CHUNK samples at a time."""
        whole = {place: arguments[place[0]].T[place[1]] for place in self.inputs if place[0] < len(arguments)}
        taken = {place: np.ascontiguousarray(values) if np.ndim(values) else values for place, values in whole.items()}
        for start in range(0, count_of(arguments), CHUNK):
            part = slice(start, start + CHUNK)
            yield part, {place: values[part] if np.ndim(values) else values for place, values in taken.items()}


def count_of(arguments: Sequence[Array]) -> int:
    """N of arguments (N, n), of which some may be (n,)."""
    return next(len(argument) for argument in arguments if argument.ndim == 2)


def run(program: Sequence[Instruction], inputs: Inputs, work: dict[int, Any], result: Array) -> None:
    """Carry out instructions in their order.

    Args:
        program: the instructions.
        inputs: elements of the arguments.
        work: what stands in places already; written.
        result: (E, N) written, the entries that the instructions put out.
    """
    for instruction in program:
        code, sources, targets, _ = instruction
        if code == ca.OP_OUTPUT:
            result[targets[1]] = work[sources[0]]
        else:
            work[targets[0]] = value_of(instruction, inputs, work)


def value_of(instruction: Instruction, inputs: Inputs, work: Mapping[int, Any]) -> Any:
    """What an instruction puts into its place; arguments as of `run`."""
    code, sources, _, constant = instruction
    operation = OPERATIONS.get(code)
    if operation is None:
        return inputs[sources] if code == ca.OP_INPUT else constant
    # There are hundreds of thousands of these calls.
    return operation(work[sources[0]], work[sources[1]]) if len(sources) == 2 else operation(work[sources[0]])


def _inputs(program: Sequence[Instruction]) -> frozenset[tuple[int, ...]]:
    return frozenset(sources for code, sources, *_ in program if code == ca.OP_INPUT)


def _needed(program: Sequence[Instruction], outputs: Mapping[int, int]) -> list[Instruction]:
    """Instructions that some outputs need; `outputs` are the numbers that those have, by those that they had."""
    wanted, found = set[int](), list[Instruction]()
    for code, sources, targets, constant in reversed(program):
        if code == ca.OP_OUTPUT:
            if targets[1] in outputs:
                found.append((code, sources, (targets[0], outputs[targets[1]]), constant))
                wanted.add(sources[0])
        elif targets[0] in wanted:
            # Places are used again: an earlier value in this one is another.
            wanted.discard(targets[0])
            found.append((code, sources, targets, constant))
            wanted.update(sources if code not in (ca.OP_INPUT, ca.OP_CONST) else ())
    return found[::-1]


def _instruction(function: Any, index: int) -> Instruction:
    code = function.instruction_id(index)
    constant = function.instruction_constant(index) if code == ca.OP_CONST else 0.0
    return code, tuple(function.instruction_input(index)), tuple(function.instruction_output(index)), constant
