"""How the vehicle moves: its equations of motion with contacts that give a little and friction that holds.

    Θ(q, q̇, q̈) p + f(q, q̇, q̈) = B u + Aᵀ F

The forces F of the contacts stand for the constraint forces λ of (15), so that one equation holds in every mode and
between the modes. Θ, A, B and the effects f come from `ident.vehicle`; nothing of them is written again here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import casadi as ca

from fmu.model.contact import contact_forces, static_loads
from fmu.model.stiction import held_rates
from fmu.model.stops import stop_torques
from fmu.model.symbols import Symbols, dynamic_parameters
from ident.vehicle import effect_terms, symbolic
from ident.vehicle.effect_terms import EffectTerm, State
from ident.vehicle.effects import EffectName
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.symbolic import Expression

_COULOMB: Final = ("d_cl", "d_cr", "d_cw")
_LIKE_COULOMB: Final = (EffectName.STRIBECK, EffectName.ASYMMETRIC_COULOMB, EffectName.SCRUB)
"""What adds to Coulomb friction holds like it."""


@dataclass(frozen=True)
class Motion:
    """Where the vehicle is and how it moves, true values.

    Attributes:
        state: as the effects take it; accelerations are symbols.
        held: the same with the rates that Coulomb friction sees.
        terms: effects.
        rolling: A(α, β) (8, 9).
        loads: N (4,) [N].
    """

    state: State
    held: State
    terms: Sequence[EffectTerm]
    rolling: Expression
    loads: Expression

    @property
    def slip(self) -> Expression:
        """s (8,): across the four wheels, then along them [m/s]."""
        return self.rolling @ self.state.rates


def motion_of(x: Symbols, p: Symbols, terms: Sequence[EffectTerm]) -> Motion:
    """The motion at a state of the table."""
    alpha, beta = x.sides("alpha_{}"), x.wheels("beta_{}")
    rates = ca.vertcat(x.stacked("x_dot", "y_dot", "gamma_dot"), x.sides("alpha_{}_dot"), x.wheels("beta_{}_dot"))
    state = State(x["gamma"], alpha, beta, rates, ca.SX.sym("qdd", 9))
    held = replace(state, rates=held_rates(x, p, rates))
    rolling = symbolic.constraint_matrix(alpha)
    radii = effect_terms.rolling_radii(terms, beta)
    for wheel in range(4):
        rolling[4 + wheel, 5 + wheel] = -radii[wheel]
    return Motion(state, held, terms, rolling, static_loads(p, terms))


def acceleration(motion: Motion, p: Symbols, shaft_torques: Expression) -> Expression:
    """q̈ (9,) under torques (4,) of the motor shafts."""
    unknown = motion.state.accelerations
    forces = contact_forces(motion.slip, motion.loads, p)
    residual = _resistance(motion, p) - symbolic.input_matrix() @ shaft_torques - motion.rolling.T @ forces
    mass = ca.jacobian(residual, unknown)
    rest = ca.substitute(residual, unknown, ca.SX.zeros(9))
    return -ca.ldl_solve(rest, *ca.ldl(mass))


def motor_wrench(motion: Motion, shaft_torques: Expression) -> Expression:
    """What the motors do to the vehicle through wheels that roll, (5,): α_l, α_r [Nm], x, y [N], γ [Nm].

    B u of (17), projected on the directions in which wheels can roll; in each mode a projection of it is H_kᵀ B u.
    """
    along = motion.rolling[4:, :]
    radii = -ca.diag(along[:, 5:])
    pull = symbolic.input_matrix()[5:, :] @ shaft_torques / radii
    wrench = along[:, :5].T @ pull
    return ca.vertcat(wrench[3:], wrench[:3])


def _resistance(motion: Motion, p: Symbols) -> Expression:
    """Θ p + f (9,), Coulomb friction and its like at the rates that hold, and the stops of the steering."""
    parameters = effect_terms.changed_parameters(motion.terms, dynamic_parameters(p))
    coulomb = ca.SX([float(name in _COULOMB) for name in PARAMETER_NAMES])
    theta = symbolic.regressor(motion.state.rates, motion.state.accelerations)
    theta_held = symbolic.regressor(motion.held.rates, motion.state.accelerations)
    holding = [term for term in motion.terms if term.name in _LIKE_COULOMB]
    others = [term for term in motion.terms if term.name not in _LIKE_COULOMB]
    return (
        theta @ (parameters * (1 - coulomb))
        + theta_held @ (parameters * coulomb)
        + effect_terms.added_forces(others, motion.state, parameters)
        + effect_terms.added_forces(holding, motion.held, parameters)
        + stop_torques(motion.state.alpha, motion.state.rates, p)
    )
