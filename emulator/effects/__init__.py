"""Effects that the emulator injects physically: in bodies, floor, friction, drives, transmissions and sensors."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from types import MappingProxyType
from typing import Final

from emulator.as_built import AsBuilt
from emulator.effects import library
from emulator.effects.base import Injector, Placed, Unlibraried, Wanted
from emulator.effects.injection import Injection
from emulator.effects.measured import MEASURED
from emulator.effects.places import each, wheels_of
from emulator.effects.transmissions import MOTOR_SHARE
from emulator.prototype import Prototype
from ident.errors import UserError

__all__ = ["INJECTORS", "MEASURED", "Injector", "Unlibraried", "Wanted", "inject", "injector_of"]


def _found() -> dict[str, Injector]:
    modules = [entry.name for entry in pkgutil.iter_modules(library.__path__)]
    injectors = [import_module(f"{library.__name__}.{module}").INJECTOR for module in modules]
    return {injector.name: injector for injector in injectors}


INJECTORS: Final[Mapping[str, Injector]] = MappingProxyType(_found())
"""Every effect by its name: one for each module of `emulator.effects.library`."""


def injector_of(name: str) -> Injector | None:
    """Of an effect of the library, or of a law without a name; None where there is neither."""
    return INJECTORS.get(name) or MEASURED.get(name)


def inject(prototype: Prototype, effects: Sequence[Wanted], step: float) -> Injection:
    """The prototype with all `effects`.

    Args:
        prototype: without them.
        effects: in any order.
        step: of the engine [s].

    Raises:
        UserError: an effect is unknown here or cannot be there, two effects exclude each other, or one is larger than
            this vehicle can have.
    """
    for effect in effects:
        _refuse_strange(effect)
    _refuse_twice(effects)
    injection = Injection(AsBuilt.of(prototype), step)
    for effect in sorted(effects, key=lambda effect: not _known(effect).first):
        for where in each(effect.where):
            injection = _known(effect).inject(injection, Placed(effect, where))
    return _without_motor_inertia(injection)


def _known(effect: Wanted) -> Injector:
    known = injector_of(effect.name)
    if known is None:
        raise UserError(f"{effect}: the emulator has no such effect.", f"It has: {', '.join(sorted(INJECTORS))}.")
    return known


def _refuse_strange(effect: Wanted) -> None:
    known = _known(effect)
    if effect.where not in known.places:
        raise UserError(f"{effect}: it cannot be there.", f"Places of {known.name}: {', '.join(known.places)}.")


def _without_motor_inertia(injection: Injection) -> Injection:
    """A motor behind a flexible gear turns on its own: its inertia is no longer the wheel's."""
    wheels = injection.built.wheels
    for index, flaws in enumerate(injection.drives):
        if flaws.flexible:
            lying, spin, standing = wheels[index].body.inertia
            body = replace(wheels[index].body, inertia=(lying, (1 - MOTOR_SHARE) * spin, standing))
            wheels = (*wheels[:index], replace(wheels[index], body=body), *wheels[index + 1 :])
    return replace(injection, built=replace(injection.built, wheels=wheels))


def _refuse_twice(effects: Sequence[Wanted]) -> None:
    for index, effect in enumerate(effects):
        for other in effects[:index]:
            if effect.name == other.name and _overlap(effect, other):
                raise UserError(
                    f"{other} and {effect} exclude each other: both are {effect.name} of the same part.",
                    "Give one of them, with the size of both.",
                )


def _overlap(effect: Wanted, other: Wanted) -> bool:
    """The same place; or the same wheel, where one would replace the other."""
    if not _known(effect).exclusive:
        return effect.where == other.where
    here, there = ({wheel for where in each(one.where) for wheel in wheels_of(where)} for one in (effect, other))
    return bool(here & there)
