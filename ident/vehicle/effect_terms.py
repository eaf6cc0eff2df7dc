"""The effects as terms of the equations of motion, written once, symbolically.

With effects, (14) reads

    Θ(q, q̇, q̈) p′ + f(q, q̇, q̈, p) = B u′(u, β) + A′(α′, β)ᵀ λ,    A′(α′, β) q̇ = 0

| symbol | here | what of the effects is in it |
|---|---|---|
| p′ | `changed_parameters` | `parameter_change` |
| f | `added_forces` | friction, drag, slope, centre of mass, payload, steering units, scrub, weight on a wheel |
| u′ | `shaft_torques` | gain, bias and ripple of the drives; u is what they report |
| A′ | `rolling_radii` | radius and eccentricity of the wheels |
| α′ | `true_steering` | zero errors of the steering encoders; α is what they report |

f is linear in q̈: ∂f/∂q̈ is what an effect adds to the mass matrix. Without any size all are those of the plain model.
`time_delay`, `backlash`, `elasticity` and `slip` have states of their own, or change what holds the wheels to the
floor, and are no terms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import casadi as ca

from ident.vehicle.effects import ALL_WHEELS, DRIVES, EFFECTS, STEERING, WHEEL_PLACES, Effect, EffectName
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.symbolic import CORNERS, EPSILON, LENGTHS, Expression

GRAVITY: Final = 9.80665
"""Standard gravity, ISO 80000-3 [m/s²]."""

TERMS: Final = tuple(
    name
    for name in EffectName
    if name not in (EffectName.TIME_DELAY, EffectName.BACKLASH, EffectName.ELASTICITY, EffectName.SLIP)
)
"""Effects that this module has equations for."""

_FIRST_WHEEL: Final = 5
_ROWS: Final[Mapping[str, tuple[int, ...]]] = MappingProxyType(
    {
        **{place: (3 + side,) for side, place in enumerate(STEERING)},
        **{place: (_FIRST_WHEEL + wheel,) for wheel, place in enumerate(WHEEL_PLACES)},
        **{place: tuple(range(_FIRST_WHEEL, 9)) for place in ALL_WHEELS},
    }
)
"""Rows of q at which the friction of a place acts."""


@dataclass(frozen=True)
class EffectTerm:
    """An effect whose numbers may be symbols.

    Attributes:
        name, where: as in `Effect`.
        values: of all its parameters, SI.
    """

    name: EffectName
    where: str
    values: Mapping[str, Expression]

    def __getitem__(self, parameter: str) -> Expression:
        return self.values[parameter]


@dataclass(frozen=True)
class State:
    """What the terms depend on, symbols or numbers.

    Attributes:
        heading: γ, in the world [rad].
        alpha: (2,) [rad].
        beta: (4,) [rad].
        rates, accelerations: q̇, q̈ (9,), twist in the chassis frame, as in `ident.vehicle.symbolic`.
    """

    heading: Expression
    alpha: Expression
    beta: Expression
    rates: Expression
    accelerations: Expression


@dataclass(frozen=True)
class Masses:
    """What moves over the floor [kg].

    Attributes:
        own: m_ch, whose centre `com_offset` shifts.
        loaded: with payloads, which stay over the centre of the chassis.
    """

    own: Expression
    loaded: Expression


def term_of(effect: Effect) -> EffectTerm:
    """The term of an effect with numbers."""
    return EffectTerm(effect.name, effect.where, {name: value.value for name, value in effect.parameters.items()})


def symbolic_term(name: EffectName, where: str) -> EffectTerm:
    """A term whose parameters are symbols, named `<effect>.<place>.<parameter>`."""
    entries = EFFECTS[name].parameters
    return EffectTerm(name, where, {entry.name: ca.SX.sym(f"{name}.{where}.{entry.name}") for entry in entries})


def symbolic_terms() -> tuple[EffectTerm, ...]:
    """Every effect of TERMS at every place, with symbols for parameters."""
    return tuple(symbolic_term(name, where) for name in TERMS for where in EFFECTS[name].places)


def neutral_values(term: EffectTerm) -> dict[str, float]:
    """Values of a term's parameters without the effect: no size, the others at their defaults."""
    spec = EFFECTS[term.name]
    return {entry.name: 0.0 if entry is spec.size else float(entry.default or 0.0) for entry in spec.parameters}


def changed_parameters(terms: Sequence[EffectTerm], parameters: Expression) -> Expression:
    """p′ (11,)."""
    factors = ca.SX.ones(len(PARAMETER_NAMES))
    for term in _of(terms, EffectName.PARAMETER_CHANGE):
        factors[PARAMETER_NAMES.index(term.where)] += term["change"]
    return ca.SX(parameters) * factors


