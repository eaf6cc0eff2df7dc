"""Where the parameters of a table have the sizes of effects, and which states are there for the sake of an effect."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from fmu.effect_states import coupled_states, other_states
from fmu.parameter_rows import effect_parameter
from fmu.variables import Block, VariableTable
from ident.effects import Effect, kind_of, terms_of
from ident.plant.memories import memories_of

NOBODY = -1
"""In place of a size."""


def sized(table: VariableTable, effects: Sequence[Effect]) -> list[tuple[int, Effect]]:
    """Effects that have parameters of their own, with the place of their size."""
    places = {row.name: row.index for row in table.block(Block.PARAMETER)}
    names = [effect_parameter(effect, kind_of(effect.name).size.name) for effect in effects]
    return [(places[name], effect) for name, effect in zip(names, effects, strict=True) if name in places]


def felt_by(table: VariableTable, effects: Sequence[Effect]) -> list[tuple[int, ...]]:
    """Of each state the sizes that it is there for, `NOBODY` behind; nothing but `NOBODY` for a state that always is.

    Where all of these sizes are zero, nothing else depends on the state, or a spring is as stiff as it gets.
    """
    sizes: dict[str, list[int]] = {row.name: [] for row in table.block(Block.STATE)}
    for place, effect in sized(table, effects):
        memories = memories_of(terms_of([effect]))
        for state in (*coupled_states(memories), *other_states(memories)):
            sizes[state.name].append(place)
    width = max(1, *map(len, sizes.values()))
    return [tuple(place for place, _ in zip_longest(row, range(width), fillvalue=NOBODY)) for row in sizes.values()]
