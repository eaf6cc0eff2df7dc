"""The one table of variables of the FMU: `modelDescription.xml`, C code and documentation are made from it.

Every variable is a scalar, SI. Values lie in four blocks of the C model (`fmu/model/core.h`): states `x`, inputs `u`,
parameters `p`, outputs `y` that are not states; derivatives of the states and the mode have places of their own.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from ident.plant.drives import Inputs as Inputs

DEGREES: Final = {"rad": "deg", "rad/s": "deg/s"}
"""SI units that people like to read in others."""


class Causality(enum.StrEnum):
    """Who sets a variable; names of FMI."""

    INDEPENDENT = "independent"
    PARAMETER = "parameter"
    CALCULATED = "calculatedParameter"
    INPUT = "input"
    OUTPUT = "output"
    LOCAL = "local"


class Carried(enum.StrEnum):
    """Which effects a model has beside the confirmed ones, with size zero."""

    STATELESS = "stateless"
    ALL = "all"


class Variability(enum.StrEnum):
    """When a variable may change; names of FMI."""

    CONTINUOUS = "continuous"
    DISCRETE = "discrete"
    TUNABLE = "tunable"


class Block(enum.Enum):
    """Where the C model keeps a value."""

    TIME = "time"
    STATE = "x"
    DERIVATIVE = "xd"
    INPUT = "u"
    PARAMETER = "p"
    OUTPUT = "y"
    MODE = "mode"
    CALCULATED = "calculated"
    INDICATOR = "z"


@dataclass(frozen=True)
class Variable:
    """A row of the table.

    Attributes:
        name: unique; structured naming convention of FMI, `der(x)` is the derivative of `x`.
        description: one line for people.
        causality, variability: as in FMI.
        block, index: where the C model keeps it.
        unit: SI, as in the tables of `ident.vehicle`; "1" for pure numbers.
        display_unit: what people like to read it in, empty where that is the unit.
        start: value at the start, None for what is computed.
        minimum, maximum: bounds, None where there is none.
        positive: the minimum itself, zero, is refused.
        advisory: the bounds say what the model is meant for; values beyond them are taken.
        nominal: size that the absolute error of a state is measured in; of an input, what is usual.
        state: name of the state that this is the derivative of, empty otherwise.
        value_reference: of FMI, the position in the table.
    """

    name: str
    description: str
    causality: Causality
    variability: Variability
    block: Block
    unit: str
    index: int = 0
    display_unit: str = ""
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    positive: bool = False
    advisory: bool = False
    nominal: float = 1.0
    state: str = ""
    value_reference: int = 0


@dataclass(frozen=True)
class WheelArray:
    """Four scalars under one name.

    Attributes:
        row: as a variable; its value reference follows those of all scalars.
        members: the scalars, fl, rl, fr, rr.
    """

    row: Variable
    members: tuple[Variable, ...]


@dataclass(frozen=True)
class VariableTable:
    """All variables by value reference: time, states, derivatives, inputs, parameters, outputs, mode, calculated.

    Attributes:
        variables: scalars.
        arrays: of wheels, beside them.
    """

    variables: tuple[Variable, ...]
    arrays: tuple[WheelArray, ...] = ()

    def __getitem__(self, name: str) -> Variable:
        """A variable by its name."""
        return next(variable for variable in self.variables if variable.name == name)

    def block(self, block: Block) -> tuple[Variable, ...]:
        """The variables of a block, by index."""
        return tuple(variable for variable in self.variables if variable.block is block)


def numbered(blocks: Sequence[Sequence[Variable]]) -> VariableTable:
    """A table of blocks, with indices within each block and value references over all."""
    rows = [replace(row, index=index) for block in blocks for index, row in enumerate(block)]
    return VariableTable(tuple(replace(row, value_reference=place) for place, row in enumerate(rows)))
