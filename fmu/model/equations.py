"""The model of the FMU as one ordinary differential equation, its outputs and its event indicators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from fmu.effect_states import coupled_states, memories_of
from fmu.model.delays import filter_rates, late_angles, late_torques
from fmu.model.drives import DRIVES
from fmu.model.motion import acceleration, motion_of, motor_wrench
from fmu.model.stiction import memory_rates
from fmu.model.symbols import Symbols, bound, dynamic_parameters
from fmu.model.transmissions import (
    Springs,
    at_motors,
    couplings_of,
    gears_of,
    transmitted_torques,
    twist_accelerations,
)
from fmu.parameter_rows import effect_parameter
from fmu.variables import Block, Inputs, VariableTable
from ident.vehicle import effect_terms
from ident.vehicle.effect_terms import TERMS, EffectTerm
from ident.vehicle.effects import Effect, EffectName
from ident.vehicle.symbolic import Expression


@dataclass(frozen=True)
class Equations:
    """Symbols and what is computed from them, in the order of the table.

    Attributes:
        x, u, p: states, inputs and parameters.
        xd: derivatives of x.
        y: outputs.
        z: event indicators (4,); the mode is 4 where z[0] < 0, else 3 where z[1] < 0, else 2 where z[2] and z[3] are
            negative, else 1.
        coupled: how many of the first states, the rates, the equations couple; the solver eliminates the others.
    """

    x: Expression
    u: Expression
    p: Expression
    xd: Expression
    y: Expression
    z: Expression
    coupled: int


def equations(table: VariableTable, effects: Sequence[Effect], inputs: Inputs) -> Equations:
    """The equations for a table of variables, and the effects and inputs that it was made for."""
    x, u, p = (Symbols(block.value, table.block(block)) for block in (Block.STATE, Block.INPUT, Block.PARAMETER))
    terms = _terms(effects, u, p)
    memories, springs = memories_of(effects), Springs(effects, p)
    parameters = effect_terms.changed_parameters(terms, dynamic_parameters(p))
    couplings = couplings_of(x, springs, memories, parameters)
    gears = gears_of(x, springs, memories, parameters)
    motion = motion_of(x, p, terms, parameters, couplings)
    alpha, rates = motion.state.alpha, motion.state.rates
    motor_angles = at_motors(gears, motion.state.beta, "twist")
    motor_rates = at_motors(gears, rates[5:], "rate")
    torques, integral_rates = DRIVES[inputs](motor_rates, x, u, p)
    shaft = effect_terms.shaft_torques(terms, late_torques(x, p, memories, torques), motor_angles)
    accelerations = acceleration(motion, p, transmitted_torques(gears, shaft), gears)
    slope_rates, filtered_rates = filter_rates(x, p, memories, torques, rates[3:5])
    xd = ca.vertcat(
        accelerations,
        twist_accelerations(gears, shaft, accelerations[5:9]),
        slope_rates,
        memory_rates(x, p, rates),
        integral_rates,
        *(coupling.rate for coupling in couplings),
        *(gear.rate for gear in gears),
        filtered_rates,
        rates[3:],
        _pose_rate(motion.state.heading, rates),
    )
    reported = late_angles(x, p, memories, 2 * alpha - effect_terms.true_steering(terms, alpha))
    slip = motion.slip
    at_shafts = (angle for gear in gears for angle in (motor_angles[gear.wheel], motor_rates[gear.wheel]))
    y = ca.vertcat(reported, torques, slip[4:], slip[:4], motor_wrench(motion, shaft), *at_shafts)
    distances = bound(_mode_distances(alpha, p), p)
    coupled = rates.numel() + len(coupled_states(memories))
    return Equations(x.vector, u.vector, p.vector, bound(xd, p), bound(y, p), distances, coupled)


def _terms(effects: Sequence[Effect], u: Symbols, p: Symbols) -> list[EffectTerm]:
    """The effects with the parameters of the table, and those that the inputs are."""
    named = [
        EffectTerm(effect.name, effect.where, {name: p[effect_parameter(effect, name)] for name in effect.parameters})
        for effect in effects
        if effect.name in TERMS
    ]
    slope, payload = EffectName.SLOPE, EffectName.PAYLOAD
    return [
        *named,
        EffectTerm(slope, "chassis", {"angle": u["slope_x"], "direction": ca.SX(0)}),
        EffectTerm(slope, "chassis", {"angle": u["slope_y"], "direction": ca.SX(ca.pi / 2)}),
        EffectTerm(payload, "chassis", {"mass": u["payload"], "inertia": ca.SX(0)}),
    ]


def _pose_rate(heading: Expression, rates: Expression) -> Expression:
    """Rates of heading, x and y in the world."""
    cos, sin = ca.cos(heading), ca.sin(heading)
    return ca.vertcat(rates[2], cos * rates[0] - sin * rates[1], sin * rates[0] + cos * rates[1])


def _mode_distances(alpha: Expression, p: Symbols) -> Expression:
    """The conditions of (9) as `ident.vehicle.modes.detect_mode` has them, in a form without poles."""
    half_l, b, tolerance = p["wheelbase"] / 2, p["track_width"], p["mode_tolerance"]
    left, right = alpha[0], alpha[1]
    rotation_angle = ca.atan2(p["wheelbase"], b)

    def distance(angle: Expression) -> Expression:
        return ca.fmax(ca.fabs(left + angle), ca.fabs(right - angle)) - tolerance

    sin_l, cos_l, sin_r, cos_r = ca.sin(left), ca.cos(left), ca.sin(right), ca.cos(right)
    residual = half_l * ca.sin(right - left) + b * sin_l * sin_r
    by_left = -half_l * ca.cos(right - left) + b * cos_l * sin_r
    by_right = half_l * ca.cos(right - left) + b * sin_l * cos_r
    off_centre = ca.fabs(residual) - tolerance * ca.sqrt(by_left**2 + by_right**2)
    lever_l, lever_r = half_l * cos_l + b / 2 * sin_l, half_l * cos_r - b / 2 * sin_r
    inside_track = ca.fabs(sin_l * lever_r + sin_r * lever_l) - 4 / b * ca.fabs(lever_l * lever_r)
    return ca.vertcat(distance(rotation_angle), distance(ca.pi / 2), off_centre, inside_track)