def added_forces(terms: Sequence[EffectTerm], state: State, parameters: Expression) -> Expression:
    """f (9,): N, N, Nm in the chassis frame, then Nm at steering axes and wheels; positive where it resists.

    Args:
        terms: effects; those without forces are passed over.
        state: of the vehicle.
        parameters: p (11,); a slope acts on the mass that is there, so payload and its inertia are added here.
    """
    total = ca.SX.zeros(9)
    own = parameters[PARAMETER_NAMES.index("m_ch")]
    masses = Masses(own, own + sum(term["mass"] for term in _of(terms, EffectName.PAYLOAD)))
    for term in terms:
        if term.name in _FORCES:
            total += _FORCES[term.name](term, state, masses)
    centre = centre_of_mass(terms)
    return total + _off_centre(centre, state, masses) + _tilted(terms, centre, state, masses)


def centre_of_mass(terms: Sequence[EffectTerm]) -> Expression:
    """Where m_ch has its centre (2,); offsets add up first, for the inertia that they make goes by the square."""
    return sum((ca.vertcat(term["x"], term["y"]) for term in _of(terms, EffectName.COM_OFFSET)), ca.SX.zeros(2))


def shaft_torques(terms: Sequence[EffectTerm], reported: Expression, beta: Expression) -> Expression:
    """u′ (4,) [Nm] at the motor shafts, from the torques that the drives report and β (4,)."""
    true = ca.SX(reported)
    for term in _of(terms, EffectName.TORQUE_GAIN):
        drive = DRIVES.index(term.where)
        true[drive] += term["error"] * reported[drive]
    for term in _of(terms, EffectName.TORQUE_BIAS):
        true[DRIVES.index(term.where)] += term["bias"]
    for term in _of(terms, EffectName.TORQUE_RIPPLE):
        wheel = DRIVES.index(term.where)
        angle = term["order"] * LENGTHS.i_G * beta[wheel] + term["phase"]
        true[wheel] += term["amplitude"] * ca.sin(angle)
    return true


def rolling_radii(terms: Sequence[EffectTerm], beta: Expression) -> Expression:
    """Radii (4,) [m] on which the wheels roll at β (4,)."""
    radii = LENGTHS.r * ca.SX.ones(4)
    for term in _of(terms, EffectName.WHEEL_RADIUS):
        radii[WHEEL_PLACES.index(term.where)] += term["error"]
    for term in _of(terms, EffectName.WHEEL_ECCENTRICITY):
        wheel = WHEEL_PLACES.index(term.where)
        radii[wheel] += term["amplitude"] * ca.cos(beta[wheel] + term["phase"])
    return radii


def true_steering(terms: Sequence[EffectTerm], reported: Expression) -> Expression:
    """α′ (2,) [rad] from the angles that the encoders report."""
    alpha = ca.SX(reported)
    for term in _of(terms, EffectName.STEERING_OFFSET):
        alpha[STEERING.index(term.where)] -= term["offset"]
    return alpha


def on_radii(complement: Expression, radii: Expression) -> Expression:
    """H_k for wheels that roll on `radii` (4,), from that for the radius of the vehicle file."""
    scale = ca.vertcat(ca.SX.ones(_FIRST_WHEEL), LENGTHS.r / radii)
    return ca.repmat(scale, 1, complement.shape[1]) * complement


def _of(terms: Sequence[EffectTerm], name: EffectName) -> list[EffectTerm]:
    return [term for term in terms if term.name is name]


def _sign(rate: Expression) -> Expression:
    return ca.tanh(rate / EPSILON)


def _at_joints(law: Callable[[EffectTerm, Expression], Expression]) -> Callable[..., Expression]:
    """A friction law of one rate, at every joint of the term's place."""

    def force(term: EffectTerm, state: State, masses: Masses) -> Expression:
        del masses
        rows = ca.SX.zeros(9)
        for row in _ROWS[term.where]:
            rows[row] = law(term, state.rates[row])
        return rows

    return force


def _stribeck(term: EffectTerm, rate: Expression) -> Expression:
    return term["amplitude"] * ca.exp(-((rate / term["velocity"]) ** 2)) * _sign(rate)


def _asymmetric_coulomb(term: EffectTerm, rate: Expression) -> Expression:
    return term["imbalance"] * _sign(rate) ** 2


def _asymmetric_viscous(term: EffectTerm, rate: Expression) -> Expression:
    return term["imbalance"] * rate * _sign(rate)


def _drag(term: EffectTerm, state: State, masses: Masses) -> Expression:
    """v·abs(v) at wheels; at the chassis against its velocity, wherever that points."""
    if term.where in _ROWS:
        return _at_joints(lambda each, rate: each["coefficient"] * rate * ca.fabs(rate))(term, state, masses)
    velocity = state.rates[:2]
    speed = ca.sqrt(ca.sumsqr(velocity) + EPSILON**4)  # the addend keeps the derivative finite at rest
    return ca.vertcat(term["coefficient"] * speed * velocity, ca.SX.zeros(7))


