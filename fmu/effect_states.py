"""Rows of the table for effects that have states of their own: delays, filters, bristles, springs and play.

They are in the table only where the effect is: a vehicle without them has the model that it would have anyway.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ident.plant.bristles import state_name
from ident.plant.memories import Memories
from ident.plant.symbols import SIDES
from ident.vehicle.geometry import WHEELS


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


def coupled_states(memories: Memories) -> list[AddedState]:
    """One of the two states of each, which the equations couple to the rates."""
    return [coupled for coupled, _ in _pairs(memories)]


def other_states(memories: Memories) -> list[AddedState]:
    """The other of the two states of each, those that are alone, then the time since the start of the campaign."""
    elapsed = [AddedState("elapsed", "Time since the start of the campaign", "s", 100.0)] if memories.elapsed else []
    return [*(other for _, other in _pairs(memories)), *_following(memories), *_bent(memories), *elapsed]


def _following(memories: Memories) -> Iterator[AddedState]:
    for wheel in (WHEELS[index] for index in memories.lags):
        yield AddedState(f"following_torque_{wheel}", f"Torque of motor {wheel} behind its filter", "Nm", 1.0)


def _bent(memories: Memories) -> Iterator[AddedState]:
    for joint in memories.bristles:
        text = f"How far the bristles of presliding@{joint[0]} are bent, over how far they bend before they slide"
        yield AddedState(state_name(joint), text, "1", 1.0)


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
