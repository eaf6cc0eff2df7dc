"""What an effect of the emulator is: its name, places and units as this side has them, and what it does to a vehicle.

An effect is one module of `emulator.effects.library`, with its `Injector` as `INJECTOR`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from emulator.effects.injection import Injection
from emulator.effects.laws import Law
from emulator.effects.places import JointAxis, joint_axes
from ident.errors import UserError


class Wanted(Protocol):
    """An effect that someone asks for."""

    @property
    def name(self) -> str:
        """Canonical."""

    @property
    def where(self) -> str:
        """Its place."""

    def __getitem__(self, parameter: str) -> float:
        """A number of it, SI."""


@dataclass(frozen=True)
class Placed:
    """An effect that someone asks for, at one place.

    Attributes:
        effect: as it is asked for.
        where: a single place.
    """

    effect: Wanted
    where: str

    def __getitem__(self, parameter: str) -> float:
        return self.effect[parameter]

    def not_negative(self, parameter: str) -> float:
        """A number of it, SI.

        Raises:
            UserError: it is negative.
        """
        value = self[parameter]
        if value < 0:
            raise UserError(f"{self}: its {parameter} cannot be negative.", "Give a positive number.")
        return value

    def __str__(self) -> str:
        return f"{self.effect.name}@{self.effect.where}"


Inject = Callable[[Injection, Placed], Injection]
"""The vehicle with an effect, from the vehicle without it; raises UserError where it cannot have it."""


@dataclass(frozen=True)
class Injector:
    """What there is to know about an effect on this side.

    Attributes:
        name: canonical.
        places: where it can be.
        units: of its parameters, SI; the first is its size.
        inject: makes it, at one place.
        units_at: units of the size that differ from the table's, by place.
        known: whether models have it too; what no model has is `unknown` to a diagnosis.
        signed: whether it goes both ways.
        first: whether it derives the bodies anew, which others then load, shift and replace.
        exclusive: whether two of it at one part would replace each other.
        breaks_rolling: whether it shows where wheels are seen to roll, and not in torques.
        threshold: whether its size is a limit: it does nothing while that is not reached, and more the smaller it is.
        largest: size in practice, where `known` is false; models say it of theirs.
    """

    name: str
    places: tuple[str, ...]
    units: Mapping[str, str]
    inject: Inject
    units_at: Mapping[str, str] = field(default_factory=dict)
    known: bool = True
    signed: bool = False
    first: bool = False
    exclusive: bool = False
    breaks_rolling: bool = False
    threshold: bool = False
    largest: float = 0.0

    @property
    def size(self) -> str:
        """The parameter that says how large it is."""
        return next(iter(self.units))

    def unit(self, where: str) -> str:
        """Of the size at a place."""
        return self.units_at.get(where, self.units[self.size])


@dataclass(frozen=True)
class Unlibraried:
    """An effect that no model has.

    Attributes:
        name: canonical.
        where: a place of it.
        size: in the unit of its size.
    """

    name: str
    where: str
    size: float

    def __getitem__(self, parameter: str) -> float:
        return self.size

    def __str__(self) -> str:
        return f"{self.name}@{self.where}"


def refuse_imbalance(effect: Placed, own: float, symbol: str) -> None:
    """Refuse a difference between directions beyond the friction itself: one direction would drive the joint.

    Raises:
        UserError: it is larger than the friction that the joint has.
    """
    if abs(effect["imbalance"]) > own:
        raise UserError(
            f"{effect}: an imbalance of {effect['imbalance']:g} is more than the friction that it is part of.",
            f"Stay below {symbol}, here {own:g}.",
        )


def laws(make: Callable[[Injection, Placed], Iterable[Law]]) -> Inject:
    """An effect that is laws of every engine step."""
    return lambda injection, effect: injection.with_laws(*make(injection, effect))


def at_joints(make: Callable[[JointAxis, Placed], Law]) -> Inject:
    """An effect that is one law at every joint of its place."""
    return laws(lambda _, effect: [make(axis, effect) for axis in joint_axes(effect.where)])
