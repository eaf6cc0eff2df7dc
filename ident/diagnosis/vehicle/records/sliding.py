"""Wheels that slide on the floor: where, and by how much they run ahead of it.

Dry friction acts against the sliding velocity, so a wheel slides the way its traction points, and only then. When it
begins to slide and when it ends is decided by forces that no record holds: the wheels of a vehicle never point to one
centre exactly, and what they push each other aside with fills part of every friction cone. So the sliding is not
foretold but found: a wheel slides as long as it runs ahead of what the others roll, in the direction of its traction,
by more than any creep, or where its traction is large. How far that tells a friction coefficient, see `ALONG`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.rattling import BAND
from ident.diagnosis.vehicle.records.transforms import LOAD_CUTOFF, Setting, contact_force
from ident.estimate.filters import SEVEN, differentiate, zero_phase
from ident.plant import kinematics
from ident.plant.places import CHASSIS, WHEEL_PLACES
from ident.vehicle.geometry import Geometry
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CREEPING: Final = 3e-4
"""Part of its speed by which a wheel that rolls may run ahead: less is no sliding at any traction [-]."""

SLIDING: Final = 5e-3
"""Part of its speed that a wheel must run ahead by somewhere in a step for it to have slid in it [-]."""

LEAST: Final = 1e-3
"""Speed that it must run ahead by as well [m/s]."""

MOVING: Final = 0.02
"""Speed below which nothing is said: at rest, and at the ends of a record, all that is left is noise [m/s]."""

HELD: Final = 10.0
"""Weight of the wheels' not moving sideways against that of their rolling, where the chassis' twist is told."""

ALONE: Final = 0.9
"""Part of all the time that wheels surely slide in which it must be one wheel, for the floor under it to be the cause:
what sets wheels against each other (see `ident.diagnosis.vehicle.causes.askew`) makes several of them slide [-]."""

ALONG: Final = 0.8
"""Part of the friction cone that the traction has filled when a wheel slides; the rest acts across its plane [-]."""

ALONG_STD: Final = 0.12
"""Of `ALONG`: between three fifths and all of the cone."""

FILLED: Final = ALONG - 2 * ALONG_STD
"""Traction, over its largest in a drive, from which on a wheel slides that runs ahead by less than `SLIDING` [-]."""


@dataclass(frozen=True)
class SlidingCause:
    """Low friction at a place.

    Attributes:
        where: the chassis, which is the floor under all wheels, or one wheel.
        wheels: numbers of those.
        fewest: of them that must have slid; one alone is no sign of a slippery floor.
    """

    where: str
    wheels: tuple[int, ...]
    fewest: int = 1
    name: EffectName = EffectName.SLIP

    def without(self, inputs: Array, sizes: Array, setting: Setting) -> Array:
        """Inputs (N, INPUTS) as if the wheels had rolled, apart from the part 1 - `sizes[0]` of their sliding."""
        changed = copied(inputs)
        slid = self.sliding(inputs, setting)
        for wheel, ahead in zip(self.wheels, slid.T, strict=True):
            roll(changed, wheel, sizes[0] * ahead / setting.geometry.wheel_radius, setting)
        return changed

    def sliding(self, inputs: Array, setting: Setting) -> Array:
        """Speed of each contact over the floor along the plane of its wheel (N, wheels) [m/s]; zero where it rolls.

        Where several slide none surely rolls: the one that is least ahead is taken to.
        """
        speed = np.abs(setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"]][:, self.wheels])
        pull = np.stack([traction(inputs, wheel, setting) for wheel in self.wheels], axis=1)
        sense = np.sign(pull)
        if len(self.wheels) == 1:
            forward = sense * ahead_of_the_rest(inputs, setting.geometry, setting.sample_time)[:, self.wheels]
        else:
            forward = sense * ahead_of_others(inputs, setting.geometry, setting.sample_time)
            forward = forward - forward.min(axis=1, keepdims=True)
        slides = np.stack([_slides(*of_wheel) for of_wheel in zip(forward.T, speed.T, pull.T, strict=True)], axis=1)
        sliding = np.flatnonzero(slides.any(axis=0))
        slid = np.where(slides, sense * forward, 0.0)
        if len(sliding) < self.fewest:
            return np.zeros_like(slid)
        if len(sliding) == 1 < len(self.wheels):
            alone = replace(self, wheels=(self.wheels[sliding[0]],))
            slid[:, sliding] = alone.sliding(inputs, setting)
        return slid


ANY_WHEEL: Final = SlidingCause(CHASSIS[0], tuple(range(len(WHEEL_PLACES))))
"""Whatever slides, for whatever reason."""


def sliding_causes() -> list[SlidingCause]:
    """Each wheel, and the floor."""
    return [sliding_cause(where) for where in (*WHEEL_PLACES, *CHASSIS)]


def sliding_cause(where: str) -> SlidingCause:
    """One of them."""
    if where in WHEEL_PLACES:
        return SlidingCause(where, (WHEEL_PLACES.index(where),))
    return replace(ANY_WHEEL, fewest=2)


def adhesion(inputs: Array, wheels: tuple[int, ...], setting: Setting) -> float:
    """Largest traction of some wheels over a quarter of the weight [-]."""
    pulls = [np.abs(traction(inputs, wheel, setting)).max(initial=0.0) for wheel in wheels]
    return float(max(pulls)) / wheel_load(inputs, setting)


def wheel_load(inputs: Array, setting: Setting) -> float:
    """Weight that rests on a wheel: a quarter of all, the known load of a step too [N]."""
    load = float(inputs[0, SLICES["payload"].start])
    return (setting["m_ch"] + load) * GRAVITY / 4


def traction(inputs: Array, wheel: int, setting: Setting) -> Array:
    """`contact_force`, smoothed."""
    return zero_phase(contact_force(inputs, wheel, setting), LOAD_CUTOFF, setting.sample_time)


def ahead_of_others(inputs: Array, geometry: Geometry, sample_time: float) -> Array:
    """Speed (N, 4) [m/s] that the wheels run ahead of the floor, its twist by odometry of them all."""
    return zero_phase(_odometry(inputs, geometry, ())[0], LOAD_CUTOFF, sample_time)


def ahead_of_the_rest(inputs: Array, geometry: Geometry, sample_time: float) -> Array:
    """Speed (N, 4) [m/s] that each wheel runs ahead of the floor, its twist by odometry without that wheel."""
    ahead, leverage = _odometry(inputs, geometry, ())
    return zero_phase(ahead / (1 - leverage), LOAD_CUTOFF, sample_time)


def _odometry(inputs: Array, geometry: Geometry, without: Sequence[int]) -> tuple[Array, Array]:
    """What least squares without some wheels leaves of the rolling of all (N, 4) [m/s], and leverages (N, 4)."""
    matrix = kinematics.constraint_matrix(inputs[:, SLICES["alpha"]], geometry)
    rates = np.hstack([inputs[:, SLICES["alpha_rate"]], inputs[:, SLICES["beta_rate"]]])
    weights = np.repeat([HELD**2, 1.0], 4)
    weights[[4 + wheel for wheel in without]] = 0.0
    chassis, measured = matrix[:, :, :3], np.einsum("nij,nj->ni", matrix[:, :, 3:], rates)
    weighted = chassis * weights[:, None]
    inverse = _inverses(np.swapaxes(weighted, 1, 2) @ chassis)
    twist = -inverse @ np.einsum("nki,nk->ni", weighted, measured)[..., None]
    rolling = chassis[:, 4:]
    left = (rolling @ twist)[..., 0] + measured[:, 4:]
    return -left, np.einsum("nki,nij,nkj->nk", rolling, inverse, rolling) * weights[4:]


def _inverses(matrices: Array) -> Array:
    """Inverses of symmetric matrices (N, 3, 3) by their cofactors: for so many small ones a tenth of LAPACK's time."""
    first, second, third = np.moveaxis(matrices, 1, 0)
    cofactors = np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=1)
    return np.asarray(cofactors / np.einsum("ni,ni->n", first, cofactors[:, 0])[:, None, None])


