"""From the inputs to the torques that the drives report."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.plant.symbolic import Expression
from ident.plant.symbols import Symbols


class Inputs(enum.StrEnum):
    """What drives the wheels of a model."""

    TORQUE = "torque"
    SPEED = "speed"


DRIVE_TORQUE_LIMIT: Final = "drive_torque_limit"
"""Name of the parameter that limits the torque of the drives."""

DRIVE_GAIN: Final = 0.5
"""Proportional gain of the drives' speed loops before anyone tunes them, motor torque per wheel rate [Nm s/rad]."""

DRIVE_INTEGRAL_GAIN: Final = 2.0
"""Integral gain of the drives' speed loops before anyone tunes them [Nm/rad]."""

DRIVE_UNWIND_TIME: Final = 0.05
"""In which the integral of a speed loop follows a torque at its limit [s]."""

_ROUNDING: Final = 1e-4
"""Of the corner where unwinding begins, over the limit: below it a parked drive keeps its integral."""


def _torque_inputs(rates: Expression, x: Symbols, u: Symbols, p: Symbols) -> tuple[Expression, Expression]:
    """The torques as they are given, or up to the limit where the drives have one."""
    given = u.wheels("torque_{}")
    if DRIVE_TORQUE_LIMIT not in p:
        return given, ca.SX.zeros(0)
    limit = p[DRIVE_TORQUE_LIMIT]
    return ca.fmin(ca.fmax(given, -limit), limit), ca.SX.zeros(0)


def _speed_loops(rates: Expression, x: Symbols, u: Symbols, p: Symbols) -> tuple[Expression, Expression]:
    """Proportional and integral action with a smooth limit; beyond it the integral follows the torque.

    At half of the limit 1.5 % of the torque is missing.
    """
    error = u.wheels("speed_{}") - rates
    wanted = p["drive_gain"] * error + x.wheels("integral_{}")
    limit = p[DRIVE_TORQUE_LIMIT]
    torque = wanted / ca.sqrt(ca.sqrt(1 + (wanted / limit) ** 4))
    beyond = _beyond(wanted, limit) - _beyond(-wanted, limit)
    return torque, p["drive_integral_gain"] * error - beyond / p["drive_unwind_time"]


def _beyond(wanted: Expression, limit: Expression) -> Expression:
    """By how much a torque is above the limit, its corner rounded."""
    excess = wanted - limit
    return (excess + ca.sqrt(excess**2 + (_ROUNDING * limit) ** 2)) / 2


_Drive = Callable[[Expression, Symbols, Symbols, Symbols], tuple[Expression, Expression]]

DRIVES: Final[Mapping[Inputs, _Drive]] = MappingProxyType({Inputs.TORQUE: _torque_inputs, Inputs.SPEED: _speed_loops})
"""By the inputs: from rates (4,) of the motors at the wheels, states, inputs and parameters to torques (4,) [Nm] and
rates of the integral states [Nm/s]."""
