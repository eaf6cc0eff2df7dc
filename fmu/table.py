"""The rows of the table of variables, for a vehicle with its parameters and effects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from fmu.effect_states import (
    DAMPING_RATIO,
    MOTOR_SHARE,
    STIFFEST,
    AddedState,
    Memories,
    coupled_states,
    memories_of,
    other_states,
)
from fmu.variables import Block, Causality, Inputs, Variability, Variable, VariableTable, numbered
from ident.vehicle.description import VehicleDescription
from ident.vehicle.effect_terms import TERMS
from ident.vehicle.effects import ALL_WHEELS, CHASSIS, EFFECTS, WHEEL_PLACES, Effect, EffectName, make_effect
from ident.vehicle.geometry import GEOMETRY_UNITS, WHEELS
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_UNITS, Parameters

DRIVE_GAIN: Final = 0.5
"""Proportional gain of the drives' speed loops before anyone tunes them, motor torque per wheel rate [Nm s/rad]."""

DRIVE_INTEGRAL_GAIN: Final = 2.0
"""Integral gain of the drives' speed loops before anyone tunes them [Nm/rad]."""

DRIVE_UNWIND_TIME: Final = 0.05
"""In which the integral of a speed loop follows a torque at its limit [s]."""

CREEP_STIFFNESS: Final = 1e7
"""Contact force per slip velocity [N s/m]: under 100 N a wheel slips by 10 micrometres a second."""

STICK_TIME: Final = 0.06
"""How long motion below stiction goes on before it is held [s]; chosen in docs/adr/0008."""

MODE_TOLERANCE: Final = 0.02
"""Of the steering angles in (9), as `ident.vehicle.modes.detect_mode` has it [rad]."""

_SIDES: Final = {"l": "left", "r": "right"}
_DEGREES: Final = {"rad": "deg", "rad/s": "deg/s"}
_PER_SECOND: Final = {"m": "m/s", "rad": "rad/s", "m/s": "m/s^2", "rad/s": "rad/s^2", "1": "1/s", "Nm": "Nm/s"}

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

_STICTION: Final = {
    "stick": "Creep of {} that its friction remembers, over epsilon times stick_time",
    "lag": "Lagged load on the friction of {}",
}

_NEVER_NEGATIVE: Final = (EffectName.BACKLASH, EffectName.ELASTICITY)

_GEOMETRY: Final = {
    "wheelbase": "Between front and rear steering axes (l)",
    "track_width": "Between left and right steering axes (b)",
    "wheel_offset": "From steering axis to wheel contact along the axle (a)",
    "wheel_radius": "Radius of the wheels (r)",
    "gear_ratio": "Motor turns per wheel turn (i_G)",
    "steering_limit": "Mechanical stops of the steering angles, either side",
}


def variable_table(
    vehicle: VehicleDescription, parameters: Parameters, effects: Sequence[Effect] = (), inputs: Inputs = Inputs.TORQUE
) -> VariableTable:
    """The table for a vehicle with its parameters (18) and effects.

    Args:
        vehicle: geometry and limits; start values of the FMU's parameters.
        parameters: identified.
        effects: each adds its parameters; those of `slip` are start values of the friction limits.
        inputs: motor torques, or wheel speeds with the drives' inner loop.
    """
    memories = memories_of(effects)
    states = _states(inputs, memories)
    derivatives = [_derivative(state) for state in states]
    parameter_rows = _parameters(vehicle, parameters, effects, inputs)
    return numbered([[_time()], states, derivatives, _inputs(inputs), parameter_rows, _outputs(memories), [_mode()]])


def _time() -> Variable:
    return Variable("time", "Simulation time", Causality.INDEPENDENT, Variability.CONTINUOUS, Block.TIME, "s")


def _mode() -> Variable:
    text = "Motion mode k of (9): 1 alignment, 2 steered, 3 lateral, 4 rotation"
    return Variable("mode", text, Causality.OUTPUT, Variability.DISCRETE, Block.MODE, "1", minimum=1, maximum=4)


def _states(inputs: Inputs, memories: Memories) -> list[Variable]:
    """Rates first, which the equations couple, with those of effects; then what follows from them."""
    rates = [
        _state("x_dot", "Velocity of the chassis forward, in the chassis frame", "m/s", 0.1),
        _state("y_dot", "Velocity of the chassis to the left, in the chassis frame", "m/s", 0.1),
        _state("gamma_dot", "Yaw rate", "rad/s", 0.1),
        *(_state(f"alpha_{side}_dot", f"Steering rate, {text}", "rad/s", 0.1) for side, text in _SIDES.items()),
        *(_state(f"beta_{wheel}_dot", f"Rolling rate of wheel {wheel}", "rad/s", 1.0) for wheel in WHEELS),
    ]
    angles = [
        *(
            _state(
                f"alpha_{side}",
                f"Steering angle of the front wheel, {text}; the rear wheel has its negative",
                "rad",
                0.1,
            )
            for side, text in _SIDES.items()
        ),
        *(_state(f"beta_{wheel}", f"Rolling angle of wheel {wheel}, positive forward", "rad", 1.0) for wheel in WHEELS),
        _state("gamma", "Heading of the chassis in the world", "rad", 0.1),
        _state("pose_x", "Position of the chassis in the world, along x", "m", 0.1),
        _state("pose_y", "Position of the chassis in the world, along y", "m", 0.1),
    ]
    coupled, others = (_added(states(memories)) for states in (coupled_states, other_states))
    return rates + coupled + _hidden_states(inputs) + others + angles


