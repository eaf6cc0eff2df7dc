"""The one balance of forces: what the vehicle resists, its couplings rigid or soft, before anything holds its wheels.

    Θ(q, q̇, q̈) p′ + f(q, q̇, q̈, p′)

What holds the wheels closes it: wheels that roll (`rolling`), or contacts that creep (`creeping`). A soft coupling adds
the twist t of its side to q. Its rear unit then turns by α - t, and has half of the side's inertia, friction and
effects, but scrub and unit masses, which are taken as if both units turned alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import casadi as ca

from ident.plant import symbolic
from ident.plant.symbolic import Expression
from ident.plant.terms import State, Term, added_forces
from ident.plant.transmissions import Twist
from ident.vehicle.parameters import PARAMETER_NAMES

_COULOMB: Final = ca.SX([float(name in ("d_cl", "d_cr", "d_cw")) for name in PARAMETER_NAMES])

Stops = Callable[[State], Expression]
"""What the mechanical stops of the steering resist (9,)."""


@dataclass(frozen=True)
class Resistance:
    """What resists a motion.

    Attributes:
        terms: additions to the equations.
        parameters: p′ (11,).
        stops: of the steering; None where the motion stays between them.
    """

    terms: Sequence[Term]
    parameters: Expression
    stops: Stops | None = None

    def at(self, state: State, held: State | None, couplings: Sequence[Twist]) -> Expression:
        """Generalized forces (9 + n,) of a motion, with the n soft couplings.

        Args:
            state: of the vehicle.
            held: the same with the rates that dry friction sees, where it remembers.
            couplings: those of the steering that are soft.
        """
        whole, twisted = self._rigid(state, held), []
        apart = replace(self, terms=[term for term in self.terms if not term.of_both_units])
        for coupling in couplings:
            row = 3 + coupling.place
            front = apart._rigid(state, held)[row] / 2
            rear = apart._rigid(_rear(state, coupling), held and _rear(held, coupling))[row] / 2
            whole[row] += rear - front
            whole[2] += coupling.inertia * coupling.acceleration
            twisted.append(coupling.inertia * state.accelerations[2] - rear)
        return ca.vertcat(whole, *twisted)

    def _rigid(self, state: State, held: State | None) -> Expression:
        """(9,) with rigid couplings; Coulomb friction and its like at the rates that hold."""
        theta = symbolic.regressor(state.rates, state.accelerations)
        friction = self.parameters
        forces = added_forces(self.terms, state, self.parameters, held)
        if held is not None:
            remembered = symbolic.regressor(held.rates, state.accelerations)
            friction = self.parameters * (1 - _COULOMB)
            forces += remembered @ (self.parameters * _COULOMB)
        if self.stops is not None:
            forces += self.stops(state)
        return theta @ friction + forces


def _rear(state: State, coupling: Twist) -> State:
    """The state with the rear unit's angle and rates at the place of the front one's."""
    alpha, rates, accelerations = (ca.SX(part) for part in (state.alpha, state.rates, state.accelerations))
    alpha[coupling.place] -= coupling.angle
    rates[3 + coupling.place] -= coupling.rate
    accelerations[3 + coupling.place] -= coupling.acceleration
    return replace(state, alpha=alpha, rates=rates, accelerations=accelerations)
