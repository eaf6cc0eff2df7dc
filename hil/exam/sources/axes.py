"""Servo axes drawn at random: one record each, without repeats, of a machine that lacks nothing, or one thing."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from hil.exam.sources.machine import Machine
from ident.records.axis_record import AxisRecord

Generator = np.random.Generator


class Lacking(enum.StrEnum):
    """What the model of an axis may lack."""

    NOTHING = "nothing"
    ASYMMETRY = "friction of one direction"
    DRAG = "drag"
    BRISTLES = "bristles that break away"
    DELAY = "delay"
    SPRING = "force over the position"
    RIPPLE = "ripple"
    FRICTION = "friction over the position"
    SECOND_MASS = "second mass"


@dataclass(frozen=True)
class DrawnAxis:
    """A machine, what the model of it lacks, and how large that is.

    Attributes:
        machine: with its excitation and its noise.
        lacking: which cause.
        size: of it over the Coulomb friction, at the largest speed; of delays and springs, in their own unit.
    """

    machine: Machine
    lacking: Lacking
    size: float

    def record(self, seed: int) -> AxisRecord:
        """One record of it, without repeats."""
        return self.machine.drive(seed)


def draw_axis(seed: int, lacking: Lacking | None = None) -> DrawnAxis:
    """A machine from a seed.

    Args:
        seed: of everything.
        lacking: the cause; None: drawn too.
    """
    generator = np.random.default_rng([seed, 0])
    causes = list(Lacking)
    cause = lacking or causes[int(generator.integers(len(causes)))]
    machine = draw_machine(generator)
    return _DRAWN[cause](machine, generator)


def draw_machine(generator: Generator) -> Machine:
    """One that the model describes: mass, friction, gains, rates and noise of usual carriages."""
    rate = float(generator.choice([250.0, 500.0, 1000.0, 2000.0]))
    mass, speed = float(generator.uniform(5, 50)), float(np.exp(generator.uniform(math.log(0.1), math.log(0.5))))
    coulomb = float(generator.uniform(0.2, 1.0)) * mass
    strokes = 2 * int(generator.integers(4, 13))
    return Machine(
        mass=mass,
        viscous=float(generator.uniform(0.3, 2.0)) * coulomb / speed,
        coulomb=coulomb,
        offset=float(generator.uniform(-0.3, 0.3)) * coulomb,
        read=float(generator.uniform(0, 1)),
        noise=float(np.exp(generator.uniform(math.log(0.005), math.log(0.05)))) * coulomb,
        encoder=float(np.exp(generator.uniform(math.log(1e-7), math.log(3e-6)))),
        rate=rate,
        substeps=round(4000 / rate),
        duration=float(generator.uniform(0.4, 1.5)) * strokes,
        repeats=1,
        strokes=strokes,
        speeds=tuple(speed * share for share in (0.2, 0.4, 0.6, 0.8, 1.0)),
    )


def _size(generator: Generator) -> float:
    """Of a cause over the Coulomb friction."""
    return float(np.exp(generator.uniform(math.log(0.05), math.log(0.4))))


def _forced(machine: Machine, law: Callable[[float, float, float], float], lacking: Lacking, size: float) -> DrawnAxis:
    return DrawnAxis(replace(machine, law=law), lacking, size)


def _nothing(machine: Machine, _generator: Generator) -> DrawnAxis:
    return DrawnAxis(machine, Lacking.NOTHING, 0.0)


def _asymmetry(machine: Machine, generator: Generator) -> DrawnAxis:
    size = _size(generator)
    change = size * machine.coulomb / machine.speeds[-1] * float(generator.choice([-1, 1]))
    return DrawnAxis(replace(machine, asymmetry=change), Lacking.ASYMMETRY, size)


def _drag(machine: Machine, generator: Generator) -> DrawnAxis:
    size = 2 * _size(generator)
    coefficient = size * machine.coulomb / machine.speeds[-1] ** 2
    return _forced(machine, lambda _t, _x, v: coefficient * v * abs(v), Lacking.DRAG, size)


def _bristles(machine: Machine, generator: Generator) -> DrawnAxis:
    size, speed = 2 * _size(generator), float(generator.uniform(0.15, 0.5)) * machine.speeds[-1]
    bristle = replace(machine, bristle=5e3 * machine.mass, breakaway=size * machine.coulomb, stribeck=speed)
    return DrawnAxis(replace(bristle, substeps=2 * machine.substeps), Lacking.BRISTLES, size)


def _delay(machine: Machine, generator: Generator) -> DrawnAxis:
    # Longer ones would let the position controller ring.
    delay = min(float(generator.uniform(1.5, 4.0)) / machine.rate, 6e-3)
    return DrawnAxis(replace(machine, delay=delay), Lacking.DELAY, delay)


def reach_of(machine: Machine) -> float:
    """How far a stroke goes [m]."""
    return machine.speeds[-1] * machine.duration / machine.strokes


def _spring(machine: Machine, generator: Generator) -> DrawnAxis:
    size, phase = 2 * _size(generator), float(generator.uniform(0, 2 * math.pi))
    order = float(generator.uniform(0.5, 2.0)) * math.pi / reach_of(machine)
    force = size * machine.coulomb
    return _forced(machine, lambda _t, x, _v: force * math.sin(order * x + phase), Lacking.SPRING, size)


def _ripple(machine: Machine, generator: Generator) -> DrawnAxis:
    size, phase = _size(generator), float(generator.uniform(0, 2 * math.pi))
    order = 2 * math.pi * float(generator.uniform(3.0, 12.0)) / reach_of(machine)
    force = size * machine.coulomb
    return _forced(machine, lambda _t, x, _v: force * math.sin(order * x + phase), Lacking.RIPPLE, size)


def _friction(machine: Machine, generator: Generator) -> DrawnAxis:
    size, phase = 2 * _size(generator), float(generator.uniform(0, 2 * math.pi))
    order = float(generator.uniform(0.5, 2.0)) * math.pi / reach_of(machine)
    force = size * machine.coulomb
    return _forced(
        machine,
        lambda _t, x, v: force * math.sin(order * x + phase) * math.tanh(v / 1e-3),
        Lacking.FRICTION,
        size,
    )


def _second_mass(machine: Machine, generator: Generator) -> DrawnAxis:
    resonance = 2 * math.pi * float(generator.uniform(15.0, 40.0))
    return DrawnAxis(
        replace(machine, compliance=1 / (machine.mass * resonance**2)), Lacking.SECOND_MASS, resonance / 2 / math.pi
    )


_DRAWN: Final[Mapping[Lacking, Callable[[Machine, Generator], DrawnAxis]]] = MappingProxyType(
    {
        Lacking.NOTHING: _nothing,
        Lacking.ASYMMETRY: _asymmetry,
        Lacking.DRAG: _drag,
        Lacking.BRISTLES: _bristles,
        Lacking.DELAY: _delay,
        Lacking.SPRING: _spring,
        Lacking.RIPPLE: _ripple,
        Lacking.FRICTION: _friction,
        Lacking.SECOND_MASS: _second_mass,
    }
)
