"""The effects that a model may lack: what they are, where they can be, what they add, how they are written down.

What an effect does is written twice, on purpose: by the emulator, which injects it physically, and here by equations.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.effects import library
from ident.effects.base import Effect, EffectKind, EffectParameter, EffectTerm, effect_of
from ident.effects.laws import LAWS
from ident.plant.places import members
from ident.plant.symbolic import Expression

__all__ = [
    "EFFECTS",
    "LAWS",
    "Effect",
    "EffectKind",
    "EffectParameter",
    "EffectTerm",
    "at_single_places",
    "effect_term",
    "kind_of",
    "make_effect",
    "symbolic_term",
    "terms_of",
]


def _found() -> dict[str, EffectKind]:
    modules = [entry.name for entry in pkgutil.iter_modules(library.__path__)]
    kinds = [import_module(f"{library.__name__}.{module}").EFFECT for module in modules]
    return {kind.name: kind for kind in sorted(kinds, key=lambda kind: kind.rank)}


EFFECTS: Final[Mapping[str, EffectKind]] = MappingProxyType(_found())
"""Every effect by its name: one for each module of `ident.effects.library`, in the order of their ranks."""


def kind_of(name: str) -> EffectKind:
    """What there is to know about an effect of the library, or a law without a name.

    Raises:
        KeyError: there is neither.
    """
    return EFFECTS[name] if name in EFFECTS else LAWS[name]


def make_effect(name: str, where: str, values: Mapping[str, float], std: Mapping[str, float] | None = None) -> Effect:
    """An effect from SI values; parameters that are left out take their defaults.

    Raises:
        DataFileError: the effect cannot be there, or a parameter is unknown, missing or not finite.
    """
    return effect_of(kind_of(name), where, values, std)


def at_single_places(effects: Sequence[Effect]) -> list[Effect]:
    """The same effects, those of a group at each of its members."""
    return [replace(effect, where=place) for effect in effects for place in members(effect.where)]


def effect_term(name: str, where: str, values: Mapping[str, Expression]) -> EffectTerm:
    """What an effect adds to the equations, from numbers or symbols."""
    return kind_of(name).term(name, where, values)


def terms_of(effects: Sequence[Effect]) -> list[EffectTerm]:
    """What effects with numbers add to the equations."""
    return [
        effect_term(effect.name, effect.where, {name: value.value for name, value in effect.parameters.items()})
        for effect in effects
    ]


def symbolic_term(name: str, where: str) -> EffectTerm:
    """The same with symbols for its parameters, named `<effect>.<place>.<parameter>`."""
    entries = kind_of(name).parameters
    return effect_term(name, where, {entry.name: ca.SX.sym(f"{name}.{where}.{entry.name}") for entry in entries})
