"""Cascaded position-velocity loops: gains designed from the model with python-control, margins beside them.

Plant of a loop: 1/(J s + D), behind the current loop and a dead time of two cycles (half a cycle of velocity
differencing, one of latching at the next SYNC, half of holding). Velocity: PI. Position: P around it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import control
import numpy as np
from scipy import optimize

from ident.campaign.axis import Axis

VELOCITY_MARGIN = math.radians(65)
"""Phase margin that the velocity loop is designed for."""

POSITION_RATIO = 5.0
"""Crossover of the velocity loop over that of the position loop."""

RESET_RATIO = 5.0
"""Crossover of the velocity loop over the corner of its integrator."""

DEAD_CYCLES = 2.0
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


def design_loop(axis: Axis, cycle: float) -> LoopDesign:
    """Gains of the cascade for an axis sampled every `cycle` seconds."""
    plant = _plant(axis, cycle)

    def lack_of_phase(logarithm: float) -> float:
        crossover = math.exp(logarithm)
        controller = _velocity_controller(plant, crossover)
        return float(np.angle(-(controller * plant)(1j * crossover))) - VELOCITY_MARGIN

    crossover = math.exp(optimize.brentq(lack_of_phase, math.log(1.0), math.log(0.5 / cycle)))
    controller = _velocity_controller(plant, crossover)
    velocity_loop = controller * plant
    position_gain = crossover / POSITION_RATIO
    position_loop = position_gain * control.feedback(velocity_loop, 1) * control.tf([1], [1, 0])
    velocity, position = control.margin(velocity_loop), control.margin(position_loop)
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
    )


def _plant(axis: Axis, cycle: float) -> control.TransferFunction:
    delay = control.tf(*control.pade(DEAD_CYCLES * cycle, 3))
    current_loop = control.tf([1], [1 / CURRENT_LOOP, 1])
    return delay * current_loop * control.tf([1], [axis.inertia, axis.viscous])


def _velocity_controller(plant: control.TransferFunction, crossover: float) -> control.TransferFunction:
    """PI with its corner at crossover / RESET_RATIO, scaled to cross over where asked."""
    shape = control.tf([1, crossover / RESET_RATIO], [1, 0])
    gain = 1 / abs((shape * plant)(1j * crossover))
    return gain * shape
