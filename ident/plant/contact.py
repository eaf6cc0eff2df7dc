"""Wheel contacts that give a little, and hold where they stand: what turns constraints into forces.

    force       F_i = -c e_i / sqrt(1 + (c |e_i| / (μ_i N_i))²),   e_i = s_i + J_i z
    memory      T ż = g W⁻¹ Jᵀ s - 5 (1 - g) z,   W = diag(4, 4, l² + b²)
    at rest     g = 1 / (1 + (w/(3 ε r))⁴),   w² = ẋ² + ẏ² + (l b/4) γ̇² + Σ (r β̇_i)²

s_i (2,) is the velocity of contact i over the floor, c the creep stiffness, μ_i N_i the largest force. It is smooth,
opposes the slip in its direction, and for c → ∞ the wheels roll. Without memory a parked vehicle creeps for ever under
any slope, its wheels being held by their friction: slip then is a twist of the chassis, J_i times it at contact i, and
W⁻¹ Jᵀ s is that twist. z, three states, is the way that it has crept so, over T: it ends F T/c from where it was, F the
force on a contact. What z holds goes through the contacts, up to what they carry. Once the vehicle or a wheel moves z
fades within T/5.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.plant.symbolic import CORNERS, Expression, constraint_matrix
from ident.plant.symbols import Symbols
from ident.plant.terms import Term, centre_of_mass, loaded_mass
from ident.vehicle.quantities import GRAVITY


class Contacts(enum.StrEnum):
    """How little the contacts of a model give."""

    SOFT = "soft"
    STIFF = "stiff"


CREEP_STIFFNESS: Final[Mapping[Contacts, float]] = MappingProxyType({Contacts.SOFT: 1e5, Contacts.STIFF: 3e6})
"""c where nobody sets one [N s/m]; chosen in docs/adr/0046. Under 100 N a wheel on stiff contacts slips by 33 um/s."""

_RESTING: Final = 3.0
"""Speed of chassis and wheels over ε r below which the vehicle stands."""

_FADING: Final = 5.0
"""How many times faster z fades in motion than it grows at rest."""

_LEAST_LOAD: Final = 1e-3
"""Part of a quarter of the weight that a wheel keeps however far the centre of mass is off: no division by zero."""


def static_loads(p: Symbols, terms: Sequence[Term]) -> Expression:
    """Loads of the contacts (4,) [N] on a level floor at rest; the centre of mass shifts m_ch, no load."""
    load, centre = loaded_mass(terms), centre_of_mass(terms)
    ahead, left = centre[0], centre[1]
    shares = [1 + front * 2 * ahead / p["wheelbase"] + side * 2 * left / p["track_width"] for front, side in CORNERS]
    quarters = [ca.fmax(p["m_ch"] * share + load, _LEAST_LOAD * p["m_ch"]) for share in shares]
    return GRAVITY / 4 * ca.vertcat(*quarters)


def held_twist(x: Symbols) -> Expression:
    """z (3,) [m/s, m/s, rad/s]."""
    return x.stacked("held_x_dot", "held_y_dot", "held_gamma_dot")


def held_twist_rates(x: Symbols, p: Symbols, alpha: Expression, rates: Expression) -> Expression:
    """ż (3,) [m/s², m/s², rad/s²]; from α (2,) and q̇ (9,). Its slip is that of rigid couplings and equal wheels."""
    rolling = constraint_matrix(alpha)
    squares = ca.vertcat(4, 4, p["wheelbase"] ** 2 + p["track_width"] ** 2)
    creep = rolling[:, :3].T @ (rolling @ rates) / squares
    lever = p["wheelbase"] * p["track_width"] / 4
    chassis = rates[0] ** 2 + rates[1] ** 2 + lever * rates[2] ** 2
    speeds = chassis + p["wheel_radius"] ** 2 * ca.sumsqr(rates[5:9])
    resting = 1 / (1 + (speeds / (_RESTING * p["epsilon"] * p["wheel_radius"]) ** 2) ** 2)
    return (resting * creep - _FADING * (1 - resting) * held_twist(x)) / p["stick_time"]


def contact_forces(creeping: Expression, loads: Expression, p: Symbols) -> Expression:
    """Forces of the floor on the wheels (8,) [N], ordered as e (8,) [m/s]: across, then along."""
    across, along = creeping[:4], creeping[4:]
    creep = p["creep_stiffness"]
    limits = p.wheels("friction_limit_{}") * loads
    softening = ca.sqrt(1 + (creep / limits) ** 2 * (across**2 + along**2))
    return -creep * ca.vertcat(across / softening, along / softening)
