"""Arrays of the four wheels beside their scalars: FMI 3.0 alone has them.

An array is another name for four scalars: who sets one sets the other, who reads one reads what the other has.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final
from xml.etree.ElementTree import Element, SubElement

from fmu.variables import Causality, Variable, VariableTable, WheelArray
from ident.vehicle.geometry import WHEELS

_OF_WHEEL: Final = re.compile(rf"(?P<head>\w+?)_(?P<wheel>{'|'.join(WHEELS)})(?P<tail>_\w+)?")
_CAUSALITIES: Final = (Causality.INPUT, Causality.OUTPUT)


def with_arrays(table: VariableTable) -> VariableTable:
    """The table with an array for every input and output that each wheel has, `beta_dot` for one."""
    found: dict[str, dict[str, Variable]] = {}
    for row in table.variables:
        match = _OF_WHEEL.fullmatch(row.name)
        if match is not None and row.causality in _CAUSALITIES:
            found.setdefault(match["head"] + (match["tail"] or ""), {})[match["wheel"]] = row
    whole = {name: members for name, members in found.items() if members.keys() == set(WHEELS)}
    first = len(table.variables)
    arrays = (_array(name, members, first + place) for place, (name, members) in enumerate(whole.items()))
    return replace(table, arrays=tuple(arrays))


def _array(name: str, members: Mapping[str, Variable], reference: int) -> WheelArray:
    rows = tuple(members[wheel] for wheel in WHEELS)
    text = re.sub(rf"\b{WHEELS[0]}\b", ", ".join(WHEELS), rows[0].description)
    is_input = rows[0].causality is Causality.INPUT
    row = replace(rows[0], name=name, description=text, value_reference=reference, state="")
    return WheelArray(row if is_input else replace(row, start=None), rows)


def write_array(parent: Element, array: WheelArray, attributes: Mapping[str, str]) -> None:
    """The array as a variable of FMI 3.0.

    Args:
        parent: of all variables.
        array: to write.
        attributes: of a scalar like its members.
    """
    values = dict(attributes)
    if array.row.start is not None:
        values["start"] = " ".join(repr(float(row.start or 0.0)) for row in array.members)
    element = SubElement(parent, "Float64", values)
    SubElement(element, "Dimension", start=str(len(array.members)))


def write_unknowns(structure: Element, kind: str, table: VariableTable) -> None:
    """The arrays among the outputs in the model structure; of what they depend on, their scalars tell."""
    for array in table.arrays:
        if array.row.causality is Causality.OUTPUT:
            SubElement(structure, kind, valueReference=str(array.row.value_reference))


def with_array_inputs(table: VariableTable, known: Sequence[Variable]) -> tuple[Variable, ...]:
    """What a variable depends on, arrays included that set scalars among it."""
    names = {row.name for row in known}
    inputs = (array for array in table.arrays if array.row.causality is Causality.INPUT)
    return (*known, *(array.row for array in inputs if any(row.name in names for row in array.members)))


def arrays_source(table: VariableTable) -> str:
    """`arrays_of_wheels.c`: names and members of the arrays, for the wrapper."""
    rows = "".join(
        f'    {{"{array.row.name}", {{{", ".join(str(row.value_reference) for row in array.members)}}}}},\n'
        for array in table.arrays
    )
    return f"""/* Arrays of the four wheels by their value references, behind those of the scalars. Generated. */
#include "arrays.h"

const size_t qo_array_count = {len(table.arrays)};

const qo_array qo_arrays[] = {{
{rows}    {{"", {{0, 0, 0, 0}}}}, /* the end */
}};
"""
