"""Cascaded position-velocity loops: gains designed from the model by frequency response, margins beside them.

Plant of a loop: 1/(J s + D), behind the current loop and a dead time (differencing the position, latching at the
next SYNC, holding). Velocity: PI. Position: P around it.

The velocity loop must also hold when the wheels lose their grip: what is left of J is then a fraction of it, and
a loop tuned for the vehicle alone would shake the wheels at full torque. The slower of both designs is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from ident.campaign.axis import Axis

Complex = NDArray[np.complex128]

Response = Callable[[Complex], Complex]
"""Transfer function: values at s = jω [1/s]."""

VELOCITY_MARGIN = math.radians(55)
"""Phase margin that the velocity loop is designed for."""

SLIPPING_MARGIN = math.radians(30)
"""Phase margin that the velocity loop keeps when the wheels lose their grip."""

POSITION_RATIO = 3.5
"""Crossover of the velocity loop over that of the position loop."""

RESET_RATIO = 4.0
"""Crossover of the velocity loop over the corner of its integrator."""

HOLD_CYCLES = 2.0
"""Dead time of latching a torque at the next SYNC, moving to it over a cycle (the drives interpolate), holding it."""

STEERING_RATE_CYCLES = 3
"""Cycles over which a steering rate is taken: at 17 bit one cycle resolves only 0.024 rad/s."""

_SLOWEST: Final = 1e-4
"""Lowest frequency at which margins are looked for, times the dead time [rad]."""

_GRID: Final = 2000
"""Frequencies at which a loop is looked at before its margins are refined."""

CURRENT_LOOP = 2 * math.pi * 300
"""Corner of the current loop assumed in the design [rad/s]; servo drives are faster."""


@dataclass(frozen=True)
class LoopDesign:
    """Gains of a cascade and what they promise.

    Attributes:
        position_gain: velocity per position error [1/s].
        velocity_gain: generalized torque per velocity error.
        integral_gain: generalized torque per integrated velocity error.
        velocity_crossover, position_crossover: [rad/s].
        velocity_phase_margin, position_phase_margin: [deg].
        velocity_gain_margin, position_gain_margin: [-].
        slipping_phase_margin: of the velocity loop when the wheels lose their grip [deg].
    """

    position_gain: float
    velocity_gain: float
    integral_gain: float
    velocity_crossover: float
    velocity_phase_margin: float
    velocity_gain_margin: float
    position_crossover: float
    position_phase_margin: float
    position_gain_margin: float
    slipping_phase_margin: float


def design_loop(axis: Axis, cycle: float, rate_cycles: int = 1) -> LoopDesign:
    """Gains of the cascade for an axis sampled every `cycle` seconds, its rate taken over `rate_cycles` cycles."""
    dead_time = (HOLD_CYCLES + rate_cycles / 2) * cycle
    plant = partial(_plant, inertia=axis.inertia, viscous=axis.viscous, dead_time=dead_time)
    slipping = partial(_plant, inertia=axis.slipping_inertia, viscous=axis.viscous, dead_time=dead_time)
    crossover = min(
        _crossover(plant, VELOCITY_MARGIN, cycle),
        _crossover(slipping, SLIPPING_MARGIN, cycle) * axis.slipping_inertia / axis.inertia,
    )
    velocity_gain, corner = _velocity_gain(plant, crossover), crossover / RESET_RATIO
    position_gain = crossover / POSITION_RATIO

    def velocity_loop(s: Complex) -> Complex:
        return velocity_gain * _shape(s, corner) * plant(s)

    def position_loop(s: Complex) -> Complex:
        inner = velocity_loop(s)
        return position_gain / s * inner / (1 + inner)

    velocity, position = (margins(loop, dead_time) for loop in (velocity_loop, position_loop))
    return LoopDesign(
        position_gain=position_gain,
        velocity_gain=velocity_gain,
        integral_gain=velocity_gain * corner,
        velocity_crossover=crossover,
        velocity_phase_margin=velocity.phase,
        velocity_gain_margin=velocity.gain,
        position_crossover=position.crossover,
        position_phase_margin=position.phase,
        position_gain_margin=position.gain,
        slipping_phase_margin=margins(lambda s: velocity_gain * _shape(s, corner) * slipping(s), dead_time).phase,
    )


@dataclass(frozen=True)
class Margins:
    """What keeps a loop stable.

    Attributes:
        crossover: where its gain falls below one [rad/s].
        phase: margin there [deg].
        gain: margin where its phase falls below -180° for the first time beyond the crossover [-].
    """

    crossover: float
    phase: float
    gain: float


def margins(loop: Response, dead_time: float) -> Margins:
    """Margins of an open loop that integrates and has a dead time [s], which bounds where they can be."""
    grid = np.geomspace(_SLOWEST, 2 * math.pi, _GRID) / dead_time
    values = loop(np.asarray(1j * grid, dtype=np.complex128))
    passes = int(np.argmax(np.abs(values) < 1))
    crossover = _root(lambda omega: math.log(abs(loop(_at(omega))[()])), grid, passes)
    turns = passes + int(np.argmax(np.angle(-values[passes:]) < 0))
    turn = _root(lambda omega: float(np.angle(-loop(_at(omega)))), grid, turns)
    return Margins(
        crossover=crossover,
        phase=math.degrees(float(np.angle(-loop(_at(crossover))))),
        gain=1 / float(abs(loop(_at(turn))[()])),
    )


def _at(omega: float) -> Complex:
    return np.asarray(1j * omega)


def _root(function: Callable[[float], float], grid: NDArray[np.float64], index: int) -> float:
    """Where a function that changes its sign before a point of the grid does so."""
    return float(optimize.brentq(function, grid[index - 1], grid[index]))


def _crossover(plant: Response, margin: float, cycle: float) -> float:
    """Crossover [rad/s] at which the velocity loop has the phase margin `margin` [rad]."""

    def lack_of_phase(logarithm: float) -> float:
        crossover = math.exp(logarithm)
        s = _at(crossover)
        return float(np.angle(-_shape(s, crossover / RESET_RATIO) * plant(s))) - margin

    return math.exp(optimize.brentq(lack_of_phase, math.log(1.0), math.log(0.5 / cycle)))


def _plant(s: Complex, *, inertia: float, viscous: float, dead_time: float) -> Complex:
    """1/(J s + D) behind the current loop and the dead time."""
    return np.asarray(np.exp(-s * dead_time) / (1 + s / CURRENT_LOOP) / (inertia * s + viscous))


def _shape(s: Complex, corner: float) -> Complex:
    """PI controller of gain one with its corner [rad/s]."""
    return 1 + corner / s


def _velocity_gain(plant: Response, crossover: float) -> float:
    """Gain of the PI controller, its corner at crossover / RESET_RATIO, that crosses over where asked."""
    s = _at(crossover)
    return 1 / float(abs((_shape(s, crossover / RESET_RATIO) * plant(s))[()]))
