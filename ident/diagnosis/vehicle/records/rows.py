"""Rows of the kinematic and dynamic channel with effects in them, generated from the symbolic model.

Both are written as what must be zero: with p the parameters, θ the effects' numbers, and z what was measured,

    dynamic    H_k′ᵀ (Θ′ p′ + f - B u′)                               generalized force
    kinematic  (1 - A_ch′ A_ch′⁺) (A_α α̇′ + A_β′ β̇), longitudinal rows   velocity

so that baseline, target and the columns of effects are derivatives of one expression; gains of drives apart, whose
columns have torques without the noise of the rows where motors share one (docs/adr/0024).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.records.inputs import Inputs, symbolic_inputs
from ident.effects import EffectTerm, effect_term, symbolic_term
from ident.estimate.equations import RowsOfStep
from ident.plant import symbolic
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.modes import Mode
from ident.plant.symbolic import CORNERS, LENGTHS, Expression
from ident.plant.terms import (
    State,
    added_forces,
    changed_parameters,
    on_radii,
    rolling_radii,
    shaft_torques,
    true_steering,
)
from ident.plant.vectorised import Vectorised
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

_OF_TORQUES: Final = (EffectName.TORQUE_GAIN, EffectName.FRICTION_LOAD)
"""Effects whose columns are made of torques."""

DIFFERENCES: Final = ("front_rear_left", "front_rear_right", "left_right")
"""What wheels that drive a rigid vehicle can disagree in: [m/s] at the floor."""

_SENSES: Final = {
    Mode.STEERED: (+1, +1, +1, +1),
    Mode.ROTATION: (-1, -1, +1, +1),
    Mode.LATERAL: (-1, +1, +1, -1),
}
"""Sense in which each wheel rolls when the mode's coordinate moves forward."""


@dataclass(frozen=True)
class OwnRows:
    """Rows that are signals themselves, of which the model says nothing: what shows there is all of a cause.

    Attributes:
        coordinates: names, a block each.
        columns: of the signals.
        lever: what they are multiplied with [m].
        untold: part that may stay unexplained [-].
        other: what may be no motion of theirs in any case, in the unit of the signals.
    """

    coordinates: tuple[str, ...]
    columns: tuple[int, ...]
    lever: float
    untold: float
    other: float = 0.0

    def of(self, inputs: Array) -> Array:
        """The rows (N, rows) [m] of signals (N, INPUTS)."""
        return np.asarray(self.lever * inputs[:, self.columns])


def dynamic_coordinates(spec: RowsOfStep) -> tuple[str, ...]:
    """Names of the dynamic rows of a mode, or of wheels in the air."""
    return tuple(f"beta_{wheel}" for wheel in WHEELS) if spec.mode is None else GENERALIZED_VELOCITIES[spec.mode]


def kinematic_coordinates(spec: RowsOfStep) -> tuple[str, ...]:
    """Names of the kinematic rows of a step."""
    if spec.mode is None:
        return ()
    if spec.mode is Mode.ALIGNMENT:
        side = spec.coordinates[0].removeprefix("alpha_")
        return tuple(f"roll_{wheel}" for wheel in WHEELS if wheel.endswith(side))
    return DIFFERENCES


def dynamic_rows(mode: Mode | None, z: Inputs, parameters: Expression, terms: Sequence[EffectTerm]) -> Expression:
    """Generalized forces that must sum to zero, (n_k,), or (4,) with the wheels in the air."""
    known = effect_term(EffectName.PAYLOAD, "chassis", {"mass": z.payload, "inertia": 0.0})
    terms = [*terms, known]
    alpha, radii = true_steering(terms, z.alpha), rolling_radii(terms, z.beta)
    rates, accelerations = _lifted(z) if mode is None else _on_the_floor(z, alpha, radii)
    shaft = shaft_torques(terms, z.torques, z.beta)
    # Repeats are averaged, so that nothing here depends on when it was driven: names.refuse_strangers.
    state = State(z.heading, alpha, z.beta, rates, accelerations, ca.SX(0), LENGTHS.i_G * shaft)
    parameters = changed_parameters(terms, parameters, state)
    inertial = symbolic.regressor(rates, accelerations) @ parameters
    driving = symbolic.input_matrix() @ shaft - ca.vertcat(ca.SX.zeros(3), z.bristles)
    if mode is None:
        # No weight rests on a wheel in the air.
        weightless = [term for term in terms if term.name != EffectName.WHEEL_ECCENTRICITY]
        return (inertial + added_forces(weightless, state, parameters) - driving)[5:]
    total = inertial + added_forces(terms, state, parameters) - driving
    return on_radii(symbolic.complement(mode, alpha), radii).T @ total


def kinematic_rows(spec: RowsOfStep, z: Inputs, terms: Sequence[EffectTerm]) -> Expression:
    """Velocities that rolling wheels do not have, in `kinematic_coordinates` [m/s]."""
    return _rolling(spec, z, terms, rolling_radii(terms, z.beta))


