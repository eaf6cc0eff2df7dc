"""C sources of the controller: its reference as tables, where its values are, and what is written by hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fmu.controller.table import ControllerSource, Groups, controller_table, inputs_of, parameters_of, states_of
from fmu.model.generate import FIRST_STEP, TOLERANCE, guarded, table_source
from fmu.source import Model
from fmu.variables import Block, VariableTable
from ident.campaign.controller import LEAK_TIME, REST, STANDSTILL_GAIN
from ident.campaign.loops import STEERING_RATE_CYCLES
from ident.campaign.reference import STEERING_LOOPS

Array = NDArray[np.float64]

_SHARED: Final = ("core.h", "core.c", "qo_internal.h")
"""Files of the core of a vehicle that are those of a controller as well."""

_EQUATIONS: Final = {
    "outputs": ("x u p", "y"),
    "derivatives": ("x u p", "xd"),
    "mode_distances": ("x u p", "z"),
    "jacobian_vector": ("x u p dx du dp", "sxd sy"),
    "vector_jacobian": ("x u p lxd ly", "ax au ap"),
}
"""What the core asks for: arguments and results."""

_CONDITIONS: Final = 4
"""Conditions of (9)."""


def controller_model(source: ControllerSource) -> Model:
    """The controller in C, with its variables."""
    table = controller_table(source)
    shared = {name: (resources.files("fmu.model") / name).read_text(encoding="utf-8") for name in _SHARED}
    written = (resources.files("fmu.controller") / "controller.c").read_text(encoding="utf-8")
    files = {
        **shared,
        "controller.c": written,
        "qo_sizes.h": _sizes(table),
        "qo_table.c": table_source(table),
        "qo_equations.h": _prototypes(),
        "qo_reference.h": _header(source),
        "qo_reference.c": _tables(source),
    }
    outputs = table.block(Block.OUTPUT)
    return Model(table, files, {row.name: () for row in outputs}, source.reference.sample_time)


def _sizes(table: VariableTable) -> str:
    blocks = {"NX": Block.STATE, "NU": Block.INPUT, "NP": Block.PARAMETER, "NY": Block.OUTPUT}
    lines = [f"#define QO_{name} {len(table.block(block))}" for name, block in blocks.items()]
    lines += [f"#define QO_NZ {_CONDITIONS}", f"#define QO_TOLERANCE {TOLERANCE!r}"]
    return guarded("QO_SIZES_H", "Sizes of the controller.", [*lines, f"#define QO_FIRST_STEP {FIRST_STEP!r}"])


def _prototypes() -> str:
    lines = []
    for name, (arguments, results) in _EQUATIONS.items():
        parts = [f"const double *{one}" for one in arguments.split()] + [f"double *{one}" for one in results.split()]
        lines.append(f"void qo_eq_{name}({', '.join(parts)});")
    return guarded("QO_EQUATIONS_H", "What the core asks of a model.", lines)


def _header(source: ControllerSource) -> str:
    reference = source.reference
    constants = {
        "SAMPLES": len(reference),
        "LOOPS": len(source.loops),
        "MOTION_MODE": int(source.mode),
        "RATE_CYCLES": STEERING_RATE_CYCLES,
        "SAMPLE_TIME": reference.sample_time,
        "GEAR_RATIO": float(source.vehicle.geometry.gear_ratio),
        "STANDSTILL_GAIN": STANDSTILL_GAIN,
        "LEAK": math.exp(-reference.sample_time / LEAK_TIME),
        "REST": REST,
    }
    lines = [f"#define QO_{name} {value!r}" for name, value in constants.items()]
    groups = {"X": states_of(source), "U": inputs_of(), "P": parameters_of(source)}
    for letter, group in groups.items():
        lines += _places(letter, group)
    lines += [
        "",
        "typedef struct {",
        "    const char *name;",
        "    int side;             /* of the steering that it is, -1 where wheels carry it */",
        "    const double *wheels; /* its column of H_k at the first sample */",
        "    int stride;           /* from sample to sample; 0 where the column is always the same */",
        "} qo_loop;",
        "",
        "extern const qo_loop qo_loops[QO_LOOPS];",
        "extern const double qo_positions[QO_LOOPS][QO_SAMPLES];",
        "extern const double qo_velocities[QO_LOOPS][QO_SAMPLES];",
        "extern const double qo_feed_forward[QO_SAMPLES][4];",
        "extern const double qo_path[QO_SAMPLES][3];",
    ]
    return guarded("QO_REFERENCE_H", "What the controller follows, and where its values are.", lines)


def _places(letter: str, groups: Groups) -> Iterable[str]:
    place = 0
    for name, rows in groups.items():
        yield f"#define QO_{letter}_{name} {place}"
        place += len(rows)


def _tables(source: ControllerSource) -> str:
    reference, tracks = source.reference, list(source.reference.tracks.values())
    columns = [_column(track.wheels) for track in tracks]
    lines = ["/* What the controller follows, sample by sample. Generated. */", '#include "qo_reference.h"', ""]
    for loop, column in enumerate(columns):
        lines.append(_array(f"static const double wheels_{loop}[{len(column)}][4]", column))
    lines += ["const qo_loop qo_loops[QO_LOOPS] = {"]
    for loop, (name, column) in enumerate(zip(source.loops, columns, strict=True)):
        side = STEERING_LOOPS.index(name) if name in STEERING_LOOPS else -1
        lines.append(f'    {{"{name}", {side}, wheels_{loop}[0], {4 if len(column) > 1 else 0}}},')
    return "\n".join(
        [
            *lines,
            "};",
            "",
            _array("const double qo_positions[QO_LOOPS][QO_SAMPLES]", np.stack([track.position for track in tracks])),
            _array("const double qo_velocities[QO_LOOPS][QO_SAMPLES]", np.stack([track.velocity for track in tracks])),
            _array("const double qo_feed_forward[QO_SAMPLES][4]", reference.feed_forward),
            _array("const double qo_path[QO_SAMPLES][3]", reference.path),
        ]
    )


def _column(wheels: Array) -> Array:
    """Of H_k by sample, once where it never changes."""
    return wheels[:1] if np.all(wheels == wheels[0]) else wheels


def _array(declaration: str, values: Array) -> str:
    rows = ",\n".join(f"{{{_row(row)}}}" for row in values.tolist())
    return f"{declaration} = {{\n{rows}\n}};\n"


def _row(values: Sequence[float]) -> str:
    return ", ".join(repr(value) for value in values)
