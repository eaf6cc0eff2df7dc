"""Effects that the library of causes does not have, to which a diagnosis has to answer `unknown`."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from emulator.effects.laws import JointAxis, Law, Moment, joint_axes

_ROLLING: Final = 4


class UnlibrariedName(enum.StrEnum):
    """Names of the effects without a candidate."""

    FIELD_WEAKENING = "field_weakening"
    FLOOR_WAVES = "floor_waves"
    HOSE_SPRING = "hose_spring"
    GEAR_LOSS = "gear_loss"
    PRESLIDING = "presliding"


@dataclass(frozen=True)
class Unlibraried:
    """An effect without a candidate.

    Attributes:
        name: which.
        where: a place of UNLIBRARIED.
        size: in the unit of UNLIBRARIED.
    """

    name: UnlibrariedName
    where: str
    size: float

    def __str__(self) -> str:
        return f"{self.name}@{self.where}"

    def laws(self, step: float) -> tuple[Law, ...]:
        """Its physics, for an engine step [s]."""
        return UNLIBRARIED[self.name].make(self, step)


@dataclass(frozen=True)
class FieldWeakening:
    """A torque constant that falls with speed: coefficient times rate squared of the torque is missing [s^2/rad^2]."""

    wheels: tuple[int, ...]
    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Take off what is missing."""
        for wheel in self.wheels:
            rate = moment.rates[_ROLLING + wheel]
            moment.torques[_ROLLING + wheel] -= self.coefficient * rate**2 * moment.drive_torques[wheel]


@dataclass(frozen=True)
class FloorWaves:
    """A floor that goes up and down along x of the world: a force amplitude sin(2 pi x / length) [N, m]."""

    amplitude: float
    length: float = 0.45

    def __call__(self, moment: Moment) -> None:
        """Push the chassis down the wave."""
        (x, _, _), (_, _, qz, qw) = moment.engine.base_pose()
        heading = 2 * math.atan2(qz, qw)
        force = self.amplitude * math.sin(math.tau * x / self.length)
        moment.engine.push((force * math.cos(heading), -force * math.sin(heading), 0.0))


@dataclass(frozen=True)
class HoseSpring:
    """Hoses and cables to a steering unit that pull it to straight ahead [Nm/rad]."""

    axis: JointAxis
    stiffness: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        angle = moment.angles[self.axis.joint]
        moment.torques[self.axis.joint] -= self.axis.share * self.stiffness * angle


@dataclass(frozen=True)
class GearLoss:
    """Dry friction of a gear that grows with the torque it transmits: coefficient times its size [-]."""

    wheels: tuple[int, ...]
    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Raise the friction."""
        for wheel in self.wheels:
            moment.coulomb[_ROLLING + wheel] += self.coefficient * abs(moment.drive_torques[wheel])


@dataclass
class Presliding:
    """Friction with a long memory: after a reversal it builds up over an angle (Dahl 1968) [Nm, rad].

    Attributes:
        joint: of the engine.
        torque: when it is built up.
        step: of the engine [s].
        angle: over which it builds up to 1 - 1/e.
    """

    joint: int
    torque: float
    step: float
    angle: float = 0.4
    _built: float = field(default=0.0, init=False)

    def __call__(self, moment: Moment) -> None:
        """Move on along the hysteresis, and add the torque."""
        turned = moment.rates[self.joint] * self.step
        self._built += (turned - abs(turned) * self._built) / self.angle
        moment.torques[self.joint] -= self.torque * self._built


@dataclass(frozen=True)
class UnlibrariedSpec:
    """Where it can be, the unit of its size, and what makes its laws."""

    places: tuple[str, ...]
    unit: str
    make: Callable[[Unlibraried, float], tuple[Law, ...]]


def _wheels(effect: Unlibraried) -> tuple[int, ...]:
    return tuple(axis.joint - _ROLLING for axis in joint_axes(effect.where))


UNLIBRARIED: Final[Mapping[UnlibrariedName, UnlibrariedSpec]] = MappingProxyType(
    {
        UnlibrariedName.FIELD_WEAKENING: UnlibrariedSpec(
            ("wheels",), "s^2/rad^2", lambda effect, _: (FieldWeakening(_wheels(effect), effect.size),)
        ),
        UnlibrariedName.FLOOR_WAVES: UnlibrariedSpec(("chassis",), "N", lambda effect, _: (FloorWaves(effect.size),)),
        UnlibrariedName.HOSE_SPRING: UnlibrariedSpec(
            ("steering_left", "steering_right"),
            "Nm/rad",
            lambda effect, _: tuple(HoseSpring(axis, effect.size) for axis in joint_axes(effect.where)),
        ),
        UnlibrariedName.GEAR_LOSS: UnlibrariedSpec(
            ("wheels",), "1", lambda effect, _: (GearLoss(_wheels(effect), effect.size),)
        ),
        UnlibrariedName.PRESLIDING: UnlibrariedSpec(
            ("wheels",),
            "Nm",
            lambda effect, step: tuple(Presliding(axis.joint, effect.size, step) for axis in joint_axes(effect.where)),
        ),
    }
)
"""Every effect without a candidate."""
