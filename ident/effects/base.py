"""What an effect is: places, parameters, and what it adds to the vehicle.

An effect of the library is one module of `ident.effects.library`, with its `EffectKind` as `EFFECT`. Its equations are
the methods of a subclass of `EffectTerm`. What it says nothing about, it does not do.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.errors import DataFileError
from ident.plant.places import indices, members, rows_of
from ident.plant.symbolic import EPSILON, Expression
from ident.plant.terms import Masses, State, Term
from ident.vehicle.description import VehicleDescription
from ident.vehicle.quantities import Quantity

FRICTION: Final[Mapping[int, tuple[str, str]]] = MappingProxyType(
    {3: ("d_vl", "d_cl"), 4: ("d_vr", "d_cr")} | dict.fromkeys(range(5, 9), ("d_vw", "d_cw"))
)
"""Viscous and Coulomb friction of the joint in a row of q."""


class Sign(enum.Enum):
    """Which sizes an effect can have."""

    EITHER = enum.auto()
    NOT_NEGATIVE = enum.auto()


@dataclass(frozen=True)
class EffectParameter:
    """A number that an effect has.

    Attributes:
        name: in files and on the command line.
        unit: SI.
        meaning: one line for people.
        default: value where none is given; None where it must be given.
        positive: whether it must be above zero.
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None
    positive: bool = False


@dataclass(frozen=True)
class EffectTerm(Term):
    """An effect at a place as an addition to the equations; its numbers may be symbols.

    Attributes:
        name, where: as in `Effect`.
        values: of all its parameters, SI.
    """

    name: str
    where: str
    values: Mapping[str, Expression]

    def __getitem__(self, parameter: str) -> Expression:
        return self.values[parameter]

    def among(self, kind: tuple[str, ...]) -> tuple[int, ...]:
        """Numbers of its places among those of one kind."""
        return indices(self.where, kind)

    def everywhere(self, parameter: str) -> Mapping[str, Expression]:
        """The value of a parameter at each single place that the effect has."""
        return dict.fromkeys(members(self.where), self[parameter])


class JointTerm(EffectTerm):
    """Friction laws of one rate, at every joint of the place."""

    def law(self, rate: Expression) -> Expression:
        """Torque [Nm] that resists at a rate [rad/s] and is zero at rest."""
        del rate
        return 0.0

    def dry_law(self, rate: Expression) -> Expression:
        """Torque [Nm] that resists at a rate [rad/s] and holds at rest."""
        del rate
        return 0.0

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """The law in the rows of the joints."""
        del masses, parameters
        return self._in_rows(self.law, state)

    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """The dry law in the rows of the joints."""
        del parameters
        return self._in_rows(self.dry_law, state)

    def _in_rows(self, law: Callable[[Expression], Expression], state: State) -> Expression:
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            rows[row] = law(state.rates[row])
        return rows


