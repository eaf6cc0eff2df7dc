"""Coulomb friction with a memory, so that a joint under less than its friction comes to rest.

    friction            d_c tanh(ξ),   ξ = q̇/ε + σ
    memory              T σ̇ = g s q̇/ε - 5 (1 - g) σ
    lagged load         (T/4) η̇ = ξ' - η,   ξ' = ξ / (1 + (ξ/4)⁴)^(1/4)
    below creep         g = 1 / (1 + (q̇/(2.5 ε))⁴)
    steady              s = 1 / (1 + ((ξ' - η)/0.07)⁴)

With tanh(q̇/ε) alone, equation (16), a joint creeps for ever under any torque. σ, a state of each joint, is the way that
it has crept, in units of ε T: friction grows with it until the joint stands, about ε T artanh(τ/d_c) from where it was.
It grows only while the load is steady, which η, another state, tells: a joint that starts or turns back passes as (16)
has it. In motion σ fades within T/5 and friction is that of (16). There are no events, so Model Exchange and
Co-Simulation agree and derivatives are exact. docs/adr/0008 has the choice of the numbers.
"""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.plant.symbolic import Expression
from ident.plant.symbols import Symbols

STICK_TIME: Final = 0.06
"""T where nobody sets one: how long motion below stiction goes on before it is held [s]; chosen in docs/adr/0008."""

_CREEP: Final = 2.5
"""Rate over ε below which a joint creeps: tanh 2.5 = 0.987. At 3 slow turns of a motion are taken for creep."""

_FADING: Final = 5.0
"""How many times faster σ fades in motion than it grows in creep. Much above 5 a joint close to its limit slides on."""

_LARGEST_LOAD: Final = 4.0
"""Bound of ξ for the lag, so that a joint that comes to rest is not waited for."""

_LAG: Final = 0.25
"""Time constant of the lagged load, over T."""

_STEADY: Final = 0.07
"""Distance of the load from its lagged value up to which it counts as steady."""


def held_rates(x: Symbols, p: Symbols, rates: Expression) -> Expression:
    """q̇ + ε σ (9,), the rates that Coulomb friction sees; the chassis has none."""
    return rates + p["epsilon"] * ca.vertcat(ca.SX.zeros(3), _of_joints(x, "stick"))


def memory_rates(x: Symbols, p: Symbols, rates: Expression) -> Expression:
    """σ̇, then η̇ (12,) [1/s], each of the steering left and right, then the wheels; from q̇ (9,)."""
    memory, lagged = _of_joints(x, "stick"), _of_joints(x, "lag")
    relative = rates[3:] / p["epsilon"]
    load = relative + memory
    bounded = load / ca.sqrt(ca.sqrt(1 + (load / _LARGEST_LOAD) ** 4))
    creeping = 1 / (1 + (relative / _CREEP) ** 4)
    steady = 1 / (1 + ((bounded - lagged) / _STEADY) ** 4)
    growth = creeping * steady * relative - _FADING * (1 - creeping) * memory
    return ca.vertcat(growth, (bounded - lagged) / _LAG) / p["stick_time"]


def _of_joints(x: Symbols, name: str) -> Expression:
    return ca.vertcat(x.sides(f"{name}_alpha_{{}}"), x.wheels(f"{name}_beta_{{}}"))
