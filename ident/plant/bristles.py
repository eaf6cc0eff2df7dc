"""Friction that bends bristles before it slides: Dahl's model (1968), whose state is a part of the friction.

    friction  T z,    ż = (q̇ - |q̇| z)/θ

z goes from -1 to 1: after a reversal at z₀ and a way s it is sign(q̇) (1 - (1 + |z₀|) exp(-s/θ)). The rate is in it as
an increment of the way alone, so that friction depends on where a joint has been, not on how fast.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.plant.symbolic import Expression
from ident.plant.symbols import SIDES, Symbols
from ident.plant.terms import Joint, Term
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

FIRST_JOINT = 3
"""Row of q of the first joint."""


def bristles_of(terms: Sequence[Term]) -> dict[Joint, Expression]:
    """Angles θ [rad] of all bristles, by joint."""
    return {joint: angle for term in terms for joint, angle in term.bristles().items()}


def state_name(joint: Joint) -> str:
    """Of the state z of a joint of an effect."""
    where, row = joint
    names = [*(f"alpha_{side}" for side in SIDES), *(f"beta_{wheel}" for wheel in WHEELS)]
    return f"bent_{names[row - FIRST_JOINT]}_{where}"


def bent_in(x: Symbols, joints: Sequence[Joint]) -> Mapping[Joint, Expression]:
    """z of all joints from the states of a model."""
    return {joint: x[state_name(joint)] for joint in joints}


def bending_rates(x: Symbols, terms: Sequence[Term], rates: Expression) -> Expression:
    """ż (n,) from q̇ (9,)."""
    return ca.vertcat(
        *(
            (rates[joint[1]] - ca.fabs(rates[joint[1]]) * x[state_name(joint)]) / angle
            for joint, angle in bristles_of(terms).items()
        )
    )


def bent_on(bent: Expression, turned: Expression, angle: Expression) -> Expression:
    """z behind a way [rad] in one direction, exactly."""
    return bent + (ca.sign(turned) - bent) * (1 - ca.exp(-ca.fabs(turned) / angle))


def bent_along(angles: Array, angle: float) -> Array:
    """z (N,) of a joint that has been at some angles (N,) [rad], from bristles that are straight.

    Args:
        angles: of the joint.
        angle: θ [rad].
    """
    turned = np.diff(angles)
    # z after a step is kept z + added; of two steps one after the other, kept k l z + (l a + b): a scan by doubling.
    kept = np.append(0.0, np.exp(-np.abs(turned) / angle))
    added = np.append(0.0, np.sign(turned) * -np.expm1(-np.abs(turned) / angle))
    steps = 1
    while steps < len(angles) and kept[steps:].any():
        added[steps:] += kept[steps:] * added[:-steps]
        kept[steps:] *= kept[:-steps]
        steps *= 2
    return added


def all_bent_along(terms: Sequence[Term], angles: Array) -> Array:
    """z (N, m) of all bristles, of which the steering axes and wheels have been at some angles (N, 6) [rad]."""
    joints = bristles_of(terms)
    found = [bent_along(angles[:, row - FIRST_JOINT], float(angle)) for (_, row), angle in joints.items()]
    return np.stack(found, axis=1) if found else np.zeros((len(angles), 0))
