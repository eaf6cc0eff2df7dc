"""Laws of a joint's motion that were found in records and have no name: a table of them, read as a smooth curve.

The curve is that of uniform cubic B-splines, by the polynomials of one interval (Foley, van Dam et al., Computer
Graphics, 11.2.3); beyond its range it keeps its last value, and with a period it comes around.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from emulator.effects.base import Injector, Placed, at_joints
from emulator.effects.injection import Injection
from emulator.effects.laws import Law, Moment
from emulator.effects.places import CHASSIS, JOINTS, JointAxis

COUNT: Final = 48
"""Coefficients of a table."""


@dataclass(frozen=True)
class Table:
    """A function of one variable.

    Attributes:
        start, step: of the coefficients, in the unit of the variable.
        period: after which it comes around; 0: it does not.
        coefficients: (COUNT,).
    """

    start: float
    step: float
    period: float
    coefficients: tuple[float, ...]

    def __call__(self, x: float) -> float:
        """Value at x."""
        place = (x - self.start) / self.step
        if self.period > 0:
            place %= self.period / self.step
            first = math.floor(place)
        else:
            place = min(max(place, 1.0), COUNT - 2.0)
            first = min(math.floor(place), COUNT - 3)
        a, b, c, d = (self.coefficients[(first + index) % COUNT] for index in (-1, 0, 1, 2))
        t = place - first
        powers = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
        return sum(power * point for power, point in zip(powers, (a, b, c, d), strict=True)) / 6


@dataclass(frozen=True)
class _Measured:
    """A table at a joint, in the sense in which the joint counts as forward."""

    axis: JointAxis
    table: Table

    def angle(self, moment: Moment) -> float:
        """Of the joint [rad]."""
        return self.axis.sign * moment.angles[self.axis.joint]

    def rate(self, moment: Moment) -> float:
        """Of the joint [rad/s]."""
        return self.axis.sign * moment.rates[self.axis.joint]

    def resist(self, moment: Moment, torque: float) -> None:
        """Add a torque against the joint [Nm]."""
        moment.torques[self.axis.joint] -= self.axis.sign * self.axis.share * torque

    def brake(self, moment: Moment, torque: float) -> None:
        """Change the dry friction of the joint [Nm]; it never drives."""
        joint = self.axis.joint
        moment.coulomb[joint] = max(moment.coulomb[joint] + self.axis.share * torque, 0.0)


class OverRate(_Measured):
    """A torque over the rate [Nm]."""

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        self.resist(moment, self.table(self.rate(moment)))


@dataclass(frozen=True)
class OverSpeed:
    """A force on the chassis against its forward speed [N]."""

    table: Table

    def __call__(self, moment: Moment) -> None:
        """Push the chassis."""
        forward, _, _ = moment.engine.twist()
        moment.engine.push((-self.table(forward), 0.0, 0.0))


class OverAngle(_Measured):
    """A torque over the angle [Nm]."""

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        self.resist(moment, self.table(self.angle(moment)))


class ViscousOverAngle(_Measured):
    """Viscous friction over the angle [Nm s/rad]."""

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        self.resist(moment, self.table(self.angle(moment)) * self.rate(moment))


class CoulombOverAngle(_Measured):
    """Dry friction over the angle [Nm]."""

    def __call__(self, moment: Moment) -> None:
        """Change the friction of the joint."""
        self.brake(moment, self.table(self.angle(moment)))


class CoulombOverTime(_Measured):
    """Dry friction over the time since the world began [Nm]."""

    def __call__(self, moment: Moment) -> None:
        """Change the friction of the joint."""
        self.brake(moment, self.table(moment.time))


def _table(effect: Placed) -> Table:
    scale = effect["scale"]
    coefficients = tuple(scale * effect[f"c_{index:02d}"] for index in range(COUNT))
    return Table(effect["start"], effect["step"], effect["period"], coefficients)


def _injector(name: str, law: Callable[[JointAxis, Table], Law], unit_x: str, unit_y: str) -> Injector:
    units = {"scale": "1", "start": unit_x, "step": unit_x, "period": unit_x}
    return Injector(
        name=name,
        places=JOINTS,
        units=units | {f"c_{index:02d}": unit_y for index in range(COUNT)},
        inject=at_joints(lambda axis, effect: law(axis, _table(effect))),
        signed=True,
    )


_AT_JOINTS: Final = _injector("law_rate", OverRate, "rad/s", "Nm")


def _over_rate(injection: Injection, effect: Placed) -> Injection:
    if effect.where in CHASSIS:
        return injection.with_laws(OverSpeed(_table(effect)))
    return _AT_JOINTS.inject(injection, effect)


_OVER_RATE: Final = replace(_AT_JOINTS, places=(*JOINTS, *CHASSIS), inject=_over_rate)


MEASURED: Final[Mapping[str, Injector]] = MappingProxyType(
    {
        injector.name: injector
        for injector in (
            _OVER_RATE,
            _injector("law_angle", OverAngle, "rad", "Nm"),
            _injector("law_angle_direction", CoulombOverAngle, "rad", "Nm"),
            _injector("law_angle_rate", ViscousOverAngle, "rad", "Nm s/rad"),
            _injector("law_time_direction", CoulombOverTime, "s", "Nm"),
        )
    }
)
"""Every law that the emulated vehicle can have, by its name: an inertia that changes with the angle is none of them."""
