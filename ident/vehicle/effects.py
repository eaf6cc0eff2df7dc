"""The effects that a model may lack, by name: places, parameters, units, and how they are written down.

One table for everyone. What an effect does is written twice, on purpose: by the emulator, which injects it
physically, and by the diagnosis and the extended model, which describe it by equations. They share this table only.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from ident.errors import DataFileError
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import Quantity


class EffectName(enum.StrEnum):
    """Canonical names of the effects, in every file and output."""

    STRIBECK = "stribeck"
    ASYMMETRIC_COULOMB = "asymmetric_coulomb"
    ASYMMETRIC_VISCOUS = "asymmetric_viscous"
    QUADRATIC_DRAG = "quadratic_drag"
    SLOPE = "slope"
    COM_OFFSET = "com_offset"
    PAYLOAD = "payload"
    TORQUE_GAIN = "torque_gain"
    TORQUE_BIAS = "torque_bias"
    TORQUE_RIPPLE = "torque_ripple"
    TIME_DELAY = "time_delay"
    BACKLASH = "backlash"
    ELASTICITY = "elasticity"
    WHEEL_RADIUS = "wheel_radius"
    WHEEL_ECCENTRICITY = "wheel_eccentricity"
    STEERING_OFFSET = "steering_offset"
    SLIP = "slip"
    SCRUB = "scrub"
    STEERING_UNIT_MASS = "steering_unit_mass"
    PARAMETER_CHANGE = "parameter_change"


STEERING: Final = ("steering_left", "steering_right")
WHEEL_PLACES: Final = ("wheel_fl", "wheel_rl", "wheel_fr", "wheel_rr")
ALL_WHEELS: Final = ("wheels",)
DRIVES: Final = ("drive_fl", "drive_rl", "drive_fr", "drive_rr")
ENCODERS: Final = ("encoder_left", "encoder_right")
CHASSIS: Final = ("chassis",)


@dataclass(frozen=True)
class EffectParameter:
    """A number that an effect has.

    Attributes:
        name: in files and on the command line.
        unit: SI.
        meaning: one line for people.
        default: value where none is given; None where it must be given.
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None


@dataclass(frozen=True)
class EffectSpec:
    """What there is to know about an effect without its equations.

    Attributes:
        name: canonical.
        places: where it can be.
        parameters: the first is its size, zero (or, for `slip`, that of the floor) without the effect.
        units_at: units of the size that differ from the table's, by place.
    """

    name: EffectName
    places: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    units_at: Mapping[str, str] = field(default_factory=dict)

    @property
    def size(self) -> EffectParameter:
        """The parameter that says how large the effect is."""
        return self.parameters[0]

    def unit(self, parameter: str, where: str) -> str:
        """Unit of a parameter at a place."""
        if parameter == self.size.name and where in self.units_at:
            return self.units_at[where]
        return next(entry.unit for entry in self.parameters if entry.name == parameter)


