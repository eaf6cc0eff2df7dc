"""From effects to a vehicle that has them: one injector for each name of the library, in a table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from emulator.as_built import GRAVITY, AsBuilt, SoftCoupling, WheelBuild
from emulator.effects.bodies import change_parameter, load_payload, make_wheels_heavy, shift_centre
from emulator.effects.drives import DriveFlaws, Ripple
from emulator.effects.friction import (
    AsymmetricCoulomb,
    AsymmetricViscous,
    QuadraticChassisDrag,
    QuadraticJointDrag,
    Stribeck,
)
from emulator.effects.laws import JointAxis, Law, joint_axes, side_index, wheel_index
from emulator.effects.sensors import EncoderFlaws
from emulator.effects.transmissions import MOTOR_SHARE
from emulator.effects.unlibraried import Unlibraried
from emulator.prototype import Prototype
from ident.errors import UserError
from ident.vehicle.effects import Effect, EffectName

_RIGID: Final = SoftCoupling(0.0)


@dataclass(frozen=True)
class Injection:
    """A vehicle with its effects.

    Attributes:
        built: bodies, wheels, couplings and floor.
        laws: physics evaluated every engine step.
        drives: flaws of the drives fl, rl, fr, rr.
        encoders: flaws of the steering encoders left, right.
    """

    built: AsBuilt
    laws: tuple[Law, ...] = ()
    drives: tuple[DriveFlaws, ...] = (DriveFlaws(),) * 4
    encoders: tuple[EncoderFlaws, EncoderFlaws] = field(default=(EncoderFlaws(), EncoderFlaws()))

    def with_prototype(self, prototype: Prototype) -> Injection:
        """The same with other masses, inertias or parameters."""
        wheels = tuple(replace(wheel, body=prototype.rigid_bodies.wheel) for wheel in self.built.wheels)
        return replace(self, built=replace(self.built, prototype=prototype, wheels=wheels))

    def with_wheels(self, where: str, change: Callable[[WheelBuild], WheelBuild]) -> Injection:
        """The same with one wheel, or those of a side or of the chassis, changed."""
        chosen = _wheels_of(where)
        wheels = tuple(change(wheel) if index in chosen else wheel for index, wheel in enumerate(self.built.wheels))
        return replace(self, built=replace(self.built, wheels=wheels))

    def with_drive(self, where: str, change: Callable[[DriveFlaws], DriveFlaws]) -> Injection:
        """The same with one drive changed."""
        chosen = wheel_index(where)
        drives = tuple(change(flaws) if index == chosen else flaws for index, flaws in enumerate(self.drives))
        return replace(self, drives=drives)

    def with_coupling(self, where: str, change: Callable[[SoftCoupling], SoftCoupling]) -> Injection:
        """The same with the coupling of one side changed."""
        side = side_index(where)
        left, right = (
            change(coupling or _RIGID) if index == side else coupling
            for index, coupling in enumerate(self.built.couplings)
        )
        return replace(self, built=replace(self.built, couplings=(left, right)))

    def with_encoder(self, where: str, change: Callable[[EncoderFlaws], EncoderFlaws]) -> Injection:
        """The same with one steering encoder changed."""
        side = side_index(where)
        left, right = (change(flaws) if index == side else flaws for index, flaws in enumerate(self.encoders))
        return replace(self, encoders=(left, right))


AnyEffect = Effect | Unlibraried
"""An effect of the library, or one that it does not have."""

Injector = Callable[[Injection, Effect], Injection]


def inject(prototype: Prototype, effects: Sequence[AnyEffect], step: float) -> Injection:
    """The prototype with all `effects`.

    Args:
        prototype: without them.
        effects: in any order.
        step: of the engine [s].

    Raises:
        UserError: two effects exclude each other, or an effect is larger than this vehicle can have.
    """
    known = [effect for effect in effects if isinstance(effect, Effect)]
    strange = tuple(law for effect in effects if isinstance(effect, Unlibraried) for law in effect.laws(step))
    _refuse_twice(known)
    injection = Injection(AsBuilt.of(prototype), strange)
    # Changed parameters first: they derive the bodies anew, which others then load, shift and replace.
    for effect in sorted(known, key=lambda effect: effect.name is not EffectName.PARAMETER_CHANGE):
        injection = INJECTORS[effect.name](injection, effect)
    return _without_motor_inertia(injection)


def _without_motor_inertia(injection: Injection) -> Injection:
    """A motor behind a flexible gear turns on its own: its inertia is no longer the wheel's."""
    wheels = injection.built.wheels
    for index, flaws in enumerate(injection.drives):
        if flaws.flexible:
            lying, spin, standing = wheels[index].body.inertia
            body = replace(wheels[index].body, inertia=(lying, (1 - MOTOR_SHARE) * spin, standing))
            wheels = (*wheels[:index], replace(wheels[index], body=body), *wheels[index + 1 :])
    return replace(injection, built=replace(injection.built, wheels=wheels))


