"""Cascaded position-velocity loops: gains designed from the model with python-control, margins beside them.

Plant of a loop: 1/(J s + D), behind the current loop and a dead time (differencing the position, latching at the
next SYNC, holding). Velocity: PI. Position: P around it.

The velocity loop must also hold when the wheels lose their grip: what is left of J is then a fraction of it, and
a loop tuned for the vehicle alone would shake the wheels at full torque. The slower of both designs is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize

from ident.campaign.axis import Axis

if TYPE_CHECKING:
    import control

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
    import control  # takes a second, and who only reads a run designs no loop

    dead_time = (HOLD_CYCLES + rate_cycles / 2) * cycle
    plant = _plant(axis.inertia, axis.viscous, dead_time)
    slipping = _plant(axis.slipping_inertia, axis.viscous, dead_time)
    crossover = min(
        _crossover(plant, VELOCITY_MARGIN, cycle),
        _crossover(slipping, SLIPPING_MARGIN, cycle) * axis.slipping_inertia / axis.inertia,
    )
    controller = _velocity_controller(plant, crossover)
    velocity_loop = controller * plant
    position_gain = crossover / POSITION_RATIO
    position_loop = position_gain * control.feedback(velocity_loop, 1) * control.tf([1], [1, 0])
    velocity, position = control.margin(velocity_loop), control.margin(position_loop)
    slip = control.margin(controller * slipping)
    velocity_gain = float(controller.num[0][0][0])
    return LoopDesign(
        position_gain=position_gain,
        velocity_gain=velocity_gain,
        integral_gain=velocity_gain * crossover / RESET_RATIO,
        velocity_crossover=crossover,
        velocity_phase_margin=float(velocity[1]),
        velocity_gain_margin=float(velocity[0]),
        position_crossover=float(position[3]),
        position_phase_margin=float(position[1]),
        position_gain_margin=float(position[0]),
        slipping_phase_margin=float(slip[1]),
    )


def _crossover(plant: control.TransferFunction, margin: float, cycle: float) -> float:
    """Crossover [rad/s] at which the velocity loop has the phase margin `margin` [rad]."""

    def lack_of_phase(logarithm: float) -> float:
        crossover = math.exp(logarithm)
        controller = _velocity_controller(plant, crossover)
        return float(np.angle(-(controller * plant)(1j * crossover))) - margin

    return math.exp(optimize.brentq(lack_of_phase, math.log(1.0), math.log(0.5 / cycle)))


def _plant(inertia: float, viscous: float, dead_time: float) -> control.TransferFunction:
    import control

    delay = control.tf(*control.pade(dead_time, 3))
    current_loop = control.tf([1], [1 / CURRENT_LOOP, 1])
    return delay * current_loop * control.tf([1], [inertia, viscous])


def _velocity_controller(plant: control.TransferFunction, crossover: float) -> control.TransferFunction:
    """PI with its corner at crossover / RESET_RATIO, scaled to cross over where asked."""
    import control

    shape = control.tf([1, crossover / RESET_RATIO], [1, 0])
    gain = 1 / abs((shape * plant)(1j * crossover))
    return gain * shape
