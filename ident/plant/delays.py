"""Delays as rational functions: Padé's approximation of order 2.

    exp(-s T) ≈ (1 - s T/2 + s² T²/12) / (1 + s T/2 + s² T²/12) = 1 - s T / D(s)

It passes every frequency at full size, and delays by T at low ones exactly; its error is (ω T)⁵/720. D(s) y = v has the
states y and z = τ ẏ,

    ẏ = z/τ,    ż = 12 (v - y - z/2)/τ,    τ = sqrt(T² + δ²)

where δ keeps it finite for T = 0; what is delayed then passes as it is. A torque u, v = u, acts as u - (T/τ) z; an
angle, v its rate, is reported as itself less T y, so that it starts at any angle as if it had always been there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import casadi as ca

from ident.plant.memories import Memories
from ident.plant.places import DRIVES, ENCODERS
from ident.plant.symbolic import Expression
from ident.plant.symbols import SIDES, Symbols
from ident.plant.terms import Term, delay_at
from ident.vehicle.geometry import WHEELS

_SHORTEST: Final = 1e-4
"""δ [s]."""


def late_torques(x: Symbols, terms: Sequence[Term], memories: Memories, torques: Expression) -> Expression:
    """Torques (4,) of the motors [Nm], from those that are reported."""
    late = ca.SX(torques)
    for wheel in memories.drives:
        delay = delay_at(terms, DRIVES[wheel])
        late[wheel] -= delay / _lag(delay) * x[f"slope_torque_{WHEELS[wheel]}"]
    return late


def late_angles(x: Symbols, terms: Sequence[Term], memories: Memories, angles: Expression) -> Expression:
    """Steering angles (2,) as late as they are reported [rad], from the present ones."""
    late = ca.SX(angles)
    for side in memories.encoders:
        late[side] -= delay_at(terms, ENCODERS[side]) * x[f"filtered_alpha_{SIDES[side]}"]
    return late


def filter_rates(
    x: Symbols, terms: Sequence[Term], memories: Memories, torques: Expression, steering_rates: Expression
) -> tuple[Expression, Expression]:
    """Derivatives of z, then of y, each of the drives, then of the encoders.

    Args:
        x: states.
        terms: with the dead times.
        memories: which parts are late.
        torques: (4,) reported [Nm].
        steering_rates: (2,) [rad/s].
    """
    drives = [(f"torque_{WHEELS[wheel]}", DRIVES[wheel], torques[wheel]) for wheel in memories.drives]
    encoders = [(f"alpha_{SIDES[side]}", ENCODERS[side], steering_rates[side]) for side in memories.encoders]
    slopes, values = [], []
    for name, place, entering in (*drives, *encoders):
        lag = _lag(delay_at(terms, place))
        slope = x[f"slope_{name}"]
        slopes.append(12 * (entering - x[f"filtered_{name}"] - slope / 2) / lag)
        values.append(slope / lag)
    return ca.vertcat(*slopes), ca.vertcat(*values)


def _lag(delay: Expression) -> Expression:
    return ca.sqrt(delay**2 + _SHORTEST**2)
