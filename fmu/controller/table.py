"""Variables of the controller: what it measures, asks for and remembers, and the numbers of its cascades."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from fmu.variables import DEGREES, Block, Causality, Variability, Variable, VariableTable, numbered
from ident.campaign.controller import REST, LoopLimits
from ident.campaign.loops import STEERING_RATE_CYCLES, LoopDesign
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.plant.modes import Mode
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS

_POSITIONS: Final = {"alpha_l": "rad", "alpha_r": "rad", "gamma": "rad", "x": "m", "y": "m"}
_FORCES: Final = {"rad": "Nm", "m": "N"}
_GAINS: Final = {"rad": ("Nm s/rad", "Nm/rad"), "m": ("N s/m", "N/m")}
_PATH: Final = ("x", "y", "gamma")


@dataclass(frozen=True)
class ControllerSource:
    """What the FMU of a controller is made from.

    Attributes:
        vehicle: whose it is.
        reference: that it drives; steering angles and one coordinate on the floor.
        mode: k of (9) of the reference.
        designs, limits: of every loop, by coordinate.
        provenance: what a reader must know to repeat it, by name.
    """

    vehicle: VehicleDescription
    reference: Reference
    mode: Mode
    designs: Mapping[str, LoopDesign]
    limits: Mapping[str, LoopLimits]
    provenance: Mapping[str, str]

    @property
    def loops(self) -> tuple[str, ...]:
        """Coordinates in the order of the loops."""
        return tuple(self.reference.tracks)

    def dead_band(self, loop: str) -> float:
        """Position error at standstill that the integrator leaves alone [rad or m]."""
        moves = bool((abs(self.reference.tracks[loop].velocity) > REST).any())
        return self.limits[loop].dead_band if moves else self.limits[loop].holding_band


Groups = Mapping[str, list[Variable]]
"""Rows by the name that the C code has for where the first of them is."""


def states_of(source: ControllerSource) -> Groups:
    """What the controller remembers, and the outputs that it holds between samples."""
    loops = [(loop, _POSITIONS[loop]) for loop in source.loops]
    driven = source.reference.coordinate
    past = [(side, back) for side in STEERING_LOOPS for back in range(STEERING_RATE_CYCLES, 0, -1)]
    return MappingProxyType(
        {
            "TORQUE": [
                _held(f"torque_{wheel}", f"Torque asked of motor {wheel}, at its shaft", "Nm", Causality.OUTPUT)
                for wheel in WHEELS
            ],
            "ERROR": [
                _held(f"error_{loop}", f"Reference minus measured {loop} at the last sample", unit, Causality.OUTPUT)
                for loop, unit in loops
            ],
            "INTEGRAL": [
                _held(f"integral_{loop}", f"Integral part of the loop of {loop}", _FORCES[unit]) for loop, unit in loops
            ],
            "TRAVEL": [
                _held(f"travel_{driven}", f"How far the wheels have carried {driven}", _POSITIONS.get(driven, "rad"))
            ],
            "LAST_BETA": [
                _held(f"last_beta_{wheel}", f"Rolling angle of wheel {wheel} at the last sample", "rad")
                for wheel in WHEELS
            ],
            "PAST_ALPHA": [
                _held(f"past_{side}[{back}]", f"{side} measured {back} samples before the next", "rad")
                for side, back in past
            ],
            "SAMPLE": [_held("samples", "Samples that have been taken", "1")],
            "ELAPSED": [_held("elapsed", "Time since the start", "s")],
        }
    )


def inputs_of() -> Groups:
    """What is measured."""
    return MappingProxyType(
        {
            "BETA": [_input(f"beta_{wheel}", f"Rolling angle of wheel {wheel}, measured") for wheel in WHEELS],
            "ALPHA": [_input(side, f"Steering angle {side}, measured") for side in STEERING_LOOPS],
        }
    )


_PER_LOOP: Final[tuple[tuple[str, str, Callable[[str], str], Callable[[ControllerSource, str], float]], ...]] = (
    (
        "position_gain",
        "Rate asked for per position error of {}",
        lambda _: "1/s",
        lambda s, n: s.designs[n].position_gain,
    ),
    (
        "velocity_gain",
        "Generalized torque per error of the rate of {}",
        lambda unit: _GAINS[unit][0],
        lambda s, n: s.designs[n].velocity_gain,
    ),
    (
        "integral_gain",
        "Generalized torque per integrated error of the rate of {}",
        lambda unit: _GAINS[unit][1],
        lambda s, n: s.designs[n].integral_gain,
    ),
    (
        "integral_limit",
        "Largest integral part of the loop of {}",
        lambda unit: _FORCES[unit],
        lambda s, n: s.limits[n].integral,
    ),
    (
        "following_error",
        "Position error of {} at which a step answers with an error",
        lambda unit: unit,
        lambda s, n: s.limits[n].following_error,
    ),
    (
        "dead_band",
        "Position error of {} at standstill that the integrator leaves alone",
        lambda unit: unit,
        lambda s, n: s.dead_band(n),
    ),
)
"""Numbers of each loop: name, text, unit by that of the coordinate, start value."""


def parameters_of(source: ControllerSource) -> Groups:
    """The numbers of the cascades, and the largest torque."""
    groups = {
        name.upper(): [
            _parameter(f"{name}_{loop}", text.format(loop), unit(_POSITIONS[loop]), value(source, loop))
            for loop in source.loops
        ]
        for name, text, unit, value in _PER_LOOP
    }
    limit = source.vehicle.limits.peak_torque
    groups["TORQUE_LIMIT"] = [_parameter("torque_limit", "Largest torque asked of a motor, either way", "Nm", limit)]
    return MappingProxyType(groups)


def controller_table(source: ControllerSource) -> VariableTable:
    """All variables of the controller."""
    groups = states_of(source), inputs_of(), parameters_of(source)
    states, inputs, parameters = ([row for rows in group.values() for row in rows] for group in groups)
    return numbered([[_time()], states, inputs, parameters, _outputs(source), [_mode(source.mode)]])


def _time() -> Variable:
    return Variable("time", "Simulation time", Causality.INDEPENDENT, Variability.CONTINUOUS, Block.TIME, "s")


def _mode(mode: Mode) -> Variable:
    text = f"Motion mode k of (9) that the reference is in, {mode.value}"
    kind = (Causality.OUTPUT, Variability.DISCRETE, Block.MODE)
    return Variable("mode", text, *kind, "1", minimum=1, maximum=4)


def _held(name: str, text: str, unit: str, causality: Causality = Causality.LOCAL) -> Variable:
    kind = (causality, Variability.DISCRETE, Block.STATE)
    return Variable(name, text, *kind, unit, display_unit=DEGREES.get(unit, ""), start=0.0)


def _input(name: str, text: str) -> Variable:
    kind = (Causality.INPUT, Variability.CONTINUOUS, Block.INPUT)
    return Variable(name, text, *kind, "rad", display_unit=DEGREES["rad"], start=0.0)


def _parameter(name: str, text: str, unit: str, start: float) -> Variable:
    kind = (Causality.PARAMETER, Variability.TUNABLE, Block.PARAMETER)
    return Variable(name, text, *kind, unit, display_unit=DEGREES.get(unit, ""), start=start, minimum=0.0)


def _outputs(source: ControllerSource) -> list[Variable]:
    loops = [(f"reference_{loop}", f"Reference of {loop}", _POSITIONS[loop]) for loop in source.loops]
    path = [(f"path_{name}", f"Where the chassis is to be, {name}", _POSITIONS[name]) for name in _PATH]
    kind = (Causality.OUTPUT, Variability.DISCRETE, Block.OUTPUT)
    return [
        Variable(name, text, *kind, unit, display_unit=DEGREES.get(unit, "")) for name, text, unit in (*loops, *path)
    ]