def _added(states: Sequence[AddedState]) -> list[Variable]:
    return [_state(row.name, row.text, row.unit, row.nominal, Causality.LOCAL) for row in states]


def _hidden_states(inputs: Inputs) -> list[Variable]:
    local = Causality.LOCAL
    stick = [
        row
        for name, text in _STICTION.items()
        for row in (
            *(
                _state(f"{name}_alpha_{side}", text.format(f"the {word} steering"), "1", 1.0, local)
                for side, word in _SIDES.items()
            ),
            *(_state(f"{name}_beta_{wheel}", text.format(f"wheel {wheel}"), "1", 1.0, local) for wheel in WHEELS),
        )
    ]
    integrals = [
        _state(f"integral_{wheel}", f"Integral part of the torque of drive {wheel}", "Nm", 0.1, local)
        for wheel in WHEELS
    ]
    return stick + (integrals if inputs is Inputs.SPEED else [])


def _state(name: str, text: str, unit: str, nominal: float, causality: Causality = Causality.OUTPUT) -> Variable:
    display = _DEGREES.get(unit, "")
    kind = (causality, Variability.CONTINUOUS, Block.STATE)
    return Variable(name, text, *kind, unit, display_unit=display, start=0.0, nominal=nominal)


def _derivative(state: Variable) -> Variable:
    kind = (Causality.LOCAL, Variability.CONTINUOUS, Block.DERIVATIVE)
    text = f"Derivative of {state.name}"
    return Variable(f"der({state.name})", text, *kind, _PER_SECOND[state.unit], state=state.name)


def _inputs(inputs: Inputs) -> list[Variable]:
    command, text, unit = {
        Inputs.TORQUE: ("torque", "Torque of motor {}, at its shaft", "Nm"),
        Inputs.SPEED: ("speed", "Commanded rolling rate of wheel {}", "rad/s"),
    }[inputs]
    quarter = math.pi / 2
    return [
        *(_input(f"{command}_{wheel}", text.format(wheel), unit) for wheel in WHEELS),
        _input("slope_x", "Angle by which the floor rises along the world's x", "rad", -quarter, quarter),
        _input("slope_y", "Angle by which the floor rises along the world's y", "rad", -quarter, quarter),
        _input("payload", "Mass over the centre of the chassis beyond m_ch", "kg", 0.0),
    ]


def _input(name: str, text: str, unit: str, minimum: float | None = None, maximum: float | None = None) -> Variable:
    display = _DEGREES.get(unit, "")
    kind = (Causality.INPUT, Variability.CONTINUOUS, Block.INPUT)
    return Variable(name, text, *kind, unit, display_unit=display, start=0.0, minimum=minimum, maximum=maximum)


def _parameters(
    vehicle: VehicleDescription, parameters: Parameters, effects: Sequence[Effect], inputs: Inputs
) -> list[Variable]:
    dynamic = [
        (_positive if unit.startswith("kg") else _not_negative)(name, _DYNAMIC[name], unit, parameters[name])
        for name, unit in PARAMETER_UNITS.items()
    ]
    geometry = [
        _positive(name, text, GEOMETRY_UNITS[name], getattr(vehicle.geometry, name)) for name, text in _GEOMETRY.items()
    ]
    drives = _drives(vehicle) if inputs is Inputs.SPEED else []
    of_effects = [row for effect in effects for row in _effect_parameters(effect)]
    springs = _springs(memories_of(effects))
    limits = _friction_limits(vehicle, effects)
    return dynamic + geometry + _regularisation() + limits + drives + springs + of_effects


def _parameter(
    name: str, text: str, unit: str, start: float, minimum: float | None = None, positive: bool = False
) -> Variable:
    display = _DEGREES.get(unit, "")
    kind = (Causality.PARAMETER, Variability.TUNABLE, Block.PARAMETER)
    return Variable(name, text, *kind, unit, display_unit=display, start=start, minimum=minimum, positive=positive)


def _positive(name: str, text: str, unit: str, start: float) -> Variable:
    return _parameter(name, text, unit, start, minimum=0.0, positive=True)


def _not_negative(name: str, text: str, unit: str, start: float) -> Variable:
    return _parameter(name, text, unit, start, minimum=0.0)


