"""Possible causes of the gap of an axis, as columns beside M a + Fv v + Fc sign(v) + offset.

Written from the literature of servo axes: Stribeck's curve and asymmetric friction (Armstrong-Hélouvry, Dupont, Canudas
de Wit 1994), friction of two joints that share a shaft (Gautier, Janot, Vandanjon: Stäubli TX 40).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.memories import friction_load, friction_warming, presliding, torque_filter
from ident.diagnosis.axis.model import AxisEffect, AxisModel, linear, shaped_by
from ident.diagnosis.axis.motion import AxisMotion
from ident.diagnosis.axis.positional import friction_position, gravity_loads, inertia_position
from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.delays import DAMPING, HELD, delayed, sprung
from ident.diagnosis.observations.periodogram import FEWEST
from ident.diagnosis.observations.tried import RATIO, tried_between
from ident.diagnosis.problem import Candidate, Periodic, Variant
from ident.effects import EffectParameter
from ident.estimate.filters import SEVEN, differentiate
from ident.plant.play import behind_play
from ident.records.axis_record import AxisKind

Array = NDArray[np.float64]

RESONANCES: Final = (*(0.8 * 1.1**step for step in range(13)), 3.2, 4.5, 20.0)
"""Tried first, over the bandwidth of the rows; the last is a spring that shows as a compliance alone. Near the band the
rows hold the resonance itself, in a valley that is a tenth wide: from beside it a descent ends elsewhere."""
SHARE: Final = 1 / math.sqrt(12)
"""Standard deviation of the share of the inertia that is behind a spring: anything between none and all."""
LEAST_DAMPING: Final = 0.002
USUAL_DAMPING: Final = 0.02
"""Of what is behind a spring, over the critical damping: from 0.002 of solid steel by way of screwed joints to 0.2 of
belts and wave gears."""
DAMPINGS: Final = math.log(10.0) / 2
"""Standard deviation of its logarithm."""
SAMPLED: Final = 1 / 2
"""Of T²/M, the compliance up to which sampling may be what it is: when within a sample interval the effort acts and the
position is read is not known, and a delay of T has (sT)²/2 in second order. Errors of the position make negative ones,
up to all of it."""
WIDEST_GAP: Final = 0.1
"""Over the range of the position: more than that a motion hardly crosses before it reverses again."""
RESTING: Final = 0.998
"""Part of half a gap from which a side is pushed: an axis that rests there moves a little to and fro."""
BETWEEN: Final = math.log(RATIO) / math.sqrt(12)
"""Of a gap, as part of it: it may lie anywhere between two that are tried."""
LEAST_SHARE: Final = 0.1
"""Of the effort that must lie behind a play for it to be one."""

BETWEEN_SAMPLES: Final = 0.004
"""Part of a sampling interval to which a delay can be told at best, beyond the scatter of the rows.