def _refuse_twice(effects: Sequence[Effect]) -> None:
    for index, effect in enumerate(effects):
        for other in effects[:index]:
            if effect.name is other.name and _overlap(effect, other):
                raise UserError(
                    f"{other} and {effect} exclude each other: both are {effect.name} of the same part.",
                    "Give one of them, with the size of both.",
                )


def _overlap(effect: Effect, other: Effect) -> bool:
    """The same place; or the same wheel, where one coefficient would replace the other."""
    if effect.name is EffectName.SLIP:
        return bool(set(_wheels_of(effect.where)) & set(_wheels_of(other.where)))
    return effect.where == other.where


def _wheels_of(where: str) -> tuple[int, ...]:
    sides = {"chassis": (0, 1, 2, 3), "wheels": (0, 1, 2, 3), "steering_left": (0, 1), "steering_right": (2, 3)}
    return sides.get(where) or (wheel_index(where),)


def _friction(make: Callable[[JointAxis, Effect], Law]) -> Injector:
    def injector(injection: Injection, effect: Effect) -> Injection:
        return replace(injection, laws=injection.laws + tuple(make(axis, effect) for axis in joint_axes(effect.where)))

    return injector


def _coulomb_of(injection: Injection, where: str) -> float:
    truth = injection.built.prototype.truth
    return truth[{"steering_left": "d_cl", "steering_right": "d_cr"}.get(where, "d_cw")]


def _viscous_of(injection: Injection, where: str) -> float:
    truth = injection.built.prototype.truth
    return truth[{"steering_left": "d_vl", "steering_right": "d_vr"}.get(where, "d_vw")]


def _bounded(injector: Injector, bound: Callable[[Injection, str], float], symbol: str) -> Injector:
    """Refuse a difference between directions beyond the friction itself: one direction would drive the joint."""

    def bounded(injection: Injection, effect: Effect) -> Injection:
        if abs(effect.size) > bound(injection, effect.where):
            raise UserError(
                f"{effect}: an imbalance of {effect.size:g} is more than the friction that it is part of.",
                f"Stay below {symbol}, here {bound(injection, effect.where):g}.",
            )
        return injector(injection, effect)

    return bounded


def _drag(injection: Injection, effect: Effect) -> Injection:
    if effect.where == "chassis":
        return replace(injection, laws=(*injection.laws, QuadraticChassisDrag(effect["coefficient"])))
    return _friction(lambda axis, effect: QuadraticJointDrag(axis, effect["coefficient"]))(injection, effect)


def _slope(injection: Injection, effect: Effect) -> Injection:
    prototype = injection.built.prototype
    pull = prototype.truth["m_ch"] * GRAVITY * abs(math.sin(effect["angle"]))
    hold = 4 * prototype.truth["d_cw"] / prototype.geometry.wheel_radius
    if pull >= hold:
        steepest = math.degrees(math.asin(hold / prototype.truth["m_ch"] / GRAVITY))
        raise UserError(
            f"{effect}: the vehicle has no brakes and would roll away with its drives off.",
            f"Its friction holds it on at most {steepest:.2f}deg.",
        )
    return replace(injection, built=replace(injection.built, slope=effect["angle"], uphill=effect["direction"]))


def _grip(injection: Injection, effect: Effect) -> Injection:
    if effect["friction"] <= 0:
        raise UserError(f"{effect}: a friction coefficient is positive.", "Give one above zero.")
    # The engine multiplies the coefficients of tyre and floor.
    grip = effect["friction"] / injection.built.prototype.floor_friction
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, grip=grip))


