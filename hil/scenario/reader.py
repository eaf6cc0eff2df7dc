"""Reads scenario files; every refusal names file, key and remedy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from hil.faults import Fault, parse_fault
from hil.faults.fault import FaultError
from hil.scenario.conditions import CONDITIONS
from hil.scenario.scenario import Begin, Expected, Scenario, Span, Torques, Writing
from hil.scenario.values import Key, choice, integer, number, read_keys, role, text, torques
from ident.errors import DataFileError, UserError
from ident.vehicle.quantities import read_toml, refuse_unknown

LONGEST: Final = 3600.0
"""Longest scenario [s]."""

_TIME: Final = number(0.0, LONGEST)
_HEAD: Final[Mapping[str, Key]] = {
    "name": Key(text, ""),
    "begin": Key(choice(Begin), Begin.ENABLED),
    "stand": Key(choice(("floor", "jack")), "floor"),
    "duration": Key(_TIME, None),
    "prototype": Key(text, None),
    "network": Key(text, None),
    "seed": Key(integer(0, 2**32 - 1), None),
}
_TORQUE: Final[Mapping[str, Key]] = {"at": Key(_TIME), "torque": Key(torques), "over": Key(_TIME, 0.0)}
_WRITING: Final[Mapping[str, Key]] = {
    "at": Key(_TIME),
    "node": Key(role),
    "object": Key(integer(0x1000, 0xFFFF)),
    "subindex": Key(integer(0, 255), 0),
    "value": Key(integer(-(2**31), 2**32 - 1)),
}
_FAULT: Final[Mapping[str, Key]] = {"at": Key(_TIME, 0.0), "inject": Key(text)}
_SPANS: Final = tuple(str(span) for span in Span if span is not Span.NOW)
_SETTINGS: Final = ("prototype", "network", "seed")


def read_scenario(path: Path) -> Scenario:
    """The scenario of a TOML file.

    Raises:
        DataFileError: it cannot be read, or an entry is missing, unknown or impossible; says which, and what to do.
    """
    document = read_toml(path)
    refuse_unknown(document, ("scenario", "setpoint", "fault", "expect"), f"{path}:")
    head = read_keys(_table(document, path), _HEAD, f"{path}: scenario")
    setpoints = [_setpoint(table, where) for table, where in _entries(document, "setpoint", path)]
    moved = sorted((one for one in setpoints if isinstance(one, Torques)), key=lambda one: one.at)
    faults = [_fault(table, where) for table, where in _entries(document, "fault", path)]
    expected = [_expected(table, where) for table, where in _entries(document, "expect", path)]
    if not expected:
        raise DataFileError(f"{path} expects nothing.", 'Add [[expect]] with that = "at_rest", or another condition.')
    last = max([one.end for one in expected] + [one.at for one in setpoints])
    if head["duration"] is not None and head["duration"] < last:
        raise DataFileError(
            f"{path}: scenario.duration = {head['duration']:g} s ends before what it holds, at {last:g} s.",
            f"Give at least {last:g}, or leave duration out.",
        )
    return Scenario(
        path,
        head["name"] or path.name.removesuffix(".toml").removesuffix(".scenario"),
        Begin(head["begin"]),
        head["stand"] == "jack",
        last if head["duration"] is None else head["duration"],
        tuple(moved),
        tuple(one for one in setpoints if isinstance(one, Writing)),
        tuple(faults),
        tuple(expected),
        {name: head[name] for name in _SETTINGS if head[name] is not None},
    )


def _table(document: Mapping[str, Any], path: Path) -> Mapping[str, Any]:
    table = document.get("scenario", {})
    if not isinstance(table, Mapping):
        raise DataFileError(f"{path}: scenario is no table.", "Write [scenario] and its entries below it.")
    return table


def _entries(document: Mapping[str, Any], name: str, path: Path) -> Sequence[tuple[Mapping[str, Any], str]]:
    entries = document.get(name, [])
    if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
        raise DataFileError(f"{path}: {name} is no list of tables.", f"Write [[{name}]], once for each.")
    return [(entry, f"{path}: {name}[{number}]") for number, entry in enumerate(entries, start=1)]


def _setpoint(table: Mapping[str, Any], where: str) -> Torques | Writing:
    if "torque" in table:
        found = read_keys(table, _TORQUE, where)
        return Torques(found["at"], found["torque"], found["over"])
    if "object" in table:
        found = read_keys(table, _WRITING, where)
        return Writing(found["at"], found["node"], found["object"], found["subindex"], found["value"])
    raise DataFileError(
        f"{where} sets nothing.", "Give torque = [fl, rl, fr, rr] in Nm, or node, object and value for an SDO."
    )


def _fault(table: Mapping[str, Any], where: str) -> Fault:
    found = read_keys(table, _FAULT, where)
    try:
        fault = parse_fault(found["inject"])
    except FaultError as error:
        raise DataFileError(f"{where}.inject: {error.what}", error.remedy) from error
    return replace(fault, start=fault.start + found["at"], end=fault.end + found["at"])


def _expected(table: Mapping[str, Any], where: str) -> Expected:
    kind = read_keys(table, {"that": Key(choice(CONDITIONS))}, where, more=True)["that"]
    keys, build = CONDITIONS[kind]
    known = {"that": Key(text), "at": Key(_TIME, 0.0), **dict.fromkeys(_SPANS, Key(_TIME, None)), **keys}
    found = read_keys(table, known, where)
    spans = [name for name in _SPANS if found[name] is not None]
    if len(spans) > 1:
        raise DataFileError(f"{where} has {' and '.join(spans)}.", "Keep one, and write another [[expect]].")
    try:
        condition = build(*(found[name] for name in keys))
    except UserError as error:
        raise DataFileError(f"{where}: {error.what}", error.remedy) from error
    if not spans:
        return Expected(found["at"], condition, Span.NOW)
    return Expected(found["at"], condition, Span(spans[0]), found[spans[0]])