How an effort goes between its samples is in no record. On 48 axes of opened exams, the 17 whose rows scattered by less
than 0.003 were wrong by 0.0035 rms.
"""


def axis_candidates(axis: AxisModel) -> list[Candidate]:
    """Every cause that the library has for an axis."""
    return [*(make(axis) for make in _LIBRARY), *gravity_loads(axis), *_coupled_friction(axis)]


def _asymmetric_viscous(axis: AxisModel) -> Candidate:
    unit = axis.unit(" s/q")
    parameter = EffectParameter("imbalance", unit, "friction is Fv + imbalance forward, Fv - imbalance backward")
    return linear(axis, EffectName.ASYMMETRIC_VISCOUS, [parameter], np.abs(axis.motion.velocity))


def _asymmetric_coulomb(axis: AxisModel) -> Candidate:
    parameter = EffectParameter("imbalance", axis.unit(), "friction is Fc + imbalance forward, Fc - imbalance backward")
    return linear(axis, EffectName.ASYMMETRIC_COULOMB, [parameter], np.sign(axis.motion.velocity) ** 2)


def _torque_bias(axis: AxisModel) -> Candidate:
    parameter = EffectParameter("bias", axis.unit(), "effort beyond the effort reported")
    return linear(axis, EffectName.TORQUE_BIAS, [parameter], -np.ones_like(axis.effort))


def _torque_gain(axis: AxisModel) -> Candidate:
    parameter = EffectParameter("error", "1", "effort is (1 + error) times the effort reported")
    return linear(axis, EffectName.TORQUE_GAIN, [parameter], -axis.absorbed)


def _payload(axis: AxisModel) -> Candidate:
    unit = "kg" if axis.kind is AxisKind.LINEAR else "kg m^2"
    parameter = EffectParameter("mass", unit, "inertia that the model does not have")
    return linear(axis, EffectName.PAYLOAD, [parameter], axis.motion.linear[:, 0])


def _quadratic_drag(axis: AxisModel) -> Candidate:
    parameter = EffectParameter("coefficient", axis.unit(" s^2/q^2"), "resistance is coefficient times v abs(v)")
    velocity = axis.motion.velocity
    return linear(axis, EffectName.QUADRATIC_DRAG, [parameter], velocity * np.abs(velocity))


def _gravity(axis: AxisModel) -> Candidate:
    """A tilted axis, or a centre of mass beside the axis of rotation."""
    position = axis.motion.position
    if axis.kind is AxisKind.LINEAR:
        parameter = EffectParameter("force", "N", "of gravity along the axis")
        return linear(axis, EffectName.SLOPE, [parameter], np.ones_like(position))
    parameters = [
        EffectParameter("sine", "Nm", "moment of gravity, times the sine of the angle"),
        EffectParameter("cosine", "Nm", "moment of gravity, times the cosine of the angle"),
    ]
    return linear(axis, EffectName.COM_OFFSET, parameters, np.sin(position), np.cos(position))


def _stribeck(axis: AxisModel) -> Candidate:
    velocity = axis.motion.velocity

    def curve(speed: float) -> Array:
        return np.asarray(np.sign(velocity) * np.exp(-np.square(velocity / speed)))

    parameters = (
        EffectParameter("amplitude", axis.unit(), "friction at rest beyond the Coulomb friction"),
        EffectParameter(
            "velocity", f"{axis.kind.position_unit}/s", "speed at which it has fallen to 1/e", positive=True
        ),
    )
    # At half the speed that hardly a row is below, all rows have lost it, but what they miss near a reversal looks so.
    slowest = axis.slowest / 2
    candidate = shaped_by(axis, EffectName.STRIBECK, parameters, curve, tried_between(axis.slowest, axis.speed))
    return replace(candidate, lowest=(0.0, slowest))


def _time_delay(axis: AxisModel) -> Candidate:
    contribution, turned = axis.answered(lambda values, effort: delayed(effort, -float(values[0]), axis.sample_time))
    parameters = (EffectParameter("delay", "s", "of the motion behind the effort, as reported"),)
    slope = differentiate(axis.effort, axis.sample_time, SEVEN)
    variants = (Variant(axis.alone(slope[:, None])),)
    shortest = HELD * axis.sample_time
    return Candidate(
        EffectName.TIME_DELAY,
        axis.place,
        parameters,
        variants,
        contribution,
        turned=turned,
        negligible=(shortest, shortest),
        spread=(BETWEEN_SAMPLES * axis.sample_time,),
    )


def _elasticity(axis: AxisModel) -> Candidate:
    """A load on a spring: u = M q'' + ... + c M ω²/(1 - (ω/ω_a)²) M q''; far below ω_a, only c is seen."""
    force, slowest = axis.inertia * axis.motion.acceleration, RESONANCES[0] * axis.bandwidth

    def within(resonance: float) -> float:
        return float(np.clip(abs(resonance), slowest, RESONANCES[-1] * axis.bandwidth))

    def series(resonance: float, damping: float = DAMPING) -> Array:
        return axis.inertia * sprung(force, within(resonance), axis.sample_time, max(abs(damping), LEAST_DAMPING))

    def heavier(baseline: Array) -> float:
        return float((baseline[axis.first] / axis.inertia) ** 2)

    def expected(values: Array) -> Array:
        """Of all inertia, what is behind the spring is c M ω_a², anything between nothing and all."""
        share = max(values[0], 0.0) * abs(axis.inertia) * within(values[1]) ** 2
        damping = math.log(max(abs(values[2]), LEAST_DAMPING) / USUAL_DAMPING)
        return np.array([(share - 0.5) / SHARE, damping / DAMPINGS])

    unit = f"{axis.kind.position_unit}/{axis.kind.effort_unit}"
    meaning = "between drive and load, all inertia behind it; negative where the position is measured behind it"
    parameters = (
        EffectParameter("compliance", unit, meaning),
        EffectParameter("resonance", "rad/s", "of the load, the drive held", positive=True),
    )
    sampling = axis.sample_time**2 / abs(axis.inertia)
    tried = [share * axis.bandwidth for share in RESONANCES]
    price = math.log(len(tried))
    candidate = shaped_by(
        axis, EffectName.ELASTICITY, parameters, series, tried, along=[DAMPING], price=price, scale=heavier
    )
    return replace(candidate, negligible=(sampling, SAMPLED * sampling), expected=expected)


def _backlash(axis: AxisModel) -> Candidate:
    """While the drive crosses the gap after a reversal, the load and its friction are not felt."""

    def missing(gap: float) -> Array:
        return np.asarray(-axis.effort * in_gap(axis.motion.position, gap))

    def variant(gap: float) -> Variant:
        return Variant(axis.alone(missing(gap)[:, None]), lambda found: np.array([gap, *found]))

    parameters = (
        EffectParameter("gap", axis.kind.position_unit, "whole play"),
        EffectParameter("share", "1", "of the effort that lies behind it"),
    )
    variants = tuple(map(variant, tried_between(RATIO * axis.nearest, WIDEST_GAP * axis.reach)))
    _, force = axis.exactly(lambda values, _baseline: values[1] * missing(float(values[0])))
    return Candidate(
        EffectName.BACKLASH, axis.place, parameters, variants, force=force, least=LEAST_SHARE, part=BETWEEN
    )


def in_gap(position: Array, gap: float) -> Array:
    """1 where a position (N,) is on its way across a gap after a reversal, 0 where it pushes one of its sides."""
    behind = behind_play(position, gap / 2, float(position[0]))
    return np.where(np.abs(position - behind) < RESTING * gap / 2, 1.0, 0.0)


def _torque_ripple(axis: AxisModel) -> Candidate:
    """A sine and a cosine of the position; cogging of a motor, pitch of a screw or of teeth."""
    turn = 2 * np.pi if axis.kind is AxisKind.ROTARY else 1.0
    angle = 2 * np.pi * axis.motion.position / turn

    def added(values: Array, _baseline: Array) -> Array:
        return np.asarray(values[0] * np.sin(values[1] * angle + values[2]))

    def start(order: float) -> Callable[[Array], Array]:
        return lambda found: np.array([np.hypot(*found), order * turn / (2 * np.pi), np.arctan2(found[1], found[0])])

    parameters = (
        EffectParameter("amplitude", axis.unit(), "not reported by the drive"),
        EffectParameter("order", "1" if axis.kind is AxisKind.ROTARY else "1/m", "periods a turn, or a metre"),
        EffectParameter("phase", "rad", "at position zero"),
    )
    fewest = FEWEST * turn / axis.reach
    slowest = np.stack([np.sin(fewest * angle), np.cos(fewest * angle)], axis=1)
    return Candidate(
        EffectName.TORQUE_RIPPLE,
        axis.place,
        parameters,
        (Variant(axis.alone(slowest), start(2 * np.pi * fewest / turn)),),
        *axis.exactly(added),
        lowest=(0.0, fewest, 0.0),
        periodic=Periodic(f"law_angle@{axis.place}", start),
    )


def _coupled_friction(axis: AxisModel) -> list[Candidate]:
    """Friction that follows another axis' speed, or the sum or difference of both where the two share a shaft."""
    return [_coupled_with(axis, name, other) for name, other in axis.others]


