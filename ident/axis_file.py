"""`axis.toml`, written here alone: the model of servo axes, and the effects that were found beside it.

| table | what |
|---|---|
| `[source]` | records, and what made the file of them |
| `[axis.parameters.NAME]` | value, unit, standard deviation of M, Fv, Fc and offset; `axis_1`, ... of several |
| `[[axis.effects]]` | name, place and parameters of what the model has beyond M a + Fv v + Fc sign(v) + offset |
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.vehicle.quantities import Quantity
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.axis/1"


@dataclass(frozen=True)
class AxisEffectEntry:
    """An effect of an axis.

    Attributes:
        name, where: canonical name and place.
        parameters: name -> value with unit and standard deviation.
        curve: (variable, value, standard deviation) of a law without a name; else empty.
    """

    name: str
    where: str
    parameters: Mapping[str, Quantity]
    curve: Sequence[Sequence[float]] = ()


@dataclass(frozen=True)
class AxisModelEntry:
    """The model of one axis: M a + Fv v + Fc sign(v) + offset = effort, and its effects.

    Attributes:
        name: `axis`, or `axis_NAME` of several.
        parameters: M, Fv, Fc and offset.
        effects: beside them.
    """

    name: str
    parameters: Mapping[str, Quantity]
    effects: Sequence[AxisEffectEntry] = ()


def write_axis_models(models: Sequence[AxisModelEntry], path: Path, provenance: Mapping[str, str]) -> None:
    """Write the file whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    lines = [f'schema = "{SCHEMA}"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for model in models:
        for name, quantity in model.parameters.items():
            lines += ["", f"[{model.name}.parameters.{name}]", *_entries(quantity)]
        for effect in model.effects:
            lines += ["", f"[[{model.name}.effects]]", f"name = {json.dumps(effect.name)}"]
            lines += [f"where = {json.dumps(effect.where)}"]
            if effect.curve:
                lines += [f"curve = {json.dumps([list(point) for point in effect.curve])}"]
            for name, quantity in effect.parameters.items():
                lines += ["", f"[{model.name}.effects.parameters.{name}]", *_entries(quantity)]
    write_whole("\n".join(lines) + "\n", path)


def _entries(quantity: Quantity) -> Iterator[str]:
    yield f"value = {quantity.value:.9g}"
    yield f"unit = {json.dumps(quantity.unit)}"
    yield f"std = {quantity.std:.6g}"
    yield f"source = {json.dumps(quantity.source)}"
