"""What both versions of `modelDescription.xml` say, and in what order: variables, structure, log categories."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from fmu.model.generate import TOLERANCE
from fmu.units import Unit, unit_of
from fmu.variables import Block, Causality, Variability, Variable, VariableTable

MODEL_IDENTIFIER: Final = "quasiomni"
"""Name of the binaries."""

LOG_CATEGORIES: Final[Mapping[str, str]] = {
    "logStatusError": "Calls that are refused, with the variable at fault; always written",
    "logStatusDiscard": "Steps and derivatives that the model cannot compute; always written",
    "logEvents": "Changes of the motion mode k of (9)",
}
"""In the order of `fmu/wrapper/instance.h`."""


@dataclass(frozen=True)
class Experiment:
    """Defaults of a simulation [s, s, 1, s]."""

    start_time: float = 0.0
    stop_time: float = 10.0
    tolerance: float = TOLERANCE
    step_size: float = 2e-3


@dataclass(frozen=True)
class Interface:
    """An FMU seen from outside.

    Attributes:
        name: of the model.
        description: one line for people.
        version: of the model.
        tool: that made it.
        copyright, license: one line each.
        table: variables, event indicators included.
        dependencies: names of the states and inputs that an output or derivative depends on; of what is not named,
            nothing is said.
        experiment: defaults of a simulation.
        sampled: it acts at instants of its own, in co-simulation alone, and has nothing to differentiate.
    """

    name: str
    description: str
    version: str
    tool: str
    copyright: str
    license: str
    table: VariableTable
    dependencies: Mapping[str, tuple[str, ...]]
    experiment: Experiment = Experiment()
    sampled: bool = False

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """Variables with the causality output."""
        return tuple(row for row in self.table.variables if row.causality is Causality.OUTPUT)

    @property
    def units(self) -> tuple[Unit, ...]:
        """Every unit in use, once."""
        return tuple(unit_of(name) for name in dict.fromkeys(row.unit for row in self.table.variables))

    @property
    def initial_unknowns(self) -> tuple[Variable, ...]:
        """What is computed at initialization, in the order of the table."""
        return tuple(
            row
            for row in self.table.variables
            if row.block is Block.DERIVATIVE
            or (row.causality in (Causality.OUTPUT, Causality.CALCULATED) and row.start is None)
        )

    def dependencies_of(self, row: Variable) -> tuple[Variable, ...] | None:
        """States and inputs that a variable depends on while the simulation runs; None where nothing is said."""
        if row.block is Block.STATE:
            return (row,) if row.variability is Variability.CONTINUOUS else ()
        names = self.dependencies.get(row.name)
        return None if names is None else tuple(other for other in self.table.variables if other.name in names)


def with_indicators(table: VariableTable, count: int) -> VariableTable:
    """The table with a row for each event indicator; FMI 3.0 wants them among the variables."""
    first = len(table.variables)
    row = Variable(
        name="",
        description="Changes its sign where the mode may change",
        causality=Causality.LOCAL,
        variability=Variability.CONTINUOUS,
        block=Block.INDICATOR,
        unit="1",
    )
    rows = (
        replace(row, name=f"mode_indicator[{index + 1}]", index=index, value_reference=first + index)
        for index in range(count)
    )
    return VariableTable((*table.variables, *rows))


def initial_of(row: Variable) -> str:
    """The FMI attribute `initial`, empty where it must not be written."""
    if row.causality in (Causality.INPUT, Causality.INDEPENDENT):
        return ""
    return "calculated" if row.start is None else "exact"


def number(value: float) -> str:
    """The shortest text that reads back as the same number."""
    return repr(float(value))
