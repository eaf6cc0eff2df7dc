"""The rows of the table of variables, for a vehicle with its parameters and effects."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from fmu.effect_states import AddedState, coupled_states, other_states
from fmu.parameter_rows import parameter_rows
from fmu.variables import DEGREES, Block, Carried, Causality, Inputs, Variability, Variable, VariableTable, numbered
from ident.effects import EFFECTS, Effect, make_effect, terms_of
from ident.plant.contact import Contacts
from ident.plant.memories import Memories, memories_of
from ident.plant.places import GROUPS
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import Parameters

_SIDES: Final = {"l": "left", "r": "right"}
_PER_SECOND: Final = {
    "s": "1",
    "m": "m/s",
    "rad": "rad/s",
    "m/s": "m/s^2",
    "rad/s": "rad/s^2",
    "1": "1/s",
    "Nm": "Nm/s",
}

FASTEST: Final = "fastest_time_constant"
"""Name of the variable that tells how short a step an explicit method needs."""

_STICTION: Final = {
    "stick": "Creep of {} that its friction remembers, over epsilon times stick_time",
    "lag": "Lagged load on the friction of {}",
}

_LOAD_SIZE: Final = 5.0
"""Of a load on dry friction, as the argument of its tanh: at 4 the friction is that of sliding."""

_HELD: Final = {"x_dot": ("forward", "m/s"), "y_dot": ("to the left", "m/s"), "gamma_dot": ("in yaw", "rad/s")}
"""How a parked chassis creeps."""

_HELD_SIZE: Final = 1e-3
"""Of the creep that is remembered [m/s, rad/s]: that of a wheel on soft contacts under 100 N."""


def variable_table(
    vehicle: VehicleDescription,
    parameters: Parameters,
    effects: Sequence[Effect] = (),
    inputs: Inputs = Inputs.TORQUE,
    contacts: Contacts = Contacts.STIFF,
    limited: bool = False,
) -> VariableTable:
    """The table for a vehicle with its parameters (18) and effects.

    Args:
        vehicle: geometry and limits; start values of the FMU's parameters.
        parameters: identified.
        effects: each adds its parameters; those of `slip` are start values of the friction limits.
        inputs: motor torques, or wheel speeds with the drives' inner loop.
        contacts: start value of their stiffness.
        limited: torque inputs beyond what the motors can are limited to that.
    """
    memories = memories_of(terms_of(effects))
    states = _states(inputs, memories)
    derivatives = [_derivative(state) for state in states]
    tunable = parameter_rows(vehicle, parameters, effects, inputs, contacts, limited)
    return numbered(
        [
            [_time()],
            states,
            derivatives,
            _inputs(vehicle, parameters, inputs),
            tunable,
            _outputs(memories),
            [_mode()],
            [_fastest()],
        ]
    )


def _time() -> Variable:
    return Variable("time", "Simulation time", Causality.INDEPENDENT, Variability.CONTINUOUS, Block.TIME, "s")


def _mode() -> Variable:
    text = "Motion mode k of (9): 1 alignment, 2 steered, 3 lateral, 4 rotation"
    return Variable("mode", text, Causality.OUTPUT, Variability.DISCRETE, Block.MODE, "1", minimum=1, maximum=4)


def _fastest() -> Variable:
    text = "Fastest time constant at rest: explicit methods of order 4 stay stable with steps up to 2.7 of it"
    return Variable(FASTEST, text, Causality.CALCULATED, Variability.TUNABLE, Block.CALCULATED, "s")


def _states(inputs: Inputs, memories: Memories) -> list[Variable]:
    """Rates first, which the equations couple, with those of effects; then what follows from them."""
    rates = [
        _state("x_dot", "Velocity of the chassis forward, in the chassis frame", "m/s", 0.1),
        _state("y_dot", "Velocity of the chassis to the left, in the chassis frame", "m/s", 0.1),
        _state("gamma_dot", "Yaw rate", "rad/s", 0.1),
        *(_state(f"alpha_{side}_dot", f"Steering rate, {text}", "rad/s", 0.5) for side, text in _SIDES.items()),
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
                _state(f"{name}_alpha_{side}", text.format(f"the {word} steering"), "1", _LOAD_SIZE, local)
                for side, word in _SIDES.items()
            ),
            *(
                _state(f"{name}_beta_{wheel}", text.format(f"wheel {wheel}"), "1", _LOAD_SIZE, local)
                for wheel in WHEELS
            ),
        )
    ]
    held = [
        _state(f"held_{name}", f"Creep {way} that contacts at rest remember, over stick_time", unit, _HELD_SIZE, local)
        for name, (way, unit) in _HELD.items()
    ]
    integrals = [
        _state(f"integral_{wheel}", f"Integral part of the torque of drive {wheel}", "Nm", 0.1, local)
        for wheel in WHEELS
    ]
    return stick + held + (integrals if inputs is Inputs.SPEED else [])


def _state(name: str, text: str, unit: str, nominal: float, causality: Causality = Causality.OUTPUT) -> Variable:
    display = DEGREES.get(unit, "")
    kind = (causality, Variability.CONTINUOUS, Block.STATE)
    return Variable(name, text, *kind, unit, display_unit=display, start=0.0, nominal=nominal)


def _derivative(state: Variable) -> Variable:
    kind = (Causality.LOCAL, Variability.CONTINUOUS, Block.DERIVATIVE)
    text = f"Derivative of {state.name}"
    return Variable(f"der({state.name})", text, *kind, _PER_SECOND[state.unit], state=state.name)


@dataclass(frozen=True)
class _Command:
    """What a wheel is driven by: its name, what it says, unit, largest and usual size."""

    name: str
    text: str
    unit: str
    largest: Callable[[VehicleDescription], float]
    usual: Callable[[VehicleDescription], float]


_COMMANDS: Final = {
    Inputs.TORQUE: _Command(
        "torque",
        "Torque of motor {}, at its shaft",
        "Nm",
        lambda vehicle: vehicle.limits.peak_torque,
        lambda vehicle: vehicle.limits.rated_torque,
    ),
    Inputs.SPEED: _Command(
        "speed",
        "Commanded rolling rate of wheel {}",
        "rad/s",
        lambda vehicle: vehicle.limits.motor_speed / vehicle.geometry.gear_ratio,
        lambda vehicle: vehicle.limits.motor_speed / vehicle.geometry.gear_ratio / 3,
    ),
}


def _inputs(vehicle: VehicleDescription, parameters: Parameters, inputs: Inputs) -> list[Variable]:
    command, quarter = _COMMANDS[inputs], math.pi / 2
    largest = command.largest(vehicle)
    slope = Variable(
        "slope_x",
        "Angle by which the floor rises along the world's x",
        Causality.INPUT,
        Variability.CONTINUOUS,
        Block.INPUT,
        "rad",
        display_unit=DEGREES["rad"],
        start=0.0,
        minimum=-quarter,
        maximum=quarter,
        nominal=0.1,
    )
    across = replace(slope, name="slope_y", description="Angle by which the floor rises along the world's y")
    drive = replace(
        slope,
        unit=command.unit,
        display_unit=DEGREES.get(command.unit, ""),
        minimum=-largest,
        maximum=largest,
        advisory=True,
        nominal=command.usual(vehicle),
    )
    load = replace(
        slope,
        name="payload",
        description="Mass over the centre of the chassis beyond m_ch",
        unit="kg",
        display_unit="",
        minimum=0.0,
        maximum=None,
        nominal=parameters["m_ch"] / 4,
    )
    wheels = [
        replace(drive, name=f"{command.name}_{wheel}", description=command.text.format(wheel)) for wheel in WHEELS
    ]
    return [*wheels, slope, across, load]


def neutral_effects(carried: Carried = Carried.STATELESS) -> tuple[Effect, ...]:
    """Effects that a model has for users to set, at each single place, of size zero.

    Args:
        carried: which. What takes the place of a parameter that there is anyway, as `slip` does, is that parameter.
    """
    return tuple(
        make_effect(kind.name, where, kind.neutral())
        for kind in EFFECTS.values()
        if kind.always or (carried is Carried.ALL and not kind.stands_for)
        for where in kind.places
        if where not in GROUPS
    )


def _output(name: str, text: str, unit: str) -> Variable:
    kind = (Causality.OUTPUT, Variability.CONTINUOUS, Block.OUTPUT)
    return Variable(name, text, *kind, unit, display_unit=DEGREES.get(unit, ""))


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