def _rolling(spec: RowsOfStep, z: Inputs, terms: Sequence[EffectTerm], radii: Expression) -> Expression:
    """The same on any radii (4,)."""
    residual = _slip(z, true_steering(terms, z.alpha), radii)
    return ca.vertcat(*_in_coordinates([residual[wheel] for wheel in range(len(WHEELS))], spec))


def _in_coordinates(wheels: Sequence[Expression], spec: RowsOfStep) -> list[Expression]:
    """One quantity of the four wheels as the `kinematic_coordinates` of a step."""
    if spec.mode is Mode.ALIGNMENT:
        return [wheels[WHEELS.index(name[-2:])] for name in kinematic_coordinates(spec)]
    assert spec.mode is not None
    fl, rl, fr, rr = (sense * wheels[wheel] for wheel, sense in enumerate(_SENSES[spec.mode]))
    return [(fl - rl) / np.sqrt(2), (fr - rr) / np.sqrt(2), (fl + rl - fr - rr) / 2]


def _slip(z: Inputs, alpha: Expression, radii: Expression) -> Expression:
    """Longitudinal rows (4,) of (1) that no twist of the chassis satisfies."""
    headings, rates = symbolic.wheel_headings(alpha), symbolic.wheel_headings(z.alpha_rate)
    rolled = []
    for wheel, (front, side) in enumerate(CORNERS):
        if front < 0:
            headings[wheel] += z.twist[0 if side > 0 else 1]
            rates[wheel] += z.twist_rate[0 if side > 0 else 1]
        rolled.append(-LENGTHS.a * side * rates[wheel] - radii[wheel] * z.beta_rate[wheel])
    contacts = symbolic.contact_rows(headings)
    measured = ca.vertcat(ca.SX.zeros(4), *rolled)
    return (measured - contacts @ ca.solve(contacts.T @ contacts, contacts.T @ measured))[4:]


def _lifted(z: Inputs) -> tuple[Expression, Expression]:
    still = ca.SX.zeros(3)
    return ca.vertcat(still, z.alpha_rate, z.beta_rate), ca.vertcat(still, z.alpha_acceleration, z.beta_acceleration)


def _on_the_floor(z: Inputs, alpha: Expression, radii: Expression) -> tuple[Expression, Expression]:
    """q̇, q̈ with the twist by odometry (3) on the true radii and angles."""
    A = symbolic.constraint_matrix(alpha)
    chassis, steering = A[:, :3], A[:, 3:5] @ z.alpha_rate
    rolling = ca.vertcat(ca.SX.zeros(4), -radii * z.beta_rate)
    twist = -ca.solve(chassis.T @ chassis, chassis.T @ (steering + rolling))
    twist_rate = (
        ca.jtimes(twist, z.alpha, z.alpha_rate)
        + ca.jtimes(twist, z.beta, z.beta_rate)
        + ca.jtimes(twist, z.alpha_rate, z.alpha_acceleration)
        + ca.jtimes(twist, z.beta_rate, z.beta_acceleration)
    )
    return (
        ca.vertcat(twist, z.alpha_rate, z.beta_rate),
        ca.vertcat(twist_rate, z.alpha_acceleration, z.beta_acceleration),
    )


MODEL_COLUMNS: Final = 1 + len(PARAMETER_NAMES)
"""Columns of a table before those of the causes: residual at p = 0, then Θ."""


@dataclass(frozen=True, eq=False)
class UnitTerm:
    """A term that is linear in one number: what one column of a candidate stands for. Equal to none but itself.

    Attributes:
        term: with symbols in it.
        symbol: the number.
    """

    term: EffectTerm
    symbol: Expression


