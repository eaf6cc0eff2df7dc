"""What may be added to the equations of the vehicle, and where each addition enters them.

With additions, (14) reads

    Θ(q, q̇, q̈) p′ + f(q, q̇, q̈, p) = B u′(u, β) + A′(α′, β)ᵀ λ,    A′(α′, β) q̇ = 0

| symbol | here | what adds to it |
|---|---|---|
| p′ | `changed_parameters` | a share of a parameter |
| f | `added_forces` | friction, drag, slope, centre of mass, loads, steering units, scrub, weight on a wheel |
| u′ | `shaft_torques` | what a drive gives beyond what it reports; u is the report |
| A′ | `rolling_radii` | radii on which the wheels roll |
| α′ | `true_steering` | zero errors of the steering encoders; α is the report |

f is linear in q̈: ∂f/∂q̈ is what is added to the mass matrix. Without any addition all are those of the plain model. What
gives way, comes late, follows, bends before it slides or slides has states of its own, or changes what holds the wheels
to the floor: `compliance_at`, `gap_at`, `delay_at`, `lag_at`, `bristles` and `grips` say how much.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Final

import casadi as ca

from ident.plant.symbolic import LENGTHS, Expression
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY

FIRST_WHEEL: Final = 5
"""Row of q of the first wheel; those of the steering are the two before it."""

_NONE: Final[Mapping[str, Expression]] = MappingProxyType({})

Joint = tuple[str, int]
"""Place of an effect, and the row of q of one of its joints."""

_STRAIGHT: Final[Mapping[Joint, Expression]] = MappingProxyType({})


@dataclass(frozen=True)
class State:
    """What additions depend on, symbols or numbers.

    Attributes:
        heading: γ, in the world [rad].
        alpha: (2,) [rad].
        beta: (4,) [rad].
        rates, accelerations: q̇, q̈ (9,), twist in the chassis frame, as in `ident.plant.symbolic`.
        elapsed: time since the start of the campaign [s].
        loads: (4,) torques that the gears of the wheels transmit, at the wheels [Nm].
        bent: how far the bristles of each joint are bent, from -1 to 1 where they slide.
    """

    heading: Expression
    alpha: Expression
    beta: Expression
    rates: Expression
    accelerations: Expression
    elapsed: Expression
    loads: Expression = field(default_factory=lambda: ca.SX.zeros(4))
    bent: Mapping[Joint, Expression] = field(default_factory=dict)


@dataclass(frozen=True)
class Masses:
    """What moves over the floor [kg].

    Attributes:
        own: m_ch, whose centre may be off the centre of the chassis.
        loaded: with loads, which stay over the centre of the chassis.
    """

    own: Expression
    loaded: Expression


class Term:
    """An addition that adds nothing: each kind of addition overrides what it does.

    Attributes:
        of_both_units: whether its forces take front and rear unit of a side as turning alike.
        takes_time: whether it depends on the time since the start of the campaign.
    """

    of_both_units: ClassVar[bool] = False
    takes_time: ClassVar[bool] = False

    def parameter_changes(self, state: State) -> Expression:
        """Shares of the parameters (11,) that are added to them."""
        del state
        return ca.SX(len(PARAMETER_NAMES), 1)

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """Part of f (9,), from p (11,): N, N, Nm in the chassis frame, then Nm at the joints; positive resists."""
        del state, masses, parameters
        return ca.SX(9, 1)

    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """The part of f (9,) that holds a joint at rest as Coulomb friction does [Nm]."""
        del state, parameters
        return ca.SX(9, 1)

    def shaft_torques(self, reported: Expression, beta: Expression) -> Expression:
        """What reaches the motor shafts (4,) beyond the reported torques (4,), at β (4,) of the motors [Nm]."""
        del reported, beta
        return ca.SX(4, 1)

    def radii(self, beta: Expression) -> Expression:
        """What the rolling radii (4,) are larger by, at β (4,) [m]."""
        del beta
        return ca.SX(4, 1)

    def steering_errors(self) -> Expression:
        """Reported minus true steering angles (2,) [rad]."""
        return ca.SX(2, 1)

    def centre(self) -> Expression:
        """What the centre of m_ch (2,) is shifted by [m]."""
        return ca.SX(2, 1)

    def load(self) -> Expression:
        """Mass over the centre beyond m_ch [kg]."""
        return ca.SX(0)

    def uphill(self, heading: Expression) -> Expression:
        """What gravity takes along the floor (2,), in the chassis frame, positive where it holds back [m/s²]."""
        del heading
        return ca.SX(2, 1)

    def compliances(self) -> Mapping[str, Expression]:
        """Twist per torque of gears and couplings, by drive and steering side [rad/Nm]."""
        return _NONE

    def gaps(self) -> Mapping[str, Expression]:
        """Whole play of gears and couplings, by drive and steering side [rad]."""
        return _NONE

    def delays(self) -> Mapping[str, Expression]:
        """Dead times, by drive and encoder [s]."""
        return _NONE

    def lags(self) -> Mapping[str, Expression]:
        """Time constants with which torques follow, by drive [s]."""
        return _NONE

    def bristles(self) -> Mapping[Joint, Expression]:
        """Angles over which bristles bend before they slide, by joint [rad]."""
        return _STRAIGHT


@dataclass(frozen=True)
class Surroundings(Term):
    """Floor and load as inputs: the floor rises along the world's x and y; the load has no inertia of its own.

    Attributes:
        slope_x, slope_y: angles [rad].
        payload: [kg].
    """

    slope_x: Expression
    slope_y: Expression
    payload: Expression

    def load(self) -> Expression:
        """The payload."""
        return self.payload

    def uphill(self, heading: Expression) -> Expression:
        """Of both slopes."""
        return pull(self.slope_x, -heading) + pull(self.slope_y, ca.pi / 2 - heading)

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """Inertia of the payload."""
        del masses, parameters
        return ca.vertcat(self.payload * acceleration_at(ca.SX.zeros(2), state), ca.SX(7, 1))


def changed_parameters(terms: Sequence[Term], parameters: Expression, state: State) -> Expression:
    """p′ (11,)."""
    return ca.SX(parameters) * sum((term.parameter_changes(state) for term in terms), ca.SX.ones(len(PARAMETER_NAMES)))


def added_forces(terms: Sequence[Term], state: State, parameters: Expression, held: State | None = None) -> Expression:
    """f (9,): N, N, Nm in the chassis frame, then Nm at steering axes and wheels; positive where it resists.

    Args:
        terms: additions; those without forces add none.
        state: of the vehicle.
        parameters: p (11,); a slope acts on the mass that is there, so loads are added here.
        held: the state with the rates that dry friction sees, where it remembers; None where it does not.
    """
    own = parameters[PARAMETER_NAMES.index("m_ch")]
    masses = Masses(own, own + loaded_mass(terms))
    total = sum((term.forces(state, masses, parameters) for term in terms), ca.SX.zeros(9))
    total += sum((term.dry_friction(held or state, parameters) for term in terms), ca.SX.zeros(9))
    centre = centre_of_mass(terms)
    uphill = sum((term.uphill(state.heading) for term in terms), ca.SX(2, 1))
    weight = ca.vertcat(masses.loaded * uphill, masses.own * cross(centre, uphill), ca.SX(6, 1))
    return total + _off_centre(centre, state, masses) + weight


def loaded_mass(terms: Sequence[Term]) -> Expression:
    """Mass over the centre beyond m_ch [kg]."""
    return sum((term.load() for term in terms), ca.SX(0))


def centre_of_mass(terms: Sequence[Term]) -> Expression:
    """Where m_ch has its centre (2,); shifts add up first, for the inertia that they make goes by the square."""
    return sum((term.centre() for term in terms), ca.SX.zeros(2))


def shaft_torques(terms: Sequence[Term], reported: Expression, beta: Expression) -> Expression:
    """u′ (4,) [Nm] at the motor shafts, from the torques that the drives report and β (4,)."""
    return sum((term.shaft_torques(reported, beta) for term in terms), ca.SX(reported))


def rolling_radii(terms: Sequence[Term], beta: Expression) -> Expression:
    """Radii (4,) [m] on which the wheels roll at β (4,)."""
    return sum((term.radii(beta) for term in terms), LENGTHS.r * ca.SX.ones(4))


def true_steering(terms: Sequence[Term], reported: Expression) -> Expression:
    """α′ (2,) [rad] from the angles that the encoders report."""
    return ca.SX(reported) - steering_errors(terms)


def steering_errors(terms: Sequence[Term]) -> Expression:
    """Reported minus true steering angles (2,) [rad]."""
    return sum((term.steering_errors() for term in terms), ca.SX.zeros(2))


def compliance_at(terms: Sequence[Term], place: str) -> Expression:
    """Twist per torque of the gear of a drive or the coupling of a steering side [rad/Nm]."""
    return sum((term.compliances().get(place, 0.0) for term in terms), ca.SX(0))


def gap_at(terms: Sequence[Term], place: str) -> Expression:
    """Whole play of the gear of a drive or the coupling of a steering side [rad]."""
    return sum((term.gaps().get(place, 0.0) for term in terms), ca.SX(0))


def delay_at(terms: Sequence[Term], place: str) -> Expression:
    """Dead time of a drive or an encoder [s]."""
    return sum((term.delays().get(place, 0.0) for term in terms), ca.SX(0))


def lag_at(terms: Sequence[Term], place: str) -> Expression:
    """Time constant with which the torque of a drive follows [s]."""
    return sum((term.lags().get(place, 0.0) for term in terms), ca.SX(0))


def on_radii(complement: Expression, radii: Expression) -> Expression:
    """H_k for wheels that roll on `radii` (4,), from that for the radius of the vehicle file."""
    scale = ca.vertcat(ca.SX.ones(FIRST_WHEEL), LENGTHS.r / radii)
    return ca.repmat(scale, 1, complement.shape[1]) * complement


def pull(angle: Expression, bearing: Expression) -> Expression:
    """Gravity along a floor (2,), positive where it holds back, in a frame in which uphill is at `bearing` [m/s²]."""
    return GRAVITY * ca.sin(angle) * ca.vertcat(ca.cos(bearing), ca.sin(bearing))


def acceleration_at(point: Expression, state: State) -> Expression:
    """Acceleration (2,) of a point fixed in the chassis, in the chassis frame."""
    x_rate, y_rate, turn = state.rates[0], state.rates[1], state.rates[2]
    origin = ca.vertcat(state.accelerations[0] - y_rate * turn, state.accelerations[1] + x_rate * turn)
    return origin + state.accelerations[2] * left_of(point) - turn**2 * point


def left_of(vector: Expression) -> Expression:
    """A vector (2,) turned by a quarter to the left."""
    return ca.vertcat(-vector[1], vector[0])


def cross(first: Expression, second: Expression) -> Expression:
    """The z component of the product of two vectors (2,)."""
    return first[0] * second[1] - first[1] * second[0]


def _off_centre(centre: Expression, state: State, masses: Masses) -> Expression:
    """What a centre of mass off the centre changes, C_ch being about the centre of mass."""
    change = acceleration_at(centre, state) - acceleration_at(ca.SX.zeros(2), state)
    moment = cross(centre, acceleration_at(centre, state))
    return masses.own * ca.vertcat(change, moment, ca.SX.zeros(6))
