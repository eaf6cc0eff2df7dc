"""The vehicle on contacts that give a little and with friction that holds: ẋ = f(x, u, p), in every mode and between.

    Θ(q, q̇, q̈) p′ + f(q, q̇, q̈, p′) = B u′ + Aᵀ F

The forces F of the contacts stand for the constraint forces λ of (15). A flexible gear takes the motor's part of B_w
off the wheel, and its spring stands for the motor. States, inputs and parameters are identified by their names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ident.plant import symbolic
from ident.plant.balance import Resistance
from ident.plant.bristles import bending_rates, bent_in
from ident.plant.contact import contact_forces, held_twist, held_twist_rates, static_loads
from ident.plant.delays import filter_rates, late_angles, late_torques
from ident.plant.drives import DRIVES, Inputs
from ident.plant.lags import following_rates, following_torques
from ident.plant.memories import Memories, memories_of
from ident.plant.stiction import held_rates, memory_rates
from ident.plant.stops import stop_torques
from ident.plant.symbolic import LENGTHS, Expression
from ident.plant.symbols import SIDES, Symbols, bound, dynamic_parameters
from ident.plant.terms import (
    FIRST_WHEEL,
    State,
    Surroundings,
    Term,
    changed_parameters,
    rolling_radii,
    shaft_torques,
    steering_errors,
)
from ident.plant.transmissions import (
    SpringNumbers,
    Twist,
    at_motors,
    coupling,
    gear,
    transmitted_torques,
    twist_acceleration,
)
from ident.vehicle.geometry import WHEELS


@dataclass(frozen=True)
class Equations:
    """Symbols and what is computed from them.

    Attributes:
        x, u, p: states, inputs and parameters.
        xd: derivatives of x.
        y: outputs.
        z: event indicators (4,); the mode is 4 where z[0] < 0, else 3 where z[1] < 0, else 2 where z[2] and z[3] are
            negative, else 1.
        coupled: how many of the first states, the rates of chassis and steering, everything else hangs on and can be
            eliminated from.
    """

    x: Expression
    u: Expression
    p: Expression
    xd: Expression
    y: Expression
    z: Expression
    coupled: int


@dataclass(frozen=True)
class Motion:
    """Where the vehicle is and how it moves, true values.

    Attributes:
        state: as terms take it; accelerations are symbols.
        held: the same with the rates that Coulomb friction sees.
        rolling: A(α, β) (8, 9 + n), the last columns of the n soft couplings.
        couplings: those of the steering that are soft.
    """

    state: State
    held: State
    rolling: Expression
    couplings: Sequence[Twist]

    def slip_with(self, twist: Expression) -> Expression:
        """Slip (8,) of the contacts with a twist (3,) more of the chassis: across the wheels, then along them [m/s]."""
        rates = ca.vertcat(self.state.rates[:3] + twist, self.state.rates[3:])
        return self.rolling @ ca.vertcat(rates, *(coupling.rate for coupling in self.couplings))


def equations(x: Symbols, u: Symbols, p: Symbols, effects: Sequence[Term], inputs: Inputs) -> Equations:
    """The equations of a vehicle.

    Args:
        x, u, p: states, inputs and parameters by name.
        effects: additions, their numbers in p.
        inputs: motor torques, or wheel speeds with the drives' inner loop.
    """
    memories, terms = memories_of(effects), [*effects, Surroundings(u["slope_x"], u["slope_y"], u["payload"])]
    state = _state(x, memories)
    parameters = changed_parameters(terms, dynamic_parameters(p), state)
    couplings, gears = _twists(x, p, terms, parameters, memories)
    alpha, rates = state.alpha, state.rates
    motor_angles, motor_rates = at_motors(gears, state.beta, "angle"), at_motors(gears, rates[5:], "rate")
    torques, integral_rates = DRIVES[inputs](motor_rates, x, u, p)
    late = late_torques(x, terms, memories, torques)
    shaft = shaft_torques(terms, following_torques(x, terms, memories, late), motor_angles)
    transmitted = transmitted_torques(gears, shaft)
    state = replace(state, loads=LENGTHS.i_G * transmitted)
    motion = _motion(state, x, p, terms, couplings)
    resistance = Resistance(terms, parameters, lambda state: stop_torques(state.alpha, state.rates, p))
    slip = motion.slip_with(ca.SX.zeros(3))
    forces = contact_forces(motion.slip_with(held_twist(x)), static_loads(p, terms), p)
    accelerations = _acceleration(motion, resistance, forces, transmitted, gears)
    slope_rates, filtered_rates = filter_rates(x, terms, memories, torques, rates[3:5])
    xd = ca.vertcat(
        accelerations,
        *(twist_acceleration(each, shaft[each.place], accelerations[5 + each.place]) for each in gears),
        slope_rates,
        memory_rates(x, p, rates),
        held_twist_rates(x, p, alpha, rates),
        integral_rates,
        *(twisted.rate for twisted in (*couplings, *gears)),
        filtered_rates,
        following_rates(x, terms, memories, late),
        bending_rates(x, terms, rates),
        *([ca.SX(1)] if memories.elapsed else []),
        rates[3:],
        _pose_rate(state.heading, rates),
    )
    reported = late_angles(x, terms, memories, alpha + steering_errors(terms))
    at_shafts = (angle for each in gears for angle in (motor_angles[each.place], motor_rates[each.place]))
    y = ca.vertcat(reported, torques, slip[4:], slip[:4], _motor_wrench(motion, shaft), *at_shafts)
    distances = symbolic.mode_distances(alpha, p["mode_tolerance"])
    return Equations(x.vector, u.vector, p.vector, bound(xd, p), bound(y, p), bound(distances, p), FIRST_WHEEL)


def _state(x: Symbols, memories: Memories) -> State:
    """A state by its names; accelerations are symbols, and time is one where nothing depends on it."""
    alpha, beta = x.sides("alpha_{}"), x.wheels("beta_{}")
    rates = ca.vertcat(x.stacked("x_dot", "y_dot", "gamma_dot"), x.sides("alpha_{}_dot"), x.wheels("beta_{}_dot"))
    elapsed = x["elapsed"] if memories.elapsed else ca.SX.sym("elapsed")
    bent = bent_in(x, memories.bristles)
    return State(x["gamma"], alpha, beta, rates, ca.SX.sym("qdd", 9), elapsed, bent=bent)


def _twists(
    x: Symbols, p: Symbols, terms: Sequence[Term], parameters: Expression, memories: Memories
) -> tuple[list[Twist], list[Twist]]:
    """Soft couplings, then flexible gears; the accelerations of the latter follow from the motors."""
    if not memories.flexible:
        return [], []
    share = {"motor_share": p["motor_share"]} if memories.gears else {}
    numbers = SpringNumbers(p["spring_stiffness"], p["spring_damping_ratio"], **share)

    def motion(name: str) -> tuple[Expression, Expression, Expression]:
        return x[f"{name}_twist"], x[f"{name}_twist_dot"], ca.SX.sym(f"{name}_twist_ddot")

    couplings = [
        coupling(side, motion(f"coupling_{SIDES[side]}"), terms, parameters, numbers) for side in memories.couplings
    ]
    gears = [gear(wheel, motion(f"gear_{WHEELS[wheel]}"), terms, parameters, numbers) for wheel in memories.gears]
    return couplings, gears


def _motion(state: State, x: Symbols, p: Symbols, terms: Sequence[Term], couplings: Sequence[Twist]) -> Motion:
    held = replace(state, rates=held_rates(x, p, state.rates))
    rolling = _constraint_matrix(state.alpha, couplings)
    radii = rolling_radii(terms, state.beta)
    for wheel in range(4):
        rolling[4 + wheel, 5 + wheel] = -radii[wheel]
    return Motion(state, held, rolling, couplings)


def _constraint_matrix(alpha: Expression, couplings: Sequence[Twist]) -> Expression:
    """A(α) with the rear wheels of soft couplings where they stand, and a column for the twist of each."""
    rigid = symbolic.constraint_matrix(alpha)
    if not couplings:
        return rigid
    headings = symbolic.wheel_headings(alpha)
    columns = ca.SX.zeros(8, len(couplings))
    for column, twisted in enumerate(couplings):
        rear = 2 * twisted.place + 1
        headings[rear] += twisted.angle
        columns[4 + rear, column] = -rigid[4 + rear, 3 + twisted.place]
    return ca.horzcat(symbolic.contact_rows(headings), rigid[:, 3:], columns)


def _acceleration(
    motion: Motion, resistance: Resistance, forces: Expression, transmitted: Expression, gears: Sequence[Twist]
) -> Expression:
    """q̈ (9 + n,), with the soft couplings', under forces (8,) of the contacts and what the gears transmit (4,)."""
    unknown = ca.vertcat(motion.state.accelerations, *(twisted.acceleration for twisted in motion.couplings))
    residual = resistance.at(motion.state, motion.held, motion.couplings) - motion.rolling.T @ forces
    residual[:9] -= symbolic.input_matrix() @ transmitted
    for each in gears:
        residual[5 + each.place] -= each.inertia * motion.state.accelerations[5 + each.place]
    residual[9:] += ca.vertcat(*(twisted.torque for twisted in motion.couplings))
    mass = ca.jacobian(residual, unknown)
    rest = ca.substitute(residual, unknown, ca.SX.zeros(unknown.numel()))
    return -ca.ldl_solve(rest, *ca.ldl(mass))


def _motor_wrench(motion: Motion, shaft: Expression) -> Expression:
    """What the motors do to the vehicle through wheels that roll, (5,): α_l, α_r [Nm], x, y [N], γ [Nm].

    B u of (17), projected on the directions in which wheels can roll; in each mode a projection of it is H_kᵀ B u.
    """
    along = motion.rolling[4:, :]
    radii = -ca.diag(along[:, 5:9])
    pull = symbolic.input_matrix()[5:, :] @ shaft / radii
    wrench = along[:, :5].T @ pull
    return ca.vertcat(wrench[3:], wrench[:3])


def _pose_rate(heading: Expression, rates: Expression) -> Expression:
    """Rates of heading, x and y in the world."""
    cos, sin = ca.cos(heading), ca.sin(heading)
    return ca.vertcat(rates[2], cos * rates[0] - sin * rates[1], sin * rates[0] + cos * rates[1])
