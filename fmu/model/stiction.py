"""Coulomb friction with a memory, so that a joint under less than its friction comes to rest.

    d_c tanh(q̇/ε + σ),    T σ̇ = w x - 5 (1 - w) σ,    x = q̇/ε,    w = 1 / (1 + (x/3)⁴)

With tanh(q̇/ε) alone, equation (16), a joint creeps for ever under any torque. σ, a state of each joint, is the way that
it has crept, in units of ε T: friction grows with it until the joint stands, ε T artanh(τ/d_c) from where it was.
In motion w is zero, σ fades within T/5, and friction is that of (16). No events: the same in Model Exchange and
Co-Simulation, and differentiable.
"""

from __future__ import annotations

from typing import Final

import casadi as ca

from fmu.model.symbols import Symbols
from ident.vehicle.symbolic import Expression

_HELD_BELOW: Final = 3.0
"""Rate over ε below which it counts as creep: tanh 3 = 0.995."""

_STEADY: Final = 0.3
"""How much the load may run ahead of its lagged value."""

_FADING: Final = 5.0
"""How many times faster σ fades in motion than it grows in creep. Above 5 a joint close to its limit may not stand."""


def held_rates(x: Symbols, p: Symbols, rates: Expression) -> Expression:
    """q̇ + ε σ (9,), the rates that Coulomb friction sees; the chassis has none."""
    return rates + p["epsilon"] * ca.vertcat(ca.SX.zeros(3), _memory(x))


def memory_rate(x: Symbols, p: Symbols, rates: Expression) -> Expression:
    """σ̇ and η̇ (12,) [1/s]: steering left and right, then the wheels; from q̇ (9,)."""
    relative = rates[3:] / p["epsilon"]
    load = relative + _memory(x)
    lag = load - _lagged(x)
    creeping = 1 / (1 + (relative / _HELD_BELOW) ** 4)
    steady = 1 / (1 + (lag / _STEADY) ** 4)
    growth = creeping * steady * relative - _FADING * (1 - creeping) * _memory(x)
    return ca.vertcat(growth, lag) / p["stick_time"]


def _memory(x: Symbols) -> Expression:
    return ca.vertcat(x.sides("stick_alpha_{}"), x.wheels("stick_beta_{}"))


def _lagged(x: Symbols) -> Expression:
    return ca.vertcat(x.sides("lag_alpha_{}"), x.wheels("lag_beta_{}"))
