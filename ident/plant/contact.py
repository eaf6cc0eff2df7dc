"""Wheel contacts that give a little: what turns constraints into forces.

    F_i = -c s_i / sqrt(1 + (c |s_i| / (μ_i N_i))²)

s_i (2,) is the velocity of contact i over the floor, c the creep stiffness, μ_i N_i the largest force. It is smooth,
opposes the slip in its direction, and for c → ∞ the wheels roll.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import casadi as ca

from ident.plant.symbolic import CORNERS, Expression
from ident.plant.symbols import Symbols
from ident.plant.terms import Term, centre_of_mass, loaded_mass
from ident.vehicle.quantities import GRAVITY

CREEP_STIFFNESS: Final = 1e7
"""c where nobody sets one [N s/m]: under 100 N a wheel slips by 10 micrometres a second."""

_LEAST_LOAD: Final = 1e-3
"""Part of a quarter of the weight that a wheel keeps however far the centre of mass is off: no division by zero."""


def static_loads(p: Symbols, terms: Sequence[Term]) -> Expression:
    """Loads of the contacts (4,) [N] on a level floor at rest; the centre of mass shifts m_ch, no load."""
    load, centre = loaded_mass(terms), centre_of_mass(terms)
    ahead, left = centre[0], centre[1]
    shares = [1 + front * 2 * ahead / p["wheelbase"] + side * 2 * left / p["track_width"] for front, side in CORNERS]
    quarters = [ca.fmax(p["m_ch"] * share + load, _LEAST_LOAD * p["m_ch"]) for share in shares]
    return GRAVITY / 4 * ca.vertcat(*quarters)


def contact_forces(slip: Expression, loads: Expression, p: Symbols) -> Expression:
    """Forces of the floor on the wheels (8,) [N], ordered as the slip (8,) [m/s]: across, then along."""
    across, along = slip[:4], slip[4:]
    creep = p["creep_stiffness"]
    limits = p.wheels("friction_limit_{}") * loads
    softening = ca.sqrt(1 + (creep / limits) ** 2 * (across**2 + along**2))
    return -creep * ca.vertcat(across / softening, along / softening)
