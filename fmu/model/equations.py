"""The equations of a vehicle with the symbols of a table of variables."""

from __future__ import annotations

from collections.abc import Sequence

from fmu.parameter_rows import effect_parameter
from fmu.variables import Block, Inputs, VariableTable
from ident.effects import Effect, effect_term, kind_of
from ident.plant import creeping
from ident.plant.creeping import Equations
from ident.plant.symbols import Symbols


def equations(table: VariableTable, effects: Sequence[Effect], inputs: Inputs) -> Equations:
    """The equations for a table of variables, and the effects and inputs that it was made for.

    Effects take their numbers from the parameters of the table; those that stand for other parameters have none.
    """
    x, u, p = (
        Symbols(block.value, [row.name for row in table.block(block)])
        for block in (Block.STATE, Block.INPUT, Block.PARAMETER)
    )
    terms = [
        effect_term(effect.name, effect.where, {name: p[effect_parameter(effect, name)] for name in effect.parameters})
        for effect in effects
        if not kind_of(effect.name).stands_for
    ]
    return creeping.equations(x, u, p, terms, inputs)