@dataclass(frozen=True)
class EffectKind:
    """What there is to know about an effect.

    Attributes:
        name: canonical, in every file and output.
        rank: its place in the order in which effects are listed.
        places: where it can be.
        parameters: the first is its size, zero (or, for `slip`, that of the floor) without the effect.
        term: makes what it adds to the equations, from name, place and values.
        words: what is said of it beside its place, with its parameters in braces.
        usual: its size in practice for a vehicle, by place: one that people do meet, and see.
        units_at: units of its parameters that differ from the table's, by place.
        sign: of its size.
        adding: parameters that add up where it is found twice; none where the sizes of one place do not.
        polar: length and angle that add up as vectors do.
        always: whether a generated model has it at every place, with size zero, for users to set.
        same_records: faults of a record that look like it whatever is driven -> its place, by channel; `fault@channel`
            of one channel, `fault@every channel` of all.
        stands_for: names of parameters that the vehicle has anyway and that its size takes the place of, by place.
        over: variable of its joint that it is a function of, and what that is multiplied with (`ident.diagnosis.law`).
    """

    name: str
    rank: int
    places: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    term: Callable[[str, str, Mapping[str, Expression]], EffectTerm]
    words: str
    usual: Callable[[VehicleDescription, str], float]
    units_at: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    sign: Sign = Sign.EITHER
    adding: tuple[str, ...] | None = None
    polar: tuple[str, str] | None = None
    always: bool = True
    same_records: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    stands_for: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    over: tuple[str, str] | None = None

    @property
    def size(self) -> EffectParameter:
        """The parameter that says how large the effect is."""
        return self.parameters[0]

    @property
    def takes_time(self) -> bool:
        """Whether it depends on the time since the start of the campaign."""
        return self.term(self.name, self.places[0], self.neutral()).takes_time

    def unit(self, parameter: str, where: str) -> str:
        """Unit of a parameter at a place."""
        usual = next(entry.unit for entry in self.parameters if entry.name == parameter)
        return self.units_at.get(where, {}).get(parameter, usual)

    @property
    def sums(self) -> tuple[str, ...]:
        """Parameters of what is found twice that make one, by adding up or as length and angle."""
        if self.polar is not None:
            return self.polar
        return (self.size.name,) if self.adding is None else self.adding

    def neutral(self) -> dict[str, float]:
        """Values of its parameters without the effect: no size, the others at their defaults."""
        return {entry.name: 0.0 if entry is self.size else float(entry.default or 0.0) for entry in self.parameters}


@dataclass(frozen=True)
class Effect:
    """An effect with its place and its numbers.

    Attributes:
        name: canonical.
        where: a place of its kind.
        parameters: name -> value with unit and standard uncertainty; all parameters of its kind.
    """

    name: str
    where: str
    parameters: Mapping[str, Quantity]

    def __getitem__(self, parameter: str) -> float:
        """Value of a parameter, SI."""
        return self.parameters[parameter].value

    @property
    def size(self) -> float:
        """Value of the parameter that says how large it is."""
        return next(iter(self.parameters.values())).value

    def __str__(self) -> str:
        return f"{self.name}@{self.where}"


def sign_of(rate: Expression) -> Expression:
    """The sign of a rate as (16) has it, smooth."""
    return ca.tanh(rate / EPSILON)


def viscous_friction(vehicle: VehicleDescription, where: str) -> float:
    """Of a joint as the vehicle file has it [Nm s/rad]."""
    return vehicle.prior[FRICTION[rows_of(where)[0]][0]]


def coulomb_friction(vehicle: VehicleDescription, where: str) -> float:
    """Of a joint as the vehicle file has it [Nm]."""
    return vehicle.prior[FRICTION[rows_of(where)[0]][1]]


def effect_of(
    kind: EffectKind, where: str, values: Mapping[str, float], std: Mapping[str, float] | None = None
) -> Effect:
    """An effect of a kind from SI values; parameters that are left out take their defaults.

    Raises:
        DataFileError: the effect cannot be there, or a parameter is unknown, missing or not finite.
    """
    text = f"effect {kind.name}@{where}"
    if where not in kind.places:
        raise DataFileError(f"{text}: it cannot be there.", f"Places of {kind.name}: {', '.join(kind.places)}.")
    known = {entry.name: entry for entry in kind.parameters}
    unknown = sorted(values.keys() - known.keys())
    if unknown:
        raise DataFileError(f"{text} has no parameter {unknown[0]!r}.", f"Its parameters: {', '.join(known)}.")
    quantities = {}
    for entry in kind.parameters:
        value = values.get(entry.name, entry.default)
        if value is None or not math.isfinite(value):
            raise DataFileError(f"{text} needs a number for {entry.name!r}.", f"It is {entry.meaning}.")
        if entry.positive and value <= 0:
            raise DataFileError(f"{text}: {entry.name} is {value:g}.", "Give a number above zero.")
        quantities[entry.name] = Quantity(value, kind.unit(entry.name, where), "", (std or {}).get(entry.name, 0.0))
    return Effect(kind.name, where, MappingProxyType(quantities))