def slides_alone(cause: SlidingCause, times: Array) -> bool:
    """Whether hardly any wheel but those of a cause slides, by the times (4,) that all of them do [s]."""
    return bool(times[list(cause.wheels)].sum() >= ALONE * times.sum())


def sliding_times(inputs: Array, setting: Setting) -> Array:
    """How long (4,) each wheel runs ahead of what the others roll, forward of its traction, by more than any creep [s].

    `inputs` (N, INPUTS) are the signals of a drive.
    """
    speed = np.abs(setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"]])
    sense = np.sign(np.stack([traction(inputs, wheel, setting) for wheel in range(len(WHEEL_PLACES))], axis=1))
    forward = sense * ahead_of_the_rest(inputs, setting.geometry, setting.sample_time)
    return np.asarray(setting.sample_time * np.sum(_surely(forward, speed), axis=0))


def _slides(forward: Array, speed: Array, pull: Array) -> Mask:
    """Where (N,) a wheel runs ahead, forward of its traction, if anywhere by more than any creep.

    By less it slides only where its traction is large: what runs ahead in proportion to that gives way, or is dragged
    aside by a wheel that stands askew.
    """
    surely, full = _surely(forward, speed), np.abs(pull) >= FILLED * np.abs(pull).max(initial=0.0)
    ahead = (forward > CREEPING * speed) & (speed > MOVING) & (surely | full)
    return np.asarray(ahead & surely.any(), dtype=np.bool_)


def _surely(forward: Array, speed: Array) -> Mask:
    return np.asarray((speed > MOVING) & (forward > SLIDING * speed) & (forward > LEAST), dtype=np.bool_)


def rolled_with_others(inputs: Array, wheels: Sequence[int], rolled: Array, sample_time: float) -> Array:
    """Signals (N, INPUTS) as if some wheels rolled as the others say, as far as that is slow; their angles are kept.

    So are the torques: what a wheel that hammers loses in sliding is not known. `rolled` are its `rolling_rates`.
    """
    changed = copied(inputs)
    ahead = zero_phase(inputs[:, SLICES["beta_rate"]][:, wheels] - rolled, BAND, sample_time)
    for name, change in (
        ("beta_rate", ahead),
        ("beta_acceleration", differentiate(ahead, sample_time, SEVEN)),
    ):
        changed[:, [SLICES[name].start + wheel for wheel in wheels]] -= change
    return changed


def rolling_rates(inputs: Array, wheels: Sequence[int], geometry: Geometry) -> Array:
    """Rates (N, wheels) at which some wheels roll by what the others say [rad/s]."""
    ahead = _odometry(inputs, geometry, wheels)[0][:, wheels] / geometry.wheel_radius
    return np.asarray(inputs[:, SLICES["beta_rate"]][:, wheels] - ahead)


def roll(inputs: Array, wheel: int, ahead: Array, setting: Setting) -> None:
    """Take `ahead` (N,) [rad/s] off a wheel of signals (N, INPUTS), in place, and off its drive what it took."""
    more = differentiate(ahead, setting.sample_time, SEVEN)
    inputs[:, SLICES["beta_rate"].start + wheel] -= ahead
    for name in ("beta_acceleration", "motor_acceleration"):
        inputs[:, SLICES[name].start + wheel] -= more
    torque = setting["d_vw"] * ahead + setting["B_w"] * more
    inputs[:, SLICES["torques"].start + wheel] -= torque / setting.geometry.gear_ratio