def _scrub(injection: Injection, effect: Effect) -> Injection:
    share = effect["torque"] / len(_wheels_of(effect.where))
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, patch_torque=wheel.patch_torque + share))


def _radius(injection: Injection, effect: Effect) -> Injection:
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, radius=wheel.radius + effect["error"]))


def _eccentricity(injection: Injection, effect: Effect) -> Injection:
    return injection.with_wheels(
        effect.where, lambda wheel: replace(wheel, eccentricity=effect["amplitude"], phase=effect["phase"])
    )


def _ripple(injection: Injection, effect: Effect) -> Injection:
    ripple = Ripple(effect["amplitude"], effect["order"], effect["phase"])
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, ripples=(*flaws.ripples, ripple)))


def _delay(injection: Injection, effect: Effect) -> Injection:
    if effect["delay"] < 0:
        raise UserError(f"{effect}: nothing acts before its cause.", "Give a positive delay.")
    if effect.where.startswith("encoder"):
        return injection.with_encoder(effect.where, lambda flaws: replace(flaws, delay=effect["delay"]))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, delay=effect["delay"]))


def _refuse_negative(effect: Effect) -> None:
    if effect.size < 0:
        raise UserError(f"{effect}: play and compliance are not negative.", "Give a positive number.")


def _backlash(injection: Injection, effect: Effect) -> Injection:
    _refuse_negative(effect)
    if effect.where.startswith("steering"):
        return injection.with_coupling(effect.where, lambda soft: replace(soft, gap=effect["gap"]))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, gap=effect["gap"]))


def _elasticity(injection: Injection, effect: Effect) -> Injection:
    _refuse_negative(effect)
    if effect.where.startswith("steering"):
        return injection.with_coupling(effect.where, lambda soft: replace(soft, compliance=effect["compliance"]))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, compliance=effect["compliance"]))


INJECTORS: Final[Mapping[EffectName, Injector]] = MappingProxyType(
    {
        EffectName.STRIBECK: _friction(
            lambda axis, effect: Stribeck(axis, effect["amplitude"], effect["velocity"]),
        ),
        EffectName.ASYMMETRIC_COULOMB: _bounded(
            _friction(lambda axis, effect: AsymmetricCoulomb(axis, effect["imbalance"])), _coulomb_of, "d_c"
        ),
        EffectName.ASYMMETRIC_VISCOUS: _bounded(
            _friction(lambda axis, effect: AsymmetricViscous(axis, effect["imbalance"])), _viscous_of, "d_v"
        ),
        EffectName.QUADRATIC_DRAG: _drag,
        EffectName.SLOPE: _slope,
        EffectName.COM_OFFSET: lambda injection, effect: injection.with_prototype(
            shift_centre(injection.built.prototype, effect["x"], effect["y"])
        ),
        EffectName.PAYLOAD: lambda injection, effect: injection.with_prototype(
            load_payload(injection.built.prototype, effect["mass"], effect["inertia"])
        ),
        EffectName.TORQUE_GAIN: lambda injection, effect: injection.with_drive(
            effect.where, lambda flaws: replace(flaws, gain=effect["error"])
        ),
        EffectName.TORQUE_BIAS: lambda injection, effect: injection.with_drive(
            effect.where, lambda flaws: replace(flaws, bias=effect["bias"])
        ),
        EffectName.TORQUE_RIPPLE: _ripple,
        EffectName.TIME_DELAY: _delay,
        EffectName.BACKLASH: _backlash,
        EffectName.ELASTICITY: _elasticity,
        EffectName.WHEEL_RADIUS: _radius,
        EffectName.WHEEL_ECCENTRICITY: _eccentricity,
        EffectName.STEERING_OFFSET: lambda injection, effect: injection.with_encoder(
            effect.where.replace("steering", "encoder"), lambda flaws: replace(flaws, offset=effect["offset"])
        ),
        EffectName.SLIP: _grip,
        EffectName.SCRUB: _scrub,
        EffectName.STEERING_UNIT_MASS: lambda injection, effect: injection.with_prototype(
            make_wheels_heavy(injection.built.prototype, effect["mass"])
        ),
        EffectName.PARAMETER_CHANGE: lambda injection, effect: injection.with_prototype(
            change_parameter(injection.built.prototype, effect.where, effect["change"])
        ),
    }
)
"""Every effect of the library -> what injects it."""