class Formulas:
    """The rows as numpy functions, made when they are first needed.

    Args:
        given: effects that are known to be there, part of the model itself.
        units: every term that a column may be asked of.
    """

    def __init__(self, given: Sequence[EffectTerm] = (), units: Sequence[UnitTerm] = ()) -> None:
        self._given, self._units = tuple(given), tuple(units)
        self._numbers = {unit: MODEL_COLUMNS + number for number, unit in enumerate(units)}
        self._exact: dict[tuple[Channel, RowsOfStep, EffectName | None, str], Vectorised] = {}
        self._rolled: dict[RowsOfStep, Vectorised] = {}
        self._whole: dict[tuple[Channel, RowsOfStep], Vectorised] = {}
        self._linearised: dict[tuple[Channel, RowsOfStep, tuple[UnitTerm, ...]], Vectorised] = {}

    def linearised(self, channel: Channel, spec: RowsOfStep, units: Sequence[UnitTerm]) -> Vectorised:
        """(z, geometry, ε, p, p₀) -> (N, rows, 12 + units): the rows at p = 0, then ∂/∂p, then ∂/∂unit.

        In columns of gains and of friction under load stand the torques that the rows ask for by p₀, where motors share
        a row.

        Raises:
            KeyError: a unit is none of those that the formulas were made with.
        """
        key = (channel, spec, tuple(units))
        if key not in self._linearised:
            columns = [*range(MODEL_COLUMNS), *(self._numbers[unit] for unit in units)]
            self._linearised[key] = self._with_all(channel, spec).only(columns)
        return self._linearised[key]

    def _with_all(self, channel: Channel, spec: RowsOfStep) -> Vectorised:
        """The same of all units: deriving the equations takes longer than leaving out what is not asked for."""
        key = (channel, spec)
        if key not in self._whole:
            z, p = symbolic_inputs(), ca.SX.sym("p", len(PARAMETER_NAMES))
            rows = _rows(channel, spec, z, p, [*(unit.term for unit in self._units), *self._given])
            self._whole[key] = _linearise(rows, z, p, self._units, shared=spec.mode is not None)
        return self._whole[key]

    def exact(self, channel: Channel, spec: RowsOfStep, name: EffectName | None = None, where: str = "") -> Vectorised:
        """(z, geometry, ε, p, values) -> (N, rows, 1): the rows of a step with one effect more, or with none."""
        key = (channel, spec, name, where)
        if key not in self._exact:
            z, p = symbolic_inputs(), ca.SX.sym("p", len(PARAMETER_NAMES))
            terms = [] if name is None else [symbolic_term(name, where)]
            rows = _rows(channel, spec, z, p, [*terms, *self._given])
            values = ca.vertcat(*(value for term in terms for value in term.values.values()))
            inputs = [z.all, symbolic.GEOMETRY, symbolic.EPSILON, p, values]
            self._exact[key] = Vectorised(ca.Function("rows", inputs, [ca.cse(ca.densify(rows))]))
        return self._exact[key]

    def rolled(self, spec: RowsOfStep) -> Vectorised:
        """(z, geometry, ε) -> (N, rows, 4): the rolling rows of a step over the radii of the wheels."""
        if spec not in self._rolled:
            z, radii = symbolic_inputs(), ca.SX.sym("radii", len(WHEELS))
            rows = _rolling(spec, z, self._given, radii)
            inputs = [z.all, symbolic.GEOMETRY, symbolic.EPSILON]
            function = ca.Function("rolled", inputs, [ca.cse(ca.densify(ca.jacobian(rows, radii)))])
            self._rolled[spec] = Vectorised(function)
        return self._rolled[spec]


def coordinates(channel: Channel, spec: RowsOfStep) -> tuple[str, ...]:
    """Names of the rows that a step has in a channel."""
    return spec.coordinates if channel is Channel.DYNAMIC else kinematic_coordinates(spec)


def _rows(channel: Channel, spec: RowsOfStep, z: Inputs, p: Expression, terms: Sequence[EffectTerm]) -> Expression:
    if channel is Channel.KINEMATIC:
        return kinematic_rows(spec, z, terms)
    names, rows = dynamic_coordinates(spec), dynamic_rows(spec.mode, z, p, terms)
    return ca.vertcat(*(rows[names.index(name)] for name in spec.coordinates))


def _asked_for(rows: Expression, torques: Expression) -> Expression:
    """The torques nearest to the measured ones for which the rows hold.

    Measured ones carry the noise of the rows: a column of them would cancel it, and be fitted to do that.
    """
    driving = ca.jacobian(rows, torques)
    return torques - driving.T @ ca.solve(driving @ driving.T, rows)


def _linearise(rows: Expression, z: Inputs, p: Expression, units: Sequence[UnitTerm], *, shared: bool) -> Vectorised:
    """`shared`: whether a row is driven by several motors."""
    asking = ca.SX.sym("asking", p.shape[0])
    symbols = ca.vertcat(*(unit.symbol for unit in units))
    nothing, zero = ca.SX.zeros(symbols.shape[0]), ca.SX.zeros(p.shape[0])
    plain = ca.substitute(rows, symbols, nothing)
    columns = ca.substitute(ca.jacobian(rows, symbols), symbols, nothing)
    gains = [index for index, unit in enumerate(units) if unit.term.name in _OF_TORQUES]
    if gains and shared and ca.depends_on(columns, z.torques):
        asked = _asked_for(ca.substitute(plain, p, asking), z.torques)
        columns[:, gains] = ca.substitute(columns[:, gains], z.torques, asked)
    table = ca.horzcat(ca.substitute(plain, p, zero), ca.jacobian(plain, p), columns)
    inputs = [z.all, symbolic.GEOMETRY, symbolic.EPSILON, p, asking]
    return Vectorised(ca.Function("rows", inputs, [ca.cse(ca.sparsify(table))]))