def _coupled_with(axis: AxisModel, name: str, other: AxisMotion) -> Candidate:
    own, speed = axis.motion.velocity, other.velocity
    forms = (np.sign(speed), np.sign(own + speed), np.sign(own - speed))
    parameters = (
        EffectParameter(f"viscous_{name}", axis.unit(" s/q"), f"friction over the speed of axis {name}"),
        EffectParameter(f"coulomb_{name}", axis.unit(), f"friction with the direction of axis {name}, or of both"),
    )
    variants = tuple(Variant(axis.alone(np.stack([speed, form], axis=1))) for form in forms)
    return Candidate(AxisEffect.COUPLED_FRICTION, f"{axis.place}<{name}", parameters, variants)


_LIBRARY: Final[tuple[Callable[[AxisModel], Candidate], ...]] = (
    _stribeck,
    _asymmetric_coulomb,
    _asymmetric_viscous,
    _quadratic_drag,
    _gravity,
    _payload,
    _torque_gain,
    _torque_bias,
    _torque_ripple,
    _time_delay,
    _backlash,
    _elasticity,
    friction_position,
    friction_load,
    friction_warming,
    inertia_position,
    presliding,
    torque_filter,
)

OF_ACCELERATIONS: Final = frozenset(
    {
        EffectName.PAYLOAD,
        EffectName.TORQUE_GAIN,
        EffectName.TIME_DELAY,
        EffectName.TORQUE_FILTER,
        EffectName.ELASTICITY,
        EffectName.BACKLASH,
        EffectName.FRICTION_LOAD,
        AxisEffect.INERTIA_POSITION,
    }
)
"""Whose columns hold a measured acceleration, and its noise."""
