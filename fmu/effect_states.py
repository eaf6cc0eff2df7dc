"""Rows of the table for effects that have states of their own: delays, springs and play.

They are in the table only where the effect is: a vehicle without them has the model that it would have anyway.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from ident.vehicle.effects import DRIVES, ENCODERS, STEERING, Effect, EffectName
from ident.vehicle.geometry import WHEELS

SIDES: Final = ("l", "r")
"""Letters of the steering sides in the names of the table."""

_SPRINGS: Final = (EffectName.BACKLASH, EffectName.ELASTICITY)


@dataclass(frozen=True)
class Memories:
    """Which parts have effects with states of their own, in the order of the states.

    Attributes:
        couplings: steering sides (0 left, 1 right) whose rear unit hangs on the front one by a spring.
        gears: wheels (0 to 3) whose motor turns on its own.
        drives: wheels whose torque acts later.
        encoders: steering sides whose angle is reported later.
    """

    couplings: tuple[int, ...]
    gears: tuple[int, ...]
    drives: tuple[int, ...]
    encoders: tuple[int, ...]

    @property
    def flexible(self) -> bool:
        """Whether there is a spring."""
        return bool(self.couplings or self.gears)


@dataclass(frozen=True)
class AddedState:
    """A state of an effect.

    Attributes:
        name, text, unit, nominal: as in `fmu.variables.Variable`.
    """

    name: str
    text: str
    unit: str
    nominal: float


def memories_of(effects: Sequence[Effect]) -> Memories:
    """What of the effects has states."""

    def places(where: Sequence[str], *names: EffectName) -> tuple[int, ...]:
        found = {effect.where for effect in effects if effect.name in names}
        return tuple(index for index, place in enumerate(where) if place in found)

    return Memories(
        couplings=places(STEERING, *_SPRINGS),
        gears=places(DRIVES, *_SPRINGS),
        drives=places(DRIVES, EffectName.TIME_DELAY),
        encoders=places(ENCODERS, EffectName.TIME_DELAY),
    )


def coupled_states(memories: Memories) -> list[AddedState]:
    """One of the two states of each, which the equations couple to the rates."""
    return [coupled for coupled, _ in _pairs(memories)]


def other_states(memories: Memories) -> list[AddedState]:
    """The other of the two states of each."""
    return [other for _, other in _pairs(memories)]


def _pairs(memories: Memories) -> Iterator[tuple[AddedState, AddedState]]:
    for side in memories.couplings:
        yield _twist(f"coupling_{SIDES[side]}", "Twist of the rear steering unit against the front one, side")
    for wheel in memories.gears:
        yield _twist(f"gear_{WHEELS[wheel]}", "Angle of the motor, at the wheel, minus that of the wheel, drive")
    for wheel in memories.drives:
        yield _filter(f"torque_{WHEELS[wheel]}", "Nm", 1.0)
    for side in memories.encoders:
        yield _filter(f"alpha_{SIDES[side]}", "rad/s", 0.1)


def _twist(name: str, text: str) -> tuple[AddedState, AddedState]:
    part = name.rpartition("_")[2]
    rate = AddedState(f"{name}_twist_dot", f"Rate of {name}_twist", "rad/s", 0.1)
    return rate, AddedState(f"{name}_twist", f"{text} {part}", "rad", 1e-3)


def _filter(name: str, unit: str, nominal: float) -> tuple[AddedState, AddedState]:
    slope = AddedState(f"slope_{name}", f"Delay times the derivative of filtered_{name}", unit, nominal)
    return slope, AddedState(f"filtered_{name}", f"Filtered for the delay of {name}", unit, nominal)
