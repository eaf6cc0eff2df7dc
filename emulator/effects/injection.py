"""A vehicle with effects: what they make of its bodies, drives, encoders and joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

from emulator.as_built import AsBuilt, SoftCoupling, WheelBuild
from emulator.effects.drives import DriveFlaws
from emulator.effects.laws import Law
from emulator.effects.places import side_index, wheel_index, wheels_of
from emulator.effects.sensors import EncoderFlaws
from emulator.prototype import Prototype

_RIGID: Final = SoftCoupling(0.0)


@dataclass(frozen=True)
class Injection:
    """A vehicle with its effects.

    Attributes:
        built: bodies, wheels, couplings and floor.
        step: of the engine [s].
        laws: physics evaluated every engine step.
        drives: flaws of the drives fl, rl, fr, rr.
        encoders: flaws of the steering encoders left, right.
    """

    built: AsBuilt
    step: float
    laws: tuple[Law, ...] = ()
    drives: tuple[DriveFlaws, ...] = (DriveFlaws(),) * 4
    encoders: tuple[EncoderFlaws, EncoderFlaws] = field(default=(EncoderFlaws(), EncoderFlaws()))

    def with_prototype(self, prototype: Prototype) -> Injection:
        """The same with other masses, inertias or parameters."""
        wheels = tuple(replace(wheel, body=prototype.rigid_bodies.wheel) for wheel in self.built.wheels)
        return replace(self, built=replace(self.built, prototype=prototype, wheels=wheels))

    def with_laws(self, *laws: Law) -> Injection:
        """The same with more physics."""
        return replace(self, laws=(*self.laws, *laws))

    def with_wheels(self, where: str, change: Callable[[WheelBuild], WheelBuild]) -> Injection:
        """The same with one wheel, or those of a side or of the chassis, changed."""
        chosen = wheels_of(where)
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
