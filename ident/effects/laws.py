"""Laws without a name: a smooth function of the motion of a joint or of the chassis, as it was found in records.

The function is a sum of uniform cubic B-splines, twice differentiable everywhere, times its partner: nothing, the
direction (then it holds the joint at rest, as dry friction does), the rate or the acceleration. Beyond its range it
keeps its last value; with a period it comes around. What depends on load or on path since a reversal has no form here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, sign_of
from ident.plant.places import CHASSIS, STEERING, WHEEL_PLACES, rows_of, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import FIRST_WHEEL, Masses, State

COUNT: Final = 48
"""Coefficients of a function: three in a period follow sixteen periods over its range."""

_FIRST_RANK: Final = 1000

_AHEAD: Final = 0
"""Row of q in which the chassis travels ahead."""


def coefficient(index: int) -> str:
    """Name of a coefficient."""
    return f"c_{index:02d}"


@dataclass(frozen=True)
class _LawTerm(EffectTerm):
    """f(variable) at every joint of the place, or ahead, times `_partner`; `holds` where that is the direction."""

    holds: ClassVar[bool] = False
    places: ClassVar[tuple[str, ...]] = with_groups(STEERING, WHEEL_PLACES)

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """The law, unless it holds at rest."""
        del masses, parameters
        return ca.SX(9, 1) if self.holds else self._in_rows(state)

    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """The law, if it holds at rest."""
        del parameters
        return self._in_rows(state) if self.holds else ca.SX(9, 1)

    def _in_rows(self, state: State) -> Expression:
        rows = ca.SX(9, 1)
        for row in (_AHEAD,) if self.where in CHASSIS else rows_of(self.where):
            rows[row] = self["scale"] * self._function(self._variable(state, row)) * self._partner(state, row)
        return rows

    def _variable(self, state: State, row: int) -> Expression:
        return state.alpha[row - 3] if row < FIRST_WHEEL else state.beta[row - FIRST_WHEEL]

    def _partner(self, state: State, row: int) -> Expression:
        del state, row
        return 1.0

    def _function(self, x: Expression) -> Expression:
        start, step, period = self["start"], self["step"], self["period"]
        inside = ca.fmin(ca.fmax(x, start + step), start + (COUNT - 2) * step)
        total = ca.SX(0)
        for index in range(COUNT):
            away = inside - start - index * step
            turns = (x - start - index * step) / ca.fmax(period, _LEAST_PERIOD)
            around = (turns - ca.floor(turns + 0.5)) * period
            total += self[coefficient(index)] * _kernel(ca.if_else(period > 0, around, away) / step)
        return total


_LEAST_PERIOD: Final = 1e-9
"""What a period of zero is divided by in its place [rad]."""


def _kernel(u: Expression) -> Expression:
    size = ca.fabs(u)
    return (ca.fmax(2 - size, 0) ** 3 - 4 * ca.fmax(1 - size, 0) ** 3) / 6


class _OverRate(_LawTerm):
    places: ClassVar[tuple[str, ...]] = (*_LawTerm.places, *CHASSIS)

    def _variable(self, state: State, row: int) -> Expression:
        return state.rates[row]


class _Direction(_LawTerm):
    holds: ClassVar[bool] = True

    def _partner(self, state: State, row: int) -> Expression:
        return sign_of(state.rates[row])


class _Rate(_LawTerm):
    def _partner(self, state: State, row: int) -> Expression:
        return state.rates[row]


class _Acceleration(_LawTerm):
    def _partner(self, state: State, row: int) -> Expression:
        return state.accelerations[row]


class _OverTime(_Direction):
    takes_time: ClassVar[bool] = True

    def _variable(self, state: State, row: int) -> Expression:
        del row
        return state.elapsed


def _units(unit_x: str, unit_y: str) -> dict[str, str]:
    """Of the parameters that have those of its variable and of the function."""
    return dict.fromkeys(("start", "step", "period"), unit_x) | {coefficient(i): unit_y for i in range(COUNT)}


def _kind(rank: int, name: str, term: type[_LawTerm], unit_x: str, unit_y: str) -> EffectKind:
    return EffectKind(
        name=name,
        rank=_FIRST_RANK + rank,
        places=term.places,
        parameters=(
            EffectParameter("scale", "1", "of the law as it was found"),
            EffectParameter("start", unit_x, "of the first coefficient"),
            EffectParameter("step", unit_x, "between coefficients", positive=True),
            EffectParameter("period", unit_x, "after which the law comes around; 0: it does not", 0.0),
            *(EffectParameter(coefficient(index), unit_y, "coefficient of a B-spline") for index in range(COUNT)),
        ),
        term=term,
        words="a law without a name, {scale} of what was found",
        usual=lambda vehicle, where: 1.0,
        units_at=MappingProxyType({CHASSIS[0]: _units("m/s", "N")}),
        adding=(),
        always=False,
    )


_KINDS: Final[tuple[tuple[str, type[_LawTerm], str, str], ...]] = (
    ("law_rate", _OverRate, "rad/s", "Nm"),
    ("law_angle", _LawTerm, "rad", "Nm"),
    ("law_angle_direction", _Direction, "rad", "Nm"),
    ("law_angle_rate", _Rate, "rad", "Nm s/rad"),
    ("law_angle_acceleration", _Acceleration, "rad", "kg m^2"),
    ("law_time_direction", _OverTime, "s", "Nm"),
)

LAWS: Final[Mapping[str, EffectKind]] = MappingProxyType(
    {entry[0]: _kind(rank, *entry) for rank, entry in enumerate(_KINDS)}
)
"""Every law that a model can have, by its name."""
