"""Effects with a memory of their own, simulated: what a segment would look like had they not been there.

Each turns what was measured into what the plain model is about: torques that act later, wheels that turn behind their
motors, rear units that do not follow the front ones. Everything is driven by recorded signals alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName, places_of
from ident.diagnosis.vehicle.records.flights import Shaken, twist_in_flight
from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.rattling import above_band, moved_by
from ident.diagnosis.vehicle.records.resting import range_of
from ident.diagnosis.vehicle.records.signals import shifted
from ident.estimate.filters import SEVEN, differentiate, second_derivative, zero_phase
from ident.plant.lags import following
from ident.plant.places import DRIVES, ENCODERS, STEERING, indices
from ident.plant.play import behind_play
from ident.plant.springs import MOTOR_SHARE
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

Array = NDArray[np.float64]

LOAD_CUTOFF: Final = 150.0
"""Of the filter on the torque that twists a coupling [rad/s], which is differentiated twice."""

_MOTION: Final = ("beta", "beta_rate", "beta_acceleration", "motor_acceleration")

CONTACT_SHARE: Final = 0.25
"""Load at which tooth flanks are taken to touch, in units of the joint's Coulomb friction: play is crossed below."""


LEAST_LOAD: Final = 0.05
"""The same at least, for joints without dry friction [Nm]."""


@dataclass(frozen=True)
class Setting:
    """What a transform needs beside the signals.

    Attributes:
        geometry: of the vehicle.
        parameters: p (11,).
        sample_time: [s].
        aside: speed of the steering axes over that at which contacts roll: wheels askew slide aside with those [-].
    """

    geometry: Geometry
    parameters: Array
    sample_time: float
    aside: float = 1.0

    def __getitem__(self, name: str) -> float:
        return float(self.parameters[PARAMETER_NAMES.index(name)])


Transform = Callable[[Array, int, Array, Setting], Array]
"""Inputs (N, INPUTS), index of the place, sizes (k,), setting -> inputs without the effect."""


