"""C sources of the model, from its equations and its table of variables.

CasADi writes the equations as C; each function gets plain arrays for arguments, and the table is written beside it.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType
from typing import Final

import casadi as ca
import numpy as np

from fmu.model.effect_sizes import felt_by, sized
from fmu.model.elimination import Elimination, elimination
from fmu.model.equations import equations
from fmu.model.straight_code import HEADERS, Routine, c_function
from fmu.variables import Block, Inputs, Variable, VariableTable
from ident.effects import Effect
from ident.plant.creeping import Equations
from ident.plant.symbolic import Expression

TOLERANCE: Final = 1e-4
"""Of the solver, where nobody sets one."""

FIRST_STEP: Final = 1e-3
"""Length that the first internal step tries [s]."""

_WRITTEN: Final = (
    *("core.h", "core.c", "solver.c", "linear.c", "fastest.c"),
    *("qo_internal.h", "qo_linear.h", "qo_tanh.h"),
)
"""Files of the core that are written by hand."""

_ROWS: Final = (("states", "NX", Block.STATE), ("inputs", "NU", Block.INPUT), ("parameters", "NP", Block.PARAMETER))
"""Arrays of rows: name, size and block."""

_OFTEN: Final = ("derivatives", "linearize", "outputs")
"""Routines of every step; they alone test the sizes of effects, which takes the compilers time."""


@dataclass(frozen=True)
class Core:
    """The model in C.

    Attributes:
        files: name -> text; compile all that end in `.c`.
        dependencies: derivative or output -> the states and inputs that it depends on, in the order of the table.
        fastest: time constant [s] with the parameters of the table, at rest and straight ahead.
    """

    files: Mapping[str, str]
    dependencies: Mapping[str, tuple[str, ...]]
    fastest: float


def generate_core(table: VariableTable, effects: Sequence[Effect], inputs: Inputs) -> Core:
    """The model for a table of variables, and the effects and inputs that it was made for."""
    model = equations(table, effects, inputs)
    jacobian = ca.jacobian(model.xd, model.x)
    eliminated = elimination(jacobian, model.coupled)
    routines, felt = _routines(model, jacobian, eliminated), felt_by(table, effects)
    written = {name: (resources.files("fmu.model") / name).read_text(encoding="utf-8") for name in _WRITTEN}
    generated = {
        "qo_sizes.h": _sizes(table, eliminated, model, len(felt[0])),
        "qo_table.c": table_source(table) + _felt_source(felt),
        "qo_equations.h": _prototypes(routines),
        "qo_equations.c": _definitions(routines, [place for place, _ in sized(table, effects)]),
    }
    files, dependencies = MappingProxyType({**written, **generated}), MappingProxyType(_dependencies(model, table))
    return Core(files, dependencies, _fastest(model, table))


def _fastest(model: Equations, table: VariableTable) -> float:
    jacobian = ca.Function("jacobian", [model.x, model.u, model.p], [ca.jacobian(model.xd, model.x)])
    starts = [[row.start or 0.0 for row in table.block(block)] for block in (Block.STATE, Block.INPUT, Block.PARAMETER)]
    return float(1.0 / np.abs(np.linalg.eigvals(np.asarray(jacobian(*starts)))).max())


def _routines(model: Equations, jacobian: Expression, eliminated: Elimination) -> list[Routine]:
    point = {"x": model.x, "u": model.u, "p": model.p}
    return [
        Routine("derivatives", point, {"xd": model.xd}),
        Routine("outputs", point, {"y": model.y}),
        Routine("mode_distances", point, {"z": model.z}),
        Routine("linearize", point, {"xd": model.xd, "jacobian": _nonzeros(jacobian)}),
        *_eliminations(eliminated),
        _along_inputs(model, point),
        *_directional(model, point),
    ]


def _nonzeros(matrix: Expression) -> Expression:
    return ca.vertcat(*matrix.nonzeros())


def _eliminations(found: Elimination) -> list[Routine]:
    """A step's system (shift I - J) k = right: factors and the coupled rest by rows; then its sides and solutions."""
    return [
        Routine(
            "factorize",
            {"jacobian": found.jacobian, "shift": found.shift},
            {"factors": found.factors, "matrix": found.matrix},
        ),
        Routine("eliminate", {"factors": found.held, "right": found.right}, {"reduced": found.reduced}),
        Routine("expand", {"factors": found.held, "solved": found.solved}, {"solution": found.solution}),
    ]


def _along_inputs(model: Equations, point: Mapping[str, Expression]) -> Routine:
    direction = ca.SX.sym("du", model.u.numel())
    return Routine("input_direction", {**point, "du": direction}, {"sxd": ca.jtimes(model.xd, model.u, direction)})


