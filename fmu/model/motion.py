"""How the vehicle moves: its equations of motion with contacts that give a little and friction that holds.

    Θ(q, q̇, q̈) p + f(q, q̇, q̈) = B u + Aᵀ F

The forces F of the contacts stand for the constraint forces λ of (15), so that one equation holds in every mode and
between the modes. Θ, A, B and the effects f come from `ident.vehicle`; nothing of them is written again here.

A soft coupling adds the twist t of its side to q. Its rear unit then turns by α - t, and has half of the side's
inertia, friction and effects, but scrub and unit masses, which are taken as if both units turned alike. A flexible
gear takes the motor's part of B_w off the wheel, and its spring stands for the motor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import casadi as ca

from fmu.model.contact import contact_forces, static_loads
from fmu.model.stiction import held_rates
from fmu.model.stops import stop_torques
from fmu.model.symbols import Symbols
from fmu.model.transmissions import Coupling, Gear
from ident.vehicle import effect_terms, symbolic
from ident.vehicle.effect_terms import EffectTerm, State
from ident.vehicle.effects import EffectName
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.symbolic import Expression

_COULOMB: Final = ("d_cl", "d_cr", "d_cw")
_LIKE_COULOMB: Final = (EffectName.STRIBECK, EffectName.ASYMMETRIC_COULOMB, EffectName.SCRUB)
"""What adds to Coulomb friction holds like it."""

_OF_UNITS: Final = (EffectName.SCRUB, EffectName.STEERING_UNIT_MASS)
"""What the chassis feels of front and rear unit in different ways."""


@dataclass(frozen=True)
class Motion:
    """Where the vehicle is and how it moves, true values.

    Attributes:
        state: as the effects take it; accelerations are symbols.
        held: the same with the rates that Coulomb friction sees.
        terms: effects.
        rolling: A(α, β) (8, 9 + n), the last columns of the n soft couplings.
        loads: N (4,) [N].
        parameters: p′ (11,).
        couplings: those of the steering that are soft.
    """

    state: State
    held: State
    terms: Sequence[EffectTerm]
    rolling: Expression
    loads: Expression
    parameters: Expression
    couplings: Sequence[Coupling]

    @property
    def slip(self) -> Expression:
        """s (8,): across the four wheels, then along them [m/s]."""
        return self.rolling @ ca.vertcat(self.state.rates, *(coupling.rate for coupling in self.couplings))


def motion_of(
    x: Symbols, p: Symbols, terms: Sequence[EffectTerm], parameters: Expression, couplings: Sequence[Coupling]
) -> Motion:
    """The motion at a state of the table."""
    alpha, beta = x.sides("alpha_{}"), x.wheels("beta_{}")
    rates = ca.vertcat(x.stacked("x_dot", "y_dot", "gamma_dot"), x.sides("alpha_{}_dot"), x.wheels("beta_{}_dot"))
    state = State(x["gamma"], alpha, beta, rates, ca.SX.sym("qdd", 9))
    held = replace(state, rates=held_rates(x, p, rates))
    rolling = _constraint_matrix(alpha, couplings)
    radii = effect_terms.rolling_radii(terms, beta)
    for wheel in range(4):
        rolling[4 + wheel, 5 + wheel] = -radii[wheel]
    return Motion(state, held, terms, rolling, static_loads(p, terms), parameters, couplings)


def _constraint_matrix(alpha: Expression, couplings: Sequence[Coupling]) -> Expression:
    """A(α) with the rear wheels of soft couplings where they stand, and a column for the twist of each."""
    rigid = symbolic.constraint_matrix(alpha)
    if not couplings:
        return rigid
    headings = symbolic.wheel_headings(alpha)
    columns = ca.SX.zeros(8, len(couplings))
    for column, coupling in enumerate(couplings):
        rear = 2 * coupling.side + 1
        headings[rear] += coupling.twist
        columns[4 + rear, column] = -rigid[4 + rear, 3 + coupling.side]
    return ca.horzcat(symbolic.contact_rows(headings), rigid[:, 3:], columns)


def acceleration(motion: Motion, p: Symbols, shaft_torques: Expression, gears: Sequence[Gear]) -> Expression:
    """q̈ (9 + n,), with those of the soft couplings, under torques (4,) that reach the wheels, over the gear ratio."""
    unknown = ca.vertcat(motion.state.accelerations, *(coupling.acceleration for coupling in motion.couplings))
    forces = contact_forces(motion.slip, motion.loads, p)
    resistance = (
        _resistance(motion.state, motion.held, motion.terms, motion.parameters, p)
        - symbolic.input_matrix() @ shaft_torques
    )
    for gear in gears:
        resistance[5 + gear.wheel] -= gear.motor_inertia * motion.state.accelerations[5 + gear.wheel]
    residual = _with_couplings(resistance, motion, p) - motion.rolling.T @ forces
    mass = ca.jacobian(residual, unknown)
    rest = ca.substitute(residual, unknown, ca.SX.zeros(unknown.numel()))
    return -ca.ldl_solve(rest, *ca.ldl(mass))


def motor_wrench(motion: Motion, shaft_torques: Expression) -> Expression:
    """What the motors do to the vehicle through wheels that roll, (5,): α_l, α_r [Nm], x, y [N], γ [Nm].

    B u of (17), projected on the directions in which wheels can roll; in each mode a projection of it is H_kᵀ B u.
    """
    along = motion.rolling[4:, :]
    radii = -ca.diag(along[:, 5:9])
    pull = symbolic.input_matrix()[5:, :] @ shaft_torques / radii
    wrench = along[:, :5].T @ pull
    return ca.vertcat(wrench[3:], wrench[:3])


def _with_couplings(resistance: Expression, motion: Motion, p: Symbols) -> Expression:
    """The resistance (9 + n,) where rear units turn on their own, from that (9,) where they do not."""
    whole, twisted = resistance, []
    alike = [term for term in motion.terms if term.name not in _OF_UNITS]
    for coupling in motion.couplings:
        front, rear = (
            _resistance(*states, alike, motion.parameters, p)[3 + coupling.side] / 2
            for states in (
                (motion.state, motion.held),
                (_rear(motion.state, coupling), _rear(motion.held, coupling)),
            )
        )
        whole[3 + coupling.side] += rear - front
        whole[2] += coupling.inertia * coupling.acceleration
        twisted.append(coupling.torque + coupling.inertia * motion.state.accelerations[2] - rear)
    return ca.vertcat(whole, *twisted)


def _rear(state: State, coupling: Coupling) -> State:
    """The state with the rear unit's angle and rates at the place of the front one's."""
    alpha, rates, accelerations = (ca.SX(part) for part in (state.alpha, state.rates, state.accelerations))
    alpha[coupling.side] -= coupling.twist
    rates[3 + coupling.side] -= coupling.rate
    accelerations[3 + coupling.side] -= coupling.acceleration
    return replace(state, alpha=alpha, rates=rates, accelerations=accelerations)


def _resistance(
    state: State, held: State, terms: Sequence[EffectTerm], parameters: Expression, p: Symbols
) -> Expression:
    """Θ p + f (9,), Coulomb friction and its like at the rates that hold, and the stops of the steering."""
    coulomb = ca.SX([float(name in _COULOMB) for name in PARAMETER_NAMES])
    theta = symbolic.regressor(state.rates, state.accelerations)
    theta_held = symbolic.regressor(held.rates, state.accelerations)
    holding = [term for term in terms if term.name in _LIKE_COULOMB]
    others = [term for term in terms if term.name not in _LIKE_COULOMB]
    return (
        theta @ (parameters * (1 - coulomb))
        + theta_held @ (parameters * coulomb)
        + effect_terms.added_forces(others, state, parameters)
        + effect_terms.added_forces(holding, held, parameters)
        + stop_torques(state.alpha, state.rates, p)
    )