def _payload(term: EffectTerm, state: State, masses: Masses) -> Expression:
    del masses
    linear = term["mass"] * _acceleration_at(ca.SX.zeros(2), state)
    return ca.vertcat(linear, term["inertia"] * state.accelerations[2], ca.SX.zeros(6))


def _scrub(term: EffectTerm, state: State, masses: Masses) -> Expression:
    """Each contact patch resists the turning of its wheel over the floor; the torque is that of the whole place."""
    del masses
    sides = [STEERING.index(term.where)] if term.where in STEERING else [0, 1]
    rows = ca.SX.zeros(9)
    for side in sides:
        for turn in (+1, -1):  # front and rear wheel
            share = term["torque"] / (2 * len(sides)) * _sign(state.rates[2] + turn * state.rates[3 + side])
            rows[2] += share
            rows[3 + side] += turn * share
    return rows


def _steering_unit_mass(term: EffectTerm, state: State, masses: Masses) -> Expression:
    """First-moment coupling of four point masses at the wheel contacts.

    The masses themselves are part of m_ch, and their inertias about the steering axes of C_l, C_r and C_ch; what is
    left is the difference between a mass at the contact and the same mass at the axis, less that inertia.
    """
    del masses
    rows = ca.SX.zeros(9)
    for front, side in CORNERS:
        column = 3 if side > 0 else 4
        axis = ca.vertcat(front * LENGTHS.l / 2, side * LENGTHS.b / 2)
        delta, turn = front * state.alpha[column - 3], state.rates[2] + front * state.rates[column]
        arm = LENGTHS.a * side * ca.vertcat(-ca.sin(delta), ca.cos(delta))
        turning = state.accelerations[2] + front * state.accelerations[column]
        carried = turning * _left_of(arm) - turn**2 * arm
        at_axis = _acceleration_at(axis, state)
        about_axis = _cross(arm, at_axis)
        rows[:2] += carried
        rows[2] += _cross(axis, carried) + about_axis
        rows[column] += front * about_axis
    return term["mass"] * rows


def _eccentricity(term: EffectTerm, state: State, masses: Masses) -> Expression:
    """A quarter of the weight goes up and down with the axle: ∂/∂β of (m g/4) amplitude cos(β + phase)."""
    wheel = WHEEL_PLACES.index(term.where)
    rows = ca.SX.zeros(9)
    quarter = masses.loaded * GRAVITY / 4
    rows[_FIRST_WHEEL + wheel] = -quarter * term["amplitude"] * ca.sin(state.beta[wheel] + term["phase"])
    return rows


def _off_centre(centre: Expression, state: State, masses: Masses) -> Expression:
    """What a centre of mass off the centre changes, C_ch being about the centre of mass."""
    change = _acceleration_at(centre, state) - _acceleration_at(ca.SX.zeros(2), state)
    moment = _cross(centre, _acceleration_at(centre, state))
    return masses.own * ca.vertcat(change, moment, ca.SX.zeros(6))


def _tilted(terms: Sequence[EffectTerm], centre: Expression, state: State, masses: Masses) -> Expression:
    """Weight along the floor: of the vehicle at its centre of mass, of loads at the centre of the chassis."""
    rows = ca.SX.zeros(9)
    for slope in _of(terms, EffectName.SLOPE):
        bearing = slope["direction"] - state.heading
        uphill = GRAVITY * ca.sin(slope["angle"]) * ca.vertcat(ca.cos(bearing), ca.sin(bearing))
        rows[:2] += masses.loaded * uphill
        rows[2] += masses.own * _cross(centre, uphill)
    return rows


def _acceleration_at(point: Expression, state: State) -> Expression:
    """Acceleration (2,) of a point fixed in the chassis, in the chassis frame."""
    x_rate, y_rate, turn = state.rates[0], state.rates[1], state.rates[2]
    origin = ca.vertcat(state.accelerations[0] - y_rate * turn, state.accelerations[1] + x_rate * turn)
    return origin + state.accelerations[2] * _left_of(point) - turn**2 * point


def _left_of(vector: Expression) -> Expression:
    return ca.vertcat(-vector[1], vector[0])


def _cross(first: Expression, second: Expression) -> Expression:
    return first[0] * second[1] - first[1] * second[0]


_FORCES: Final[Mapping[EffectName, Callable[[EffectTerm, State, Any], Expression]]] = MappingProxyType(
    {
        EffectName.STRIBECK: _at_joints(_stribeck),
        EffectName.ASYMMETRIC_COULOMB: _at_joints(_asymmetric_coulomb),
        EffectName.ASYMMETRIC_VISCOUS: _at_joints(_asymmetric_viscous),
        EffectName.QUADRATIC_DRAG: _drag,
        EffectName.PAYLOAD: _payload,
        EffectName.SCRUB: _scrub,
        EffectName.STEERING_UNIT_MASS: _steering_unit_mass,
        EffectName.WHEEL_ECCENTRICITY: _eccentricity,
    }
)
