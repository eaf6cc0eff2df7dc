"""What a drawn machine may lack, by the names of the diagnosis, and how much of it is how large."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from hil.exam.cases import Injected
from hil.exam.smooth import draw_length, smooth_values
from hil.exam.sources.machine import Machine

Array = NDArray[np.float64]
Law = Callable[[float, float, float], float]
"""Time [s], position [m], velocity [m/s] -> force that resists [N]."""

PLACE: Final = "axis"

KNOTS: Final = 25
"""Values between which a drawn function is interpolated."""

EDGE: Final = 1e-3
"""Velocity over which a force turns with the direction [m/s]."""


@dataclass(frozen=True)
class Missing:
    """One thing that a machine may have and its model lacks.

    Attributes:
        parameter: that says how large it is, where the diagnosis states the same number; empty where not.
        probe: a size that machines have; of what is `as_met` the least.
        shape: draws its other numbers.
        added: machine, size and other numbers -> the machine that has it.
        signed: may be negative.
        as_met: its size is drawn from what is met in practice, up to this many times the probe, and shows as more than
            one noise unit: less of it is what sampling does, or rings faster than the machine is integrated.
    """

    parameter: str
    probe: Callable[[Machine], float]
    shape: Callable[[Machine, np.random.Generator], dict[str, float]]
    added: Callable[[Machine, float, Mapping[str, float]], Machine]
    signed: bool = True
    as_met: float = 0.0


def machine_with(machine: Machine, effects: tuple[Injected, ...]) -> Machine:
    """A machine with everything that a case injects."""
    for effect in effects:
        machine = MISSING[effect.name].added(machine, effect.size, effect.values)
    return machine


def _nothing(_machine: Machine, _generator: np.random.Generator) -> dict[str, float]:
    return {}


def _forced(machine: Machine, law: Law) -> Machine:
    before = machine.law
    if before is None:
        return replace(machine, law=law)
    return replace(machine, law=lambda time, x, v: before(time, x, v) + law(time, x, v))


def _asymmetry(machine: Machine, size: float, _values: Mapping[str, float]) -> Machine:
    return replace(machine, asymmetry=machine.asymmetry + size)


def _drag(machine: Machine, size: float, _values: Mapping[str, float]) -> Machine:
    return _forced(machine, lambda _time, _x, v: size * v * abs(v))


def _stribeck(machine: Machine, size: float, values: Mapping[str, float]) -> Machine:
    """Without bristles: those that bend leave a gap of their own, however little friction rises."""
    velocity = values["velocity"]
    return _forced(machine, lambda _time, _x, v: size * math.exp(-((v / velocity) ** 2)) * math.tanh(v / EDGE))


def _delay(machine: Machine, size: float, _values: Mapping[str, float]) -> Machine:
    """Of the motion behind the effort as recorded: that the effort is held and the position read is part of it."""
    read = int(machine.read * machine.substeps) / machine.substeps
    return replace(machine, delay=size - (0.5 - read) / machine.rate)


def _ripple(machine: Machine, size: float, values: Mapping[str, float]) -> Machine:
    order, phase = 2 * math.pi * values["order"], values["phase"]
    return _forced(machine, lambda _time, x, _v: size * math.sin(order * x + phase))


def _spring(machine: Machine, size: float, _values: Mapping[str, float]) -> Machine:
    return replace(machine, compliance=size / machine.share**2)


def _law(
    partner: Callable[[float], float], over_speed: bool
) -> Callable[[Machine, float, Mapping[str, float]], Machine]:
    def added(machine: Machine, size: float, values: Mapping[str, float]) -> Machine:
        function = _function(values)
        return _forced(machine, lambda _t, x, v: size * function(v if over_speed else x) * partner(v))

    return added


def _function(values: Mapping[str, float]) -> Callable[[float], float]:
    """Cubic between its values, the last of them beyond."""
    heights = np.array([values[name] for name in sorted(values) if name.startswith("y")])
    low, high = values["low"], values["high"]
    spline = CubicSpline(np.linspace(low, high, len(heights)), heights)
    fine = np.linspace(low, high, 40 * len(heights))
    table, step = spline(fine).tolist(), fine[1] - fine[0]
    last = len(table) - 1

    def function(x: float) -> float:
        place = min(max((x - low) / step, 0.0), last - 1e-9)
        index = int(place)
        return float(table[index] + (place - index) * (table[index + 1] - table[index]))

    return function


def _smooth(low: float, high: float, generator: np.random.Generator) -> dict[str, float]:
    """Values of a Gaussian process over a range."""
    length = draw_length(generator)
    distance = np.subtract.outer(np.linspace(0, 1, KNOTS), np.linspace(0, 1, KNOTS))
    heights = smooth_values(distance, length, generator)
    return {"low": low, "high": high} | {f"y{index:02d}": round(float(y), 5) for index, y in enumerate(heights)}


def _over_position(machine: Machine, generator: np.random.Generator) -> dict[str, float]:
    """Over all of its travel, and some more: the diagnosis does not know its ends."""
    before, behind = generator.uniform(0.0, 0.5, size=2) * machine.travel
    return _smooth(-float(before), machine.travel + float(behind), generator)


def _over_speed(machine: Machine, generator: np.random.Generator) -> dict[str, float]:
    fastest = 1.2 * machine.speeds[-1]
    return _smooth(-fastest, fastest, generator)


def _rippling(machine: Machine, generator: np.random.Generator) -> dict[str, float]:
    order = float(generator.uniform(3.0, 12.0)) / machine.travel
    return {"order": order, "phase": float(generator.uniform(0, 2 * math.pi))}


def _rising(machine: Machine, generator: np.random.Generator) -> dict[str, float]:
    return {"velocity": float(generator.uniform(0.15, 0.5)) * machine.speeds[-1]}


def _force(machine: Machine) -> float:
    return 0.2 * machine.coulomb


MISSING: Final[Mapping[str, Missing]] = MappingProxyType(
    {
        "asymmetric_viscous": Missing(
            "imbalance", lambda machine: _force(machine) / machine.speeds[-1], _nothing, _asymmetry
        ),
        "quadratic_drag": Missing(
            "coefficient", lambda machine: _force(machine) / machine.speeds[-1] ** 2, _nothing, _drag, signed=False
        ),
        "stribeck": Missing("amplitude", _force, _rising, _stribeck, signed=False),
        "time_delay": Missing(
            "delay", lambda machine: min(1.5 / machine.rate, 4e-3), _nothing, _delay, signed=False, as_met=1.5
        ),
        "torque_ripple": Missing("amplitude", _force, _rippling, _ripple, signed=False),
        "elasticity": Missing(
            "compliance",
            lambda machine: machine.share**2 / (machine.mass * (2 * math.pi * 40) ** 2),
            _nothing,
            _spring,
            signed=False,
            as_met=7.0,
        ),
        "law_rate": Missing("", _force, _over_speed, _law(lambda _v: 1.0, over_speed=True)),
        "law_angle": Missing("", _force, _over_position, _law(lambda _v: 1.0, over_speed=False)),
        "law_angle_direction": Missing(
            "", _force, _over_position, _law(lambda v: math.tanh(v / EDGE), over_speed=False)
        ),
    }
)
"""By name; laws without one last."""

LAWS: Final = tuple(name for name in MISSING if name.startswith("law"))
NAMED: Final = tuple(name for name in MISSING if name not in LAWS)