_SPECS: Final = (
    EffectSpec(
        EffectName.STRIBECK,
        (*STEERING, *WHEEL_PLACES, *ALL_WHEELS),
        (
            EffectParameter("amplitude", "Nm", "friction at rest beyond the Coulomb friction"),
            EffectParameter("velocity", "rad/s", "rate at which it has fallen to 1/e", 0.3),
        ),
    ),
    EffectSpec(
        EffectName.ASYMMETRIC_COULOMB,
        (*STEERING, *WHEEL_PLACES, *ALL_WHEELS),
        (EffectParameter("imbalance", "Nm", "friction is d_c + imbalance forward, d_c - imbalance backward"),),
    ),
    EffectSpec(
        EffectName.ASYMMETRIC_VISCOUS,
        (*STEERING, *WHEEL_PLACES, *ALL_WHEELS),
        (EffectParameter("imbalance", "Nm s/rad", "friction is d_v + imbalance forward, d_v - imbalance backward"),),
    ),
    EffectSpec(
        EffectName.QUADRATIC_DRAG,
        (*WHEEL_PLACES, *ALL_WHEELS, *CHASSIS),
        (EffectParameter("coefficient", "Nm s^2/rad^2", "resistance is coefficient times v abs(v)"),),
        MappingProxyType({"chassis": "N s^2/m^2"}),
    ),
    EffectSpec(
        EffectName.SLOPE,
        CHASSIS,
        (
            EffectParameter("angle", "rad", "inclination of the floor"),
            EffectParameter("direction", "rad", "heading in the world that points uphill", 0.0),
        ),
    ),
    EffectSpec(
        EffectName.COM_OFFSET,
        CHASSIS,
        (
            EffectParameter("x", "m", "centre of mass ahead of the centre"),
            EffectParameter("y", "m", "centre of mass left of the centre", 0.0),
        ),
    ),
    EffectSpec(
        EffectName.PAYLOAD,
        CHASSIS,
        (
            EffectParameter("mass", "kg", "mass over the centre that the model does not have"),
            EffectParameter("inertia", "kg m^2", "its inertia about the vertical axis", 0.0),
        ),
    ),
    EffectSpec(
        EffectName.TORQUE_GAIN,
        DRIVES,
        (EffectParameter("error", "1", "torque at the shaft is (1 + error) times the torque reported"),),
    ),
    EffectSpec(
        EffectName.TORQUE_BIAS,
        DRIVES,
        (EffectParameter("bias", "Nm", "torque at the motor shaft beyond the torque reported"),),
    ),
    EffectSpec(
        EffectName.TORQUE_RIPPLE,
        DRIVES,
        (
            EffectParameter("amplitude", "Nm", "at the motor shaft, not reported"),
            EffectParameter("order", "1", "periods a revolution of the motor", 1.0),
            EffectParameter("phase", "rad", "at motor angle zero", 0.0),
        ),
    ),
    EffectSpec(
        EffectName.TIME_DELAY,
        (*DRIVES, *ENCODERS),
        (EffectParameter("delay", "s", "torque acts, or angle is reported, so much later"),),
    ),
    EffectSpec(
        EffectName.BACKLASH,
        (*DRIVES, *STEERING),
        (EffectParameter("gap", "rad", "whole play, at the wheel or at the steering axis"),),
    ),
    EffectSpec(
        EffectName.ELASTICITY,
        (*DRIVES, *STEERING),
        (EffectParameter("compliance", "rad/Nm", "twist per torque, at the wheel or at the steering axis"),),
    ),
    EffectSpec(
        EffectName.WHEEL_RADIUS,
        WHEEL_PLACES,
        (EffectParameter("error", "m", "true radius minus the radius of the vehicle file"),),
    ),
    EffectSpec(
        EffectName.WHEEL_ECCENTRICITY,
        WHEEL_PLACES,
        (
            EffectParameter("amplitude", "m", "first harmonic of the rolling radius over the wheel angle"),
            EffectParameter("phase", "rad", "wheel angle of the largest radius, negative", 0.0),
        ),
    ),
    EffectSpec(
        EffectName.STEERING_OFFSET,
        STEERING,
        (EffectParameter("offset", "rad", "angle reported minus true angle"),),
    ),
    EffectSpec(
        EffectName.SLIP,
        (*CHASSIS, *WHEEL_PLACES),
        (EffectParameter("friction", "1", "friction coefficient of the floor, or of the tyre, instead of the usual"),),
    ),
    EffectSpec(
        EffectName.SCRUB,
        (*STEERING, *CHASSIS),
        (EffectParameter("torque", "Nm", "resistance of the contact patches to turning on the spot"),),
    ),
    EffectSpec(
        EffectName.STEERING_UNIT_MASS,
        CHASSIS,
        (EffectParameter("mass", "kg", "of each wheel unit, at the wheel contact, so off its steering axis"),),
    ),
    EffectSpec(
        EffectName.PARAMETER_CHANGE,
        PARAMETER_NAMES,
        (EffectParameter("change", "1", "true value over the model's, minus one"),),
    ),
)
EFFECTS: Final[Mapping[EffectName, EffectSpec]] = MappingProxyType({spec.name: spec for spec in _SPECS})
"""Every effect, in the order of the design."""


@dataclass(frozen=True)
class Effect:
    """An effect with its place and its numbers.

    Attributes:
        name: which.
        where: a place of its spec.
        parameters: name -> value with unit and standard uncertainty; all parameters of its spec.
    """

    name: EffectName
    where: str
    parameters: Mapping[str, Quantity]

    def __getitem__(self, parameter: str) -> float:
        """Value of a parameter, SI."""
        return self.parameters[parameter].value

    @property
    def size(self) -> float:
        """Value of the parameter that says how large it is."""
        return self[EFFECTS[self.name].size.name]

    def __str__(self) -> str:
        return f"{self.name}@{self.where}"


def make_effect(
    name: EffectName, where: str, values: Mapping[str, float], std: Mapping[str, float] | None = None
) -> Effect:
    """An effect from SI values; parameters that are left out take their defaults.

    Raises:
        DataFileError: the effect cannot be there, or a parameter is unknown, missing or not finite.
    """
    spec, text = EFFECTS[name], f"effect {name}@{where}"
    if where not in spec.places:
        raise DataFileError(f"{text}: it cannot be there.", f"Places of {name}: {', '.join(spec.places)}.")
    known = {entry.name: entry for entry in spec.parameters}
    unknown = sorted(values.keys() - known.keys())
    if unknown:
        raise DataFileError(f"{text} has no parameter {unknown[0]!r}.", f"Its parameters: {', '.join(known)}.")
    quantities = {}
    for entry in spec.parameters:
        value = values.get(entry.name, entry.default)
        if value is None or not math.isfinite(value):
            raise DataFileError(f"{text} needs a number for {entry.name!r}.", f"It is {entry.meaning}.")
        quantities[entry.name] = Quantity(value, spec.unit(entry.name, where), "", (std or {}).get(entry.name, 0.0))
    return Effect(name, where, MappingProxyType(quantities))
