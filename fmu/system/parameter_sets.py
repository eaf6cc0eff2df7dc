"""Sets of parameters for the vehicle of a system: as identified, at the ends of intervals, with diagnosed effects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from fmu.description import document
from fmu.interface import number
from fmu.parameter_rows import parameters_of
from fmu.units import unit_of
from ident.effects import Effect, kind_of
from ident.effects.extended import ExtendedModel
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS

Array = NDArray[np.float64]

NORMAL_95: Final = 1.959964
"""Half of a 95 % interval in standard deviations, where nothing better is known."""

_NAMESPACES: Final = {
    "xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}


@dataclass(frozen=True)
class ParameterSet:
    """A set of values for parameters of the vehicle.

    Attributes:
        name: of its file.
        text: one line for people.
        values: by the names of the FMU's parameters, SI.
        units: of them.
    """

    name: str
    text: str
    values: Mapping[str, float]
    units: Mapping[str, str]


@dataclass(frozen=True)
class Knowledge:
    """How well the eleven parameters of a model are known.

    Attributes:
        low, high: ends of their 95 % intervals (11,).
        std: (11,).
        correlation: (11, 11).
    """

    low: Array
    high: Array
    std: Array
    correlation: Array


def model_set(name: str, text: str, model: ExtendedModel, absent: tuple[Effect, ...], floor: float) -> ParameterSet:
    """The set of a model.

    Args:
        name, text: of the set.
        model: parameters and effects.
        absent: effects that the FMU has and the model does not; they get size zero.
        floor: friction coefficient that wheels have without the effect `slip`.
    """
    values = {one: model.parameters[one] for one in PARAMETER_NAMES}
    units = dict(PARAMETER_UNITS)
    present = {(effect.name, effect.where) for effect in model.effects}
    for effect in absent:
        if (effect.name, effect.where) not in present:
            values |= _without(effect, floor)
            units |= _units(effect)
    for effect in model.effects:
        values |= _as_found(effect)
        units |= _units(effect)
    return ParameterSet(name, text, values, units)


def _as_found(effect: Effect) -> dict[str, float]:
    return {name: effect[entry] for entry in effect.parameters for name in parameters_of(effect, entry)}


def _without(effect: Effect, floor: float) -> dict[str, float]:
    kind = kind_of(effect.name)
    neutral = {kind.size.name: floor} if kind.stands_for else kind.neutral()
    return {name: neutral[entry] for entry in effect.parameters for name in parameters_of(effect, entry)}


def _units(effect: Effect) -> dict[str, str]:
    kind = kind_of(effect.name)
    return {
        name: kind.unit(entry, effect.where) for entry in effect.parameters for name in parameters_of(effect, entry)
    }


def corners(base: ParameterSet, knowledge: Knowledge) -> Iterator[ParameterSet]:
    """Two sets for each parameter: it is at an end of its interval, the others where they are then most likely.

    Parameters that are known together move together: where C_l is larger than thought, what correlates with it is too.
    Corners of the box of all intervals are vehicles that no record supports. A set with a parameter below zero is left
    out, friction excepted, which is zero there.
    """
    centre = np.array([base.values[name] for name in PARAMETER_NAMES])
    for column, name in enumerate(PARAMETER_NAMES):
        if knowledge.std[column] <= 0:
            continue
        slope = knowledge.correlation[column] * knowledge.std / knowledge.std[column]
        for end, bounds in (("low", knowledge.low), ("high", knowledge.high)):
            moved = centre + slope * (bounds[column] - centre[column])
            found = {one: _possible(one, value) for one, value in zip(PARAMETER_NAMES, moved.tolist(), strict=True)}
            if all(value > 0 or not PARAMETER_UNITS[one].startswith("kg") for one, value in found.items()):
                text = f"{name} at the {end} end of its 95 % interval, the others as it is then most likely"
                yield ParameterSet(f"corner_{name}_{end}", text, {**base.values, **found}, base.units)


def _possible(name: str, value: float) -> float:
    return value if PARAMETER_UNITS[name].startswith("kg") else max(value, 0.0)


def effect_ends(base: ParameterSet, model: ExtendedModel) -> Iterator[ParameterSet]:
    """Two sets for each effect whose size has a standard deviation: it is at an end of its 95 % interval."""
    for effect in model.effects:
        size = kind_of(effect.name).size.name
        std = effect.parameters[size].std
        for end, sign in (("low", -1), ("high", 1)) if std > 0 else ():
            value = effect.size + sign * NORMAL_95 * std
            if value * effect.size > 0:
                values = {**base.values, **dict.fromkeys(parameters_of(effect, size), value)}
                text = f"{effect} at the {end} end of its 95 % interval"
                yield ParameterSet(f"effect_{effect.name}_{effect.where}_{end}", text, values, base.units)


def parameter_set_file(chosen: ParameterSet, vehicle: VehicleDescription, tool: str) -> bytes:
    """The set as `.ssv` of SSP 1.0; names are those of the FMU of the vehicle."""
    root = Element("ssv:ParameterSet", _NAMESPACES, version="1.0", name=chosen.name)
    root.set("description", f"{vehicle.name}: {chosen.text}")
    root.set("generationTool", tool)
    rows = SubElement(root, "ssv:Parameters")
    for name, value in chosen.values.items():
        row = SubElement(rows, "ssv:Parameter", name=name)
        SubElement(row, "ssv:Real", value=number(value), unit=chosen.units[name])
    add_units(SubElement(root, "ssv:Units"), dict.fromkeys(chosen.units[name] for name in chosen.values))
    return document(root)


def add_units(parent: Element, names: Mapping[str, None]) -> None:
    """Definitions of units by their SI exponents."""
    for name in names:
        unit = SubElement(parent, "ssc:Unit", name=name)
        SubElement(unit, "ssc:BaseUnit", {base: str(power) for base, power in unit_of(name).exponents.items()})
