"""The parameters of the table of variables: dynamic, geometric, of contacts and friction, of drives and of effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from fmu.variables import DEGREES, Block, Causality, Inputs, Variability, Variable
from ident.effects import Effect, kind_of, terms_of
from ident.effects.base import Sign
from ident.plant.contact import CREEP_STIFFNESS, Contacts
from ident.plant.drives import DRIVE_GAIN, DRIVE_INTEGRAL_GAIN, DRIVE_TORQUE_LIMIT, DRIVE_UNWIND_TIME
from ident.plant.memories import Memories, memories_of
from ident.plant.modes import MODE_TOLERANCE
from ident.plant.springs import DAMPING_RATIO, MOTOR_SHARE, STIFFEST
from ident.plant.stiction import STICK_TIME
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import GEOMETRY_UNITS, WHEELS
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_UNITS, Parameters

_DYNAMIC: Final = {
    "C_l": "Inertia of both units of the left side about their steering axes",
    "d_vl": "Viscous friction of the left steering",
    "d_cl": "Coulomb friction of the left steering",
    "C_r": "Inertia of both units of the right side about their steering axes",
    "d_vr": "Viscous friction of the right steering",
    "d_cr": "Coulomb friction of the right steering",
    "m_ch": "Mass of the vehicle, steering units included",
    "C_ch": "Yaw inertia without C_l and C_r",
    "d_vw": "Viscous friction of one wheel drive, at the wheel",
    "d_cw": "Coulomb friction of one wheel drive, at the wheel",
    "B_w": "Inertia of one wheel drive, at the wheel",
}

_GEOMETRY: Final = {
    "wheelbase": "Between front and rear steering axes (l)",
    "track_width": "Between left and right steering axes (b)",
    "wheel_offset": "From steering axis to wheel contact along the axle (a)",
    "wheel_radius": "Radius of the wheels (r)",
    "gear_ratio": "Motor turns per wheel turn (i_G)",
    "steering_limit": "Mechanical stops of the steering angles, either side",
}


def parameter_rows(
    vehicle: VehicleDescription,
    parameters: Parameters,
    effects: Sequence[Effect],
    inputs: Inputs,
    contacts: Contacts,
    limited: bool,
) -> list[Variable]:
    """All of them, in the order of the table; arguments as of `fmu.table.variable_table`."""
    dynamic = [
        (_positive if unit.startswith("kg") else _not_negative)(name, _DYNAMIC[name], unit, parameters[name])
        for name, unit in PARAMETER_UNITS.items()
    ]
    geometry = [
        _positive(name, text, GEOMETRY_UNITS[name], getattr(vehicle.geometry, name)) for name, text in _GEOMETRY.items()
    ]
    drives = _drives(vehicle, inputs, limited)
    of_effects = [row for effect in effects for row in _effect_parameters(effect)]
    springs = _springs(memories_of(terms_of(effects)))
    limits = _friction_limits(vehicle, effects)
    return dynamic + geometry + _regularisation(contacts) + limits + drives + springs + of_effects


def _parameter(
    name: str, text: str, unit: str, start: float, minimum: float | None = None, positive: bool = False
) -> Variable:
    display = DEGREES.get(unit, "")
    kind = (Causality.PARAMETER, Variability.TUNABLE, Block.PARAMETER)
    return Variable(name, text, *kind, unit, display_unit=display, start=start, minimum=minimum, positive=positive)


def _positive(name: str, text: str, unit: str, start: float) -> Variable:
    return _parameter(name, text, unit, start, minimum=0.0, positive=True)


def _not_negative(name: str, text: str, unit: str, start: float) -> Variable:
    return _parameter(name, text, unit, start, minimum=0.0)


def _regularisation(contacts: Contacts) -> list[Variable]:
    coulomb = "Rate at which Coulomb friction has reached 76 %, epsilon of (16)"
    return [
        _positive("epsilon", coulomb, "rad/s", COULOMB_EPSILON),
        _positive("stick_time", "How long motion below stiction goes on before it is held", "s", STICK_TIME),
        _positive("creep_stiffness", "Contact force per slip velocity of a wheel", "N s/m", CREEP_STIFFNESS[contacts]),
        _positive("mode_tolerance", "Of the steering angles, for the mode", "rad", MODE_TOLERANCE),
    ]


def _friction_limits(vehicle: VehicleDescription, effects: Sequence[Effect]) -> list[Variable]:
    limits = {f"friction_limit_{wheel}": vehicle.limits.floor_friction for wheel in WHEELS}
    for effect in effects:
        replaced = kind_of(effect.name).stands_for.get(effect.where, ())
        limits.update({name: effect.size for name in replaced if name in limits})
    text = "Largest contact force of wheel {} over its load"
    return [_positive(name, text.format(name.rpartition("_")[2]), "1", limit) for name, limit in limits.items()]


def _drives(vehicle: VehicleDescription, inputs: Inputs, limited: bool) -> list[Variable]:
    """Those of the speed loops; torque inputs have their limit alone, on request."""
    gain = "Proportional gain of the speed loops, motor torque per wheel rate"
    limit = _positive(DRIVE_TORQUE_LIMIT, "Largest torque of a motor, either way", "Nm", vehicle.limits.peak_torque)
    if inputs is Inputs.TORQUE:
        return [limit] if limited else []
    unwind = "In which the integral of a speed loop follows a torque at its limit"
    return [
        _not_negative("drive_gain", gain, "Nm s/rad", DRIVE_GAIN),
        _not_negative("drive_integral_gain", "Integral gain of the speed loops", "Nm/rad", DRIVE_INTEGRAL_GAIN),
        limit,
        _positive("drive_unwind_time", unwind, "s", DRIVE_UNWIND_TIME),
    ]


def _springs(memories: Memories) -> list[Variable]:
    if not memories.flexible:
        return []
    share = "Share of B_w on the motor's side of a flexible gear"
    stiffest = "Stiffness of a gear or coupling that has play and no compliance"
    damping = "Of the free vibration of both sides of a gear or coupling on its spring"
    rows = [
        _positive("spring_stiffness", stiffest, "Nm/rad", STIFFEST),
        _not_negative("spring_damping_ratio", damping, "1", DAMPING_RATIO),
    ]
    if memories.gears:
        rows.append(replace(_positive("motor_share", share, "1", MOTOR_SHARE), minimum=0.01, maximum=0.99))
    return rows


def effect_parameter(effect: Effect, parameter: str) -> str:
    """Name in the table of a parameter of an effect."""
    return f"{effect.name}.{effect.where}.{parameter}"


def parameters_of(effect: Effect, parameter: str) -> tuple[str, ...]:
    """Names in the table that a parameter of an effect has: its own, or those that it stands for."""
    return kind_of(effect.name).stands_for.get(effect.where) or (effect_parameter(effect, parameter),)


def _effect_parameters(effect: Effect) -> list[Variable]:
    kind = kind_of(effect.name)
    if kind.stands_for:
        return []
    return [
        _parameter(
            effect_parameter(effect, entry.name),
            f"{effect}: {entry.meaning}",
            kind.unit(entry.name, effect.where),
            effect[entry.name],
            minimum=0.0 if entry.positive or (kind.sign is Sign.NOT_NEGATIVE and entry is kind.size) else None,
            positive=entry.positive,
        )
        for entry in kind.parameters
    ]
