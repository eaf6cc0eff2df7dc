"""A drive to check an FMU with: inputs, and the outputs that belong to them, integrated without any of the C code.

The files are those of the FMI cross-check: `<model>_in.csv`, `<model>_ref.csv`, `<model>_ref.opt`. Inputs are stairs,
a time standing twice where they jump: importers agree on stairs, while some hold ramps between the steps of a solver.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmu.interface import MODEL_IDENTIFIER
from fmu.model.equations import equations
from fmu.variables import Block, Causality, Inputs, Variable, VariableTable
from ident.effects import Effect
from ident.errors import UserError

_RELATIVE: Final = 1e-10
_ABSOLUTE: Final = 1e-12
"""Tolerances of the integration; what is written has six decimals."""

INTERVAL: Final = 0.02
"""Between two rows of outputs [s]."""

SUGGESTED_TOLERANCE: Final = 1e-6
"""For solvers of importers, to be within 1e-4 of the outputs."""

_DRIVE: Final = (
    (0.6, (1.1, 0.9, 1.0, 1.2)),
    (0.4, (0.2, 1.0, 0.9, 0.1)),
    (0.6, (-0.8, -0.6, -0.9, -1.0)),
    (0.4, (0.0, 0.0, 0.0, 0.0)),
)
"""How long [s], and the commands of the wheels over what is usual: driving, steering, braking, coming to rest."""


@dataclass(frozen=True)
class Reference:
    """The drive.

    Attributes:
        inputs: name -> values (n,).
        corners: times of the inputs [s] (n,), twice where they jump.
        outputs: name -> values (N,).
        times: of the outputs [s] (N,).
    """

    inputs: Mapping[str, NDArray[np.float64]]
    corners: NDArray[np.float64]
    outputs: Mapping[str, NDArray[np.float64]]
    times: NDArray[np.float64]

    def files(self) -> dict[str, bytes]:
        """By name."""
        options = {
            "StartTime": 0.0,
            "StopTime": self.times[-1],
            "StepSize": 0.0,
            "RelTol": SUGGESTED_TOLERANCE,
            "OutputIntervalLength": INTERVAL,
        }
        return {
            f"{MODEL_IDENTIFIER}_in.csv": _csv(self.corners, self.inputs),
            f"{MODEL_IDENTIFIER}_ref.csv": _csv(self.times, self.outputs),
            f"{MODEL_IDENTIFIER}_ref.opt": "".join(f"{name},{value:g}\n" for name, value in options.items()).encode(),
        }


def _csv(times: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]]) -> bytes:
    head = ",".join(f'"{name}"' for name in ("time", *columns))
    # Adding zero: a number that rounds to -0 is written as 0 on every machine.
    rows = (
        ",".join(f"{round(value, 6) + 0.0:.6f}" for value in row) for row in zip(times, *columns.values(), strict=True)
    )
    return "\n".join((head, *rows, "")).encode()


def reference_drive(table: VariableTable, effects: Sequence[Effect], inputs: Inputs) -> Reference:
    """The drive of a model with the start values of its table.

    Args:
        table: of its variables.
        effects: that the table was made for.
        inputs: what drives the wheels.

    Raises:
        UserError: the model cannot be integrated.
    """
    rows = table.block(Block.INPUT)
    lengths, commands = (np.array(part) for part in zip(*_DRIVE, strict=True))
    values = np.zeros((len(lengths), len(rows)))
    values[:, :4] = commands * [row.nominal for row in rows[:4]]
    states = _integrated(table, effects, inputs, lengths, values)
    corners = np.repeat(np.concatenate([[0.0], np.cumsum(lengths)]), 2)[1:-1]
    shown = {row.name: states[:, row.index] for row in table.block(Block.STATE) if _is_shown(row)}
    times = np.arange(len(states), dtype=np.float64) * INTERVAL
    stairs = dict(zip((row.name for row in rows), np.repeat(values, 2, axis=0).T, strict=True))
    return Reference(stairs, corners, shown, times)


def _is_shown(row: Variable) -> bool:
    return row.causality is Causality.OUTPUT


def _integrated(
    table: VariableTable,
    effects: Sequence[Effect],
    inputs: Inputs,
    lengths: NDArray[np.float64],
    values: NDArray[np.float64],
) -> NDArray[np.float64]:
    """States (N, n) every INTERVAL, by backward differences of variable order with the exact Jacobian (CVODES)."""
    model = equations(table, effects, inputs)
    numbers = ca.DM([row.start or 0.0 for row in table.block(Block.PARAMETER)])
    rates = ca.cse(ca.densify(ca.substitute(model.xd, model.p, numbers)))
    problem = {"x": model.x, "p": model.u, "ode": rates}
    options: dict[str, Any] = {
        "reltol": _RELATIVE,
        "abstol": _ABSOLUTE,
        # CasADi's own QR divides by zero where columns of the Jacobian have numbers near the smallest there are.
        "linear_solver": "csparse",
        "show_eval_warnings": False,
        "disable_internal_warnings": True,
    }
    states = [np.array([row.start or 0.0 for row in table.block(Block.STATE)])]
    for length, commands in zip(lengths, values, strict=True):
        grid = INTERVAL * np.arange(1, round(length / INTERVAL) + 1)
        integrate = ca.integrator("reference", "cvodes", problem, 0.0, grid, options)
        try:
            found = integrate(x0=states[-1], p=commands)["xf"]
        except RuntimeError as reason:
            raise UserError(
                "This model cannot be integrated over the drive that goes into the FMU as its reference.",
                "Look at the parameters and effects: one of them is far from any vehicle.",
            ) from reason
        states.extend(np.array(found).T)
    return np.array(states)