def _directional(model: Equations, point: Mapping[str, Expression]) -> list[Routine]:
    seeds = {f"d{name}": ca.SX.sym(f"d{name}", symbols.numel()) for name, symbols in point.items()}
    stacked, results = ca.vertcat(*point.values()), ca.vertcat(model.xd, model.y)
    forward = ca.jtimes(results, stacked, ca.vertcat(*seeds.values()))
    weights = {"lxd": ca.SX.sym("lxd", model.xd.numel()), "ly": ca.SX.sym("ly", model.y.numel())}
    adjoint = ca.jtimes(results, stacked, ca.vertcat(*weights.values()), True)
    sizes = [0, model.x.numel(), model.x.numel() + model.u.numel(), stacked.numel()]
    return [
        Routine(
            "jacobian_vector",
            {**point, **seeds},
            {"sxd": forward[: model.xd.numel()], "sy": forward[model.xd.numel() :]},
        ),
        Routine(
            "vector_jacobian",
            {**point, **weights},
            {f"a{name}": adjoint[sizes[part] : sizes[part + 1]] for part, name in enumerate(point)},
        ),
    ]


def _dependencies(model: Equations, table: VariableTable) -> dict[str, tuple[str, ...]]:
    knowns = [row.name for block in (Block.STATE, Block.INPUT) for row in table.block(block)]
    unknowns = [row.name for block in (Block.DERIVATIVE, Block.OUTPUT) for row in table.block(block)]
    pattern = ca.jacobian_sparsity(ca.vertcat(model.xd, model.y), ca.vertcat(model.x, model.u))
    found: dict[str, list[int]] = {name: [] for name in unknowns}
    for row, column in zip(*pattern.get_triplet(), strict=True):
        found[unknowns[row]].append(column)
    return {name: tuple(knowns[column] for column in sorted(columns)) for name, columns in found.items()}


def _prototypes(routines: Sequence[Routine]) -> str:
    lines = [f"{routine.signature};" for routine in routines]
    return guarded("QO_EQUATIONS_H", "The equations of the model.", lines)


def guarded(guard: str, comment: str, lines: Sequence[str]) -> str:
    """A generated header file of some lines, under a guard, with a comment."""
    return "\n".join(
        [f"/* {comment} Generated. */", f"#ifndef {guard}", f"#define {guard}", "", *lines, "", "#endif", ""]
    )


def _definitions(routines: Sequence[Routine], sizes: Collection[int]) -> str:
    included = [f"#include {header}" for header in HEADERS]
    head = ["/* The equations of the model. Generated. */", '#include "qo_equations.h"', "", *included, ""]
    return "\n".join([*head, *(c_function(each, sizes if each.name in _OFTEN else ()) for each in routines)])


def _felt_source(felt: Sequence[tuple[int, ...]]) -> str:
    rows = [f"    {{{', '.join(map(str, places))}}}," for places in felt]
    return "\n".join(["", "const int qo_felt_by[QO_NX][QO_NE] = {", *rows, "};", ""])


def _sizes(table: VariableTable, eliminated: Elimination, model: Equations, felt: int) -> str:
    sizes = {
        "NX": len(table.block(Block.STATE)),
        "NU": len(table.block(Block.INPUT)),
        "NP": len(table.block(Block.PARAMETER)),
        "NY": len(table.block(Block.OUTPUT)),
        "NZ": model.z.numel(),
        "NV": model.coupled,
        "NJ": eliminated.jacobian.numel(),
        "NF": eliminated.factors.numel(),
        "NE": felt,
    }
    lines = [f"#define QO_{name} {size}" for name, size in sizes.items()]
    lines += [f"#define QO_TOLERANCE {TOLERANCE!r}", f"#define QO_FIRST_STEP {FIRST_STEP!r}"]
    return guarded("QO_SIZES_H", "Sizes of the model.", lines)


def table_source(table: VariableTable) -> str:
    """`qo_table.c` of a table of variables."""
    lines = ["/* The table of variables. Generated. */", '#include "qo_internal.h"', ""]
    for name, size, block in _ROWS:
        lines += [f"const qo_row qo_{name}[QO_{size}] = {{", *map(_row, table.block(block)), "};", ""]
    names = [f'    "{row.name}",' for row in table.block(Block.OUTPUT)]
    return "\n".join([*lines, "const char *const qo_outputs_by_name[QO_NY] = {", *names, "};", ""])


def _row(row: Variable) -> str:
    minimum, maximum = (
        repr(unbounded if bound is None or row.advisory else float(bound))
        for bound, unbounded in ((row.minimum, -sys.float_info.max), (row.maximum, sys.float_info.max))
    )
    start = repr(float(row.start or 0.0))
    return f'    {{"{row.name}", {start}, {minimum}, {maximum}, {row.nominal!r}, {int(row.positive)}}},'