def _regularisation() -> list[Variable]:
    coulomb = "Rate at which Coulomb friction has reached 76 %, epsilon of (16)"
    return [
        _positive("epsilon", coulomb, "rad/s", COULOMB_EPSILON),
        _positive("stick_time", "How long motion below stiction goes on before it is held", "s", STICK_TIME),
        _positive("creep_stiffness", "Contact force per slip velocity of a wheel", "N s/m", CREEP_STIFFNESS),
        _positive("mode_tolerance", "Of the steering angles, for the mode", "rad", MODE_TOLERANCE),
    ]


def _friction_limits(vehicle: VehicleDescription, effects: Sequence[Effect]) -> list[Variable]:
    limits = {f"friction_limit_{wheel}": vehicle.limits.floor_friction for wheel in WHEELS}
    for effect in effects:
        if effect.name is EffectName.SLIP:
            limits.update(dict.fromkeys(parameters_of(effect, "friction"), effect.size))
    text = "Largest contact force of wheel {} over its load"
    return [_positive(name, text.format(name.rpartition("_")[2]), "1", limit) for name, limit in limits.items()]


def _drives(vehicle: VehicleDescription) -> list[Variable]:
    gain = "Proportional gain of the speed loops, motor torque per wheel rate"
    limit = "Largest motor torque of the speed loops"
    unwind = "In which the integral of a speed loop follows a torque at its limit"
    return [
        _not_negative("drive_gain", gain, "Nm s/rad", DRIVE_GAIN),
        _not_negative("drive_integral_gain", "Integral gain of the speed loops", "Nm/rad", DRIVE_INTEGRAL_GAIN),
        _positive("drive_torque_limit", limit, "Nm", vehicle.limits.peak_torque),
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
    """Names in the table that a parameter of an effect has: its own, or the friction limits that `slip` is."""
    if effect.name is not EffectName.SLIP:
        return (effect_parameter(effect, parameter),)
    wheels = WHEELS if effect.where in CHASSIS else (WHEELS[WHEEL_PLACES.index(effect.where)],)
    return tuple(f"friction_limit_{wheel}" for wheel in wheels)


def _effect_parameters(effect: Effect) -> list[Variable]:
    if effect.name is EffectName.SLIP:
        return []
    spec = EFFECTS[effect.name]
    return [
        _parameter(
            effect_parameter(effect, entry.name),
            f"{effect}: {entry.meaning}",
            spec.unit(entry.name, effect.where),
            effect[entry.name],
            minimum=0.0 if effect.name in _NEVER_NEGATIVE else None,
        )
        for entry in spec.parameters
    ]


def neutral_effects() -> tuple[Effect, ...]:
    """Every effect that is a term of the equations, at each single place, of size zero.

    A change of a parameter is left out, since the parameters themselves can be tuned, and so is what acts on all
    wheels at once where each wheel has its own.
    """
    return tuple(
        make_effect(name, where, {EFFECTS[name].size.name: 0.0})
        for name in TERMS
        if name is not EffectName.PARAMETER_CHANGE
        for where in EFFECTS[name].places
        if where not in ALL_WHEELS
    )


def _output(name: str, text: str, unit: str) -> Variable:
    kind = (Causality.OUTPUT, Variability.CONTINUOUS, Block.OUTPUT)
    return Variable(name, text, *kind, unit, display_unit=_DEGREES.get(unit, ""))


_GENERALIZED_TORQUES: Final = {
    "Q_alpha_l": ("Torque of the motors on the left steering, through wheels that roll", "Nm"),
    "Q_alpha_r": ("Torque of the motors on the right steering, through wheels that roll", "Nm"),
    "Q_x": ("Force of the motors on the chassis along x, through wheels that roll", "N"),
    "Q_y": ("Force of the motors on the chassis along y, through wheels that roll", "N"),
    "Q_gamma": ("Torque of the motors on the chassis about z, through wheels that roll", "Nm"),
}

_PER_WHEEL: Final = {
    "drive_torque": ("Torque that drive {} reports, at the motor shaft", "Nm"),
    "slip_long": ("Velocity of contact {} over the floor, along the wheel", "m/s"),
    "slip_lat": ("Velocity of contact {} over the floor, across the wheel", "m/s"),
}


_AT_MOTOR: Final = {
    "_reported": ("Rolling angle of wheel {} as the encoder of its motor reports it", "rad"),
    "_dot_reported": ("Rolling rate of wheel {} as the encoder of its motor reports it", "rad/s"),
}


def _outputs(memories: Memories) -> list[Variable]:
    reported = "Steering angle as its encoder reports it, {}"
    return [
        *(_output(f"alpha_{side}_reported", reported.format(text), "rad") for side, text in _SIDES.items()),
        *(
            _output(f"{name}_{wheel}", text.format(wheel), unit)
            for name, (text, unit) in _PER_WHEEL.items()
            for wheel in WHEELS
        ),
        *(_output(name, text, unit) for name, (text, unit) in _GENERALIZED_TORQUES.items()),
        *(
            _output(f"beta_{WHEELS[wheel]}{name}", text.format(WHEELS[wheel]), unit)
            for wheel in memories.gears
            for name, (text, unit) in _AT_MOTOR.items()
        ),
    ]
