"""A damped spring with play, the law of every gear and coupling that gives way.

    K(θ, θ̇) = k (r(θ - h) - r(-θ - h)) + d θ̇ (r'(θ - h) + r'(-θ - h)),    r(x) = (x + sqrt(x² + w²))/2

θ is the twist, 2 h the play, k the stiffness, d = 2 ζ sqrt(k μ) with the reduced inertia μ of both sides. Without play
it is k θ + d θ̇, exactly. k follows from the compliance c and the stiffest spring k₀ as 1/sqrt(c² + 1/k₀²).
"""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.plant.symbolic import Expression

MOTOR_SHARE: Final = 0.5
"""Share of B_w on the motor's side of a flexible gear, where nobody sets one: a motor matched to its load."""

DAMPING_RATIO: Final = 0.05
"""Of the free vibration of both sides of a spring, where nobody sets one; the order of magnitude of a steel gear."""

STIFFEST: Final = 1e5
"""Stiffness of a gear or coupling that has play alone, where nobody sets one [Nm/rad]."""

ROUNDING: Final = 3e-5
"""w [rad]: 0.3 mrad before its flank a spring of 10⁵ Nm/rad gives 0.08 Nm, less than any friction here."""


def stiffness_of(compliance: Expression, stiffest: Expression = STIFFEST) -> Expression:
    """k [Nm/rad] of a compliance [rad/Nm]."""
    return 1 / ca.sqrt(compliance**2 + 1 / stiffest**2)


def spring_torque(
    twist: Expression, rate: Expression, stiffness: Expression, gap: Expression, damping: Expression
) -> Expression:
    """K [Nm] of a twist [rad] and its rate [rad/s], for k [Nm/rad], the whole play [rad] and d [Nm s/rad]."""
    forward, forward_touch = _beyond(twist - gap / 2)
    backward, backward_touch = _beyond(-twist - gap / 2)
    return stiffness * (forward - backward) + damping * rate * (forward_touch + backward_touch)


def damping_of(stiffness: Expression, reduced_inertia: Expression, ratio: Expression = DAMPING_RATIO) -> Expression:
    """d [Nm s/rad] of a damping ratio, for k [Nm/rad] and μ [kg m²]."""
    return 2 * ratio * ca.sqrt(stiffness * reduced_inertia)


def resting_twist(load: Expression, stiffness: Expression, gap: Expression) -> Expression:
    """Twist [rad] under a steady load [Nm]; where the load changes its sign, from flank to flank."""
    return load / stiffness + gap / 2 * load / ca.sqrt(load**2 + (stiffness * ROUNDING) ** 2)


def _beyond(distance: Expression) -> tuple[Expression, Expression]:
    root = ca.sqrt(distance**2 + ROUNDING**2)
    return (distance + root) / 2, (1 + distance / root) / 2
