"""Mechanical stops of the steering: stiff, damped, one-sided, and smooth.

    τ = k r(x) + d ẋ r'(x),    r(x) = (x + sqrt(x² + w²)) / 2,    x = |α| - limit

Within the stroke r(x) is about w²/(4 |x|): a milliradian before the stop 0.003 Nm, nothing beside any friction.
"""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.plant.symbolic import Expression
from ident.plant.symbols import Symbols

_STIFFNESS: Final = 1e5
"""k [Nm/rad]: four times the rated torque of two motors presses a side some milliradians into its stop."""

_DAMPING: Final = 300.0
"""d [Nm s/rad]: about critical for a steering inertia of 0.3 to 1 kg m²."""

_ROUNDING: Final = 1e-5
"""w [rad]."""


def stop_torques(alpha: Expression, rates: Expression, p: Symbols) -> Expression:
    """What the stops add to the resistance (9,) of the vehicle; from α (2,) and q̇ (9,)."""
    sides = []
    for side in range(2):
        torque = ca.SX(0)
        for sign in (+1, -1):
            beyond = sign * alpha[side] - p["steering_limit"]
            distance = ca.sqrt(beyond**2 + _ROUNDING**2)
            touching = (1 + beyond / distance) / 2
            torque += sign * _STIFFNESS * (beyond + distance) / 2 + _DAMPING * rates[3 + side] * touching
        sides.append(torque)
    return ca.vertcat(ca.SX.zeros(3), *sides, ca.SX.zeros(4))