def _later_torque(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    (delay,) = sizes
    changed = copied(inputs)
    column = SLICES["torques"].start + place
    changed[:, column] = shifted(inputs[:, column], delay, setting.sample_time)
    return changed


def _following_torque(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    (time,) = sizes
    changed = copied(inputs)
    column = SLICES["torques"].start + place
    changed[:, column] = following(inputs[:, column], float(time), setting.sample_time)
    return changed


def _earlier_angle(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    (delay,) = sizes
    changed = copied(inputs)
    for name in ("alpha", "alpha_rate", "alpha_acceleration"):
        column = SLICES[name].start + place
        changed[:, column] = shifted(inputs[:, column], -delay, setting.sample_time)
    return changed


def _soft_gear(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    (compliance,) = sizes
    return _turned_by_load(inputs, place, 0.0, compliance, setting)


def _gear_with_play(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    """Play, and the compliance of its flanks: no contact is rigid."""
    gap, compliance = sizes
    hammer, swing = (inputs[:, SLICES[name].start + place] for name in ("hammer", "swing"))
    if hammer.any() and compliance != 0:
        load = _gear_load(inputs, place, setting)
        shaken = Shaken(moved_by(hammer, swing), swing, load, _touching(setting), setting.sample_time)
        return _behind_motor(inputs, place, twist_in_flight(shaken, gap, compliance), setting)
    # For a first look, and for a play that is given without its flanks: their load tells at which of them a motor lies.
    return _turned_by_load(inputs, place, gap, compliance, setting)


def _touching(setting: Setting) -> float:
    """Load of a wheel's gear from which its flanks surely touch [Nm]."""
    return max(CONTACT_SHARE * abs(setting["d_cw"]), LEAST_LOAD)


def _across_at_rest(inputs: Array, wheel: int, gap: float, yielded: Array) -> Array:
    """How far a play, and what its gear yields (N,), let the motors move at rest (N, 4); zero but for one that does."""
    found = np.zeros((len(inputs), 4))
    at_rest = inputs[:, SLICES["rest"].start + wheel] != 0
    found[at_rest, wheel] = gap + range_of(yielded, inputs, wheel)
    return found


def _soft_coupling(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    """The rear unit as it is, and the torque of its wheel without what that drags with: askew, it slides aside.

    The drag [Nm] is a part of the torque that the coupling passes on.
    """
    compliance, dragging = sizes
    passed = _play(_coupling_load(inputs, place, setting), _unit_friction(place, setting))
    changed = _rear_behind_front(inputs, place, compliance * passed, setting)
    rear = 2 * place + 1
    against = np.tanh(inputs[:, SLICES["beta_rate"].start + rear] / COULOMB_EPSILON)
    drag = setting.aside * dragging * np.abs(passed) * against
    changed[:, SLICES["torques"].start + rear] -= drag / setting.geometry.gear_ratio
    return changed


def _coupling_with_play(inputs: Array, place: int, sizes: Array, setting: Setting) -> Array:
    """Play, and the compliance of its flanks: no contact is rigid."""
    gap, compliance = sizes
    load, friction = _coupling_load(inputs, place, setting), _unit_friction(place, setting)
    twist = gap / 2 * _relay(load, friction) + compliance * _play(load, friction)
    changed, wander = _rear_behind_front(inputs, place, twist, setting), SLICES["wander"].start + place
    changed[inputs[:, wander] != 0, wander] -= gap
    return changed


def _unit_friction(side: int, setting: Setting) -> float:
    """Dry friction that holds each of the two units of a side [Nm]."""
    return setting[("d_cl", "d_cr")[side]] / 2


def _play(load: Array, friction: float) -> Array:
    """Load (N,) that a spring holds when dry friction holds what it moves: it follows, `friction` behind."""
    return behind_play(load, friction, 0.0)


def _relay(load: Array, friction: float) -> Array:
    """Flank (N,), +1 or -1, at which a body lies that dry friction holds; 0 before it is first pushed over."""
    pushed = np.where(np.abs(load) > friction, np.arange(len(load)), -1)
    last = np.maximum.accumulate(pushed)
    return np.where(last < 0, 0.0, np.sign(load[last]))


def _gear_load(inputs: Array, wheel: int, setting: Setting) -> Array:
    """Torque through the gear of a wheel (N,) [Nm at the wheel], as fast as the signals show it.

    A motor that rattles in its play touches both flanks many times a second, and a smoothed load shows neither.
    """
    drive = setting.geometry.gear_ratio * inputs[:, SLICES["torques"].start + wheel]
    inertia = MOTOR_SHARE * setting["B_w"] * inputs[:, SLICES["motor_acceleration"].start + wheel]
    return np.asarray(drive - inertia)


def _coupling_load(inputs: Array, side: int, setting: Setting) -> Array:
    """Torque that turns both units of a side the same way, against the coupling (N,) [Nm]."""
    g = setting.geometry
    outward = (1.0, -1.0)[side]
    force = sum(contact_force(inputs, wheel, setting) for wheel in (2 * side, 2 * side + 1))
    return zero_phase(-outward * g.wheel_offset * np.asarray(force) / 2, LOAD_CUTOFF, setting.sample_time)


def contact_force(inputs: Array, wheel: int, setting: Setting) -> Array:
    """Force of the floor on a wheel along its plane (N,), positive where it drives forward [N]."""
    rate, acceleration = (inputs[:, SLICES[name].start + wheel] for name in ("beta_rate", "beta_acceleration"))
    lost = setting["d_vw"] * rate + setting["d_cw"] * np.tanh(rate / COULOMB_EPSILON) + setting["B_w"] * acceleration
    drive = setting.geometry.gear_ratio * inputs[:, SLICES["torques"].start + wheel]
    return np.asarray((drive - lost) / setting.geometry.wheel_radius)


def _turned_by_load(inputs: Array, wheel: int, gap: float, compliance: float, setting: Setting) -> Array:
    """The wheel instead of the motor, as far as the wheel has not been made to roll as the others say."""
    load = _gear_load(inputs, wheel, setting)
    yielded = compliance * load
    twist = gap / 2 * np.tanh(load / _touching(setting)) + yielded
    if inputs[:, SLICES["hammer"].start + wheel].any():
        twist = above_band(twist, setting.sample_time)
    changed = _behind_motor(inputs, wheel, twist, setting)
    changed[:, SLICES["rest"]] -= _across_at_rest(inputs, wheel, gap, yielded)
    return changed


def _behind_motor(inputs: Array, wheel: int, twist: Array, setting: Setting) -> Array:
    """The wheel instead of the motor; what the motor's own inertia takes more than at the wheel's pace is lost."""
    changed = copied(inputs)
    changed[:, SLICES["rattle"].start + wheel] -= inputs[:, SLICES["hammer"].start + wheel] * twist
    rate = differentiate(twist, setting.sample_time, SEVEN)
    acceleration = second_derivative(twist, setting.sample_time, SEVEN)
    for name, change in zip(_MOTION, (twist, rate, acceleration, acceleration), strict=True):
        changed[:, SLICES[name].start + wheel] -= change
    own = MOTOR_SHARE * setting["B_w"] / setting.geometry.gear_ratio
    changed[:, SLICES["torques"].start + wheel] -= own * acceleration
    return changed


def _rear_behind_front(inputs: Array, side: int, twist: Array, setting: Setting) -> Array:
    changed, twist = copied(inputs), zero_phase(twist, LOAD_CUTOFF, setting.sample_time)
    changed[:, SLICES["twist"].start + side] += twist
    changed[:, SLICES["twist_rate"].start + side] += differentiate(twist, setting.sample_time, SEVEN)
    return changed


@dataclass(frozen=True)
class TransformCause:
    """An effect with a memory at a place.

    Attributes:
        name, where: which.
        places: indices of the drives or sides.
        transform: takes the effect out of the inputs.
        probes: small sizes (k,) at which the columns are taken: the effect's own first, behind it those of what may
            come along with it.
    """

    name: EffectName
    where: str
    places: tuple[int, ...]
    transform: Transform
    probes: tuple[float, ...]

    def without(self, inputs: Array, sizes: Array, setting: Setting) -> Array:
        """Inputs (N, INPUTS) without the effect; what it is not given a size for does not come along."""
        padded = np.zeros(len(self.probes))
        padded[: len(sizes)] = sizes
        for place in self.places:
            inputs = self.transform(inputs, place, padded, setting)
        return inputs


YIELDING: Final = 1e-5
"""Compliance [rad/Nm], and drag [-], at which columns are taken: they are in proportion to either."""

_DRIVE, _SIDE = "drive", "side"
_TRANSFORMS: Final[Mapping[tuple[EffectName, str], tuple[Transform, tuple[float, ...]]]] = MappingProxyType(
    {
        (EffectName.TIME_DELAY, _DRIVE): (_later_torque, (1e-3,)),
        (EffectName.TORQUE_FILTER, _DRIVE): (_following_torque, (1e-3,)),
        (EffectName.TIME_DELAY, _SIDE): (_earlier_angle, (1e-3,)),
        (EffectName.ELASTICITY, _DRIVE): (_soft_gear, (1e-4,)),
        (EffectName.ELASTICITY, _SIDE): (_soft_coupling, (YIELDING, YIELDING)),
        (EffectName.BACKLASH, _DRIVE): (_gear_with_play, (1e-3, YIELDING)),
        (EffectName.BACKLASH, _SIDE): (_coupling_with_play, (1e-3, YIELDING)),
    }
)


def transform_causes(names: tuple[EffectName, ...]) -> list[TransformCause]:
    """All places of the effects named that have a memory."""
    known = {name for name, _ in _TRANSFORMS}
    return [transform_cause(name, where) for name in names if name in known for where in places_of(name)]


def transform_cause(name: EffectName, where: str) -> TransformCause:
    """One of them.

    Raises:
        KeyError: the effect has no memory.
    """
    kind = next(places for places in (DRIVES, ENCODERS, STEERING) if indices(where, places))
    side = _DRIVE if kind is DRIVES else _SIDE
    return TransformCause(name, where, indices(where, kind), *_TRANSFORMS[name, side])
