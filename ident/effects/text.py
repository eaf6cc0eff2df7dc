"""How effects are written: on a command line, and as `[[effects]]` of a TOML file."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

from ident.effects import EFFECTS, LAWS, Effect, EffectKind, make_effect
from ident.errors import DataFileError

_FACTORS: Final[Mapping[str, tuple[float, str]]] = MappingProxyType(
    {"%": (0.01, "1"), "deg": (math.pi / 180, "rad"), "mrad": (1e-3, "rad"), "mm": (1e-3, "m"), "ms": (1e-3, "s")}
)
"""Units that people write on a command line -> factor and SI unit."""

_VALUE: Final = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)")


def parse_effect(text: str) -> Effect:
    """`stribeck@steering_left=6Nm`, `slope@chassis=2deg,direction=0.5rad`: size first, then other parameters.

    Raises:
        DataFileError: the text is not of that form, or names what does not exist; the remedy says what does.
    """
    head, equals, numbers = text.partition("=")
    name, at, where = head.partition("@")
    if not (equals and at):
        raise DataFileError(
            f"{text!r} is not an effect.", "Write NAME@PLACE=SIZE, for example stribeck@steering_left=6Nm."
        )
    if name not in EFFECTS:
        raise DataFileError(f"There is no effect {name!r}.", f"Effects: {', '.join(EFFECTS)}.")
    spec = EFFECTS[name]
    if where not in spec.places:
        raise DataFileError(f"{text!r}: {name} cannot be there.", f"Places of {name}: {', '.join(spec.places)}.")
    first, *others = numbers.split(",")
    values = {spec.size.name: _number(first, spec, spec.size.name, where, text)}
    for other in others:
        key, _, number = (part.strip() for part in other.partition("="))
        values[key] = _number(number, spec, key, where, text)
    return make_effect(spec.name, where, values)


def _number(written: str, spec: EffectKind, parameter: str, where: str, text: str) -> float:
    if parameter not in {entry.name for entry in spec.parameters}:
        names = ", ".join(entry.name for entry in spec.parameters)
        raise DataFileError(f"{text!r}: {spec.name} has no parameter {parameter!r}.", f"Its parameters: {names}.")
    unit = spec.unit(parameter, where)
    match = _VALUE.fullmatch(written.strip())
    if match is None:
        raise DataFileError(f"{text!r}: {written!r} is not a number with a unit.", f"Give {parameter} in {unit}.")
    value, given = float(match[1]), str(match[2]).strip()
    factor, si = _FACTORS.get(given, (1.0, given or unit))
    if si.replace(" ", "") != unit.replace(" ", ""):
        raise DataFileError(f"{text!r}: {parameter} is not in {given!r}.", f"Give it in {unit}.")
    return value * factor


def effects_text(effects: Sequence[Effect]) -> str:
    """TOML: one `[[effects]]` each, with `name`, `where` and a table `parameters`."""
    lines: list[str] = []
    for effect in effects:
        lines += ["", "[[effects]]", f'name = "{effect.name}"', f'where = "{effect.where}"']
        for name, quantity in effect.parameters.items():
            entry = f'value = {quantity.value:.9g}, unit = "{quantity.unit}", std = {quantity.std:.6g}'
            lines.append(f"parameters.{name} = {{ {entry} }}")
    return "\n".join(lines) + "\n" if lines else ""


def read_effects(document: Mapping[str, Any], source: str) -> tuple[Effect, ...]:
    """The effects of a parsed TOML document, none when it has no `[[effects]]`.

    Raises:
        DataFileError: an entry is not an effect; says which.
    """
    entries = document.get("effects", [])
    if not isinstance(entries, list):
        raise DataFileError(f"{source}: effects is not a list of tables.", "Write one [[effects]] for each.")
    return tuple(_read_effect(entry, f"{source}: effects, entry {count}") for count, entry in enumerate(entries, 1))


def _read_effect(entry: Any, source: str) -> Effect:
    table = entry if isinstance(entry, Mapping) else {}
    name, where, parameters = table.get("name"), table.get("where"), table.get("parameters")
    kind = (EFFECTS.get(name) or LAWS.get(name)) if isinstance(name, str) else None
    if kind is None or not isinstance(where, str) or not isinstance(parameters, Mapping):
        raise DataFileError(f"{source} has no known name, no where or no parameters.", f"Names: {', '.join(EFFECTS)}.")
    values, std = {}, {}
    for key, quantity in parameters.items():
        if not isinstance(quantity, Mapping) or not isinstance(quantity.get("value"), int | float):
            raise DataFileError(f"{source}: {key} has no value.", "Write { value = ..., unit = ..., std = ... }.")
        # Elsewhere no unit is right: `make_effect` says where it can be.
        known = where in kind.places and key in {parameter.name for parameter in kind.parameters}
        if known and quantity.get("unit") != kind.unit(key, where):
            raise DataFileError(f"{source}: {key} is in {quantity.get('unit')}.", f"Give {kind.unit(key, where)}.")
        values[key], std[key] = float(quantity["value"]), float(quantity.get("std", 0.0))
    return make_effect(kind.name, where, values, std)
