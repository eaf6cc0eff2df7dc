"""The part of the C wrapper that depends on the variables, and the list of all C files of an FMU."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib import resources
from types import MappingProxyType
from typing import Final

from fmu.arrays import arrays_source
from fmu.description import FmiVersion
from fmu.variables import Block, VariableTable

_WRITTEN: Final = ("instance.h", "instance.c", "saved.c", "values.c", "sensitivity.c", "stepping.c")

_ENTRY: Final = {
    FmiVersion.FMI2: ("calls_fmi2.h", "fmi2.c", "fmi2_solving.c"),
    FmiVersion.FMI3: ("calls_fmi3.h", "fmi3.c", "fmi3_values.c", "fmi3_solving.c", "arrays.h", "arrays.c"),
}
"""The functions of the standard, and what they need."""

_MARK_SIZE: Final = 16
"""Bytes at the head of saved states."""

_ROLES: Final[Mapping[Block, str]] = MappingProxyType(
    {
        Block.TIME: "QO_TIME",
        Block.STATE: "QO_STATE",
        Block.DERIVATIVE: "QO_DERIVATIVE",
        Block.INPUT: "QO_INPUT",
        Block.PARAMETER: "QO_PARAMETER",
        Block.OUTPUT: "QO_OUTPUT",
        Block.MODE: "QO_DISCRETE",
        Block.CALCULATED: "QO_CALCULATED",
        Block.INDICATOR: "QO_INDICATOR",
    }
)


def wrapper_sources(table: VariableTable, version: FmiVersion, token: str) -> dict[str, bytes]:
    """C files of the wrapper: file name -> text. They compile together with those of the model."""
    names = (*_WRITTEN, *_ENTRY[version])
    written = {name: (resources.files("fmu") / "wrapper" / name).read_bytes() for name in names}
    if version is FmiVersion.FMI3:
        written["arrays_of_wheels.c"] = arrays_source(table).encode()
    return {**written, "variables.h": _header(table).encode(), "variables.c": _rows(table, token).encode()}


def _header(table: VariableTable) -> str:
    """Nothing of one vehicle alone: what includes it is compiled once for all."""
    roles = ",\n".join(f"    {role}" for role in _ROLES.values())
    return f"""/* The variables by their value references. Generated. */
#ifndef QO_VARIABLES_H
#define QO_VARIABLES_H

#define QO_VARIABLES {len(table.variables)}
#define QO_MARK_SIZE {_MARK_SIZE}
#define QO_MODEL_EXCHANGED {int(bool(table.block(Block.DERIVATIVE)))} /* whether there is a model to exchange */

typedef enum {{
{roles}
}} qo_role;

typedef struct {{
    const char *name;
    qo_role role;
    int index; /* among those of its role */
}} qo_variable;

extern const qo_variable qo_variables[QO_VARIABLES];
extern const double qo_nominals[];
extern const char qo_token[]; /* of the model description */
extern const unsigned char qo_mark[QO_MARK_SIZE]; /* at the head of saved states */

#endif
"""


def _rows(table: VariableTable, token: str) -> str:
    rows = ",\n".join(f'    {{"{row.name}", {_ROLES[row.block]}, {row.index}}}' for row in table.variables)
    nominals = ", ".join(repr(float(row.nominal)) for row in table.block(Block.STATE))
    mark = ", ".join(str(byte) for byte in _mark(token))
    return f"""/* The variables by their value references. Generated. */
#include "variables.h"

const qo_variable qo_variables[QO_VARIABLES] = {{
{rows}
}};

const double qo_nominals[] = {{{nominals}}};

const char qo_token[] = "{token}";

const unsigned char qo_mark[QO_MARK_SIZE] = {{{mark}}};
"""


def _mark(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()[:_MARK_SIZE]
