"""The command that describes a vehicle of one's own."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from hil.describing import ASKED, Measures, check_measures, write_description
from ident.errors import UserError
from quasiomni.application import app, console

Number = float | None


@app.command()
def init(
    vehicle: Annotated[Path, typer.Argument(help="Vehicle file to write, e.g. `my_vehicle.toml`.")],
    wheelbase: Annotated[Number, typer.Option(help="Between front and rear steering axes [m].")] = None,
    track_width: Annotated[Number, typer.Option(help="Between left and right steering axes [m].")] = None,
    wheel_offset: Annotated[Number, typer.Option(help="Steering axis to wheel contact, along the axle [m].")] = None,
    wheel_radius: Annotated[Number, typer.Option(help="Of the loaded wheel [m].")] = None,
    gear_ratio: Annotated[Number, typer.Option(help="Motor turns per wheel turn.")] = None,
    mass: Annotated[Number, typer.Option(help="Of the whole vehicle [kg].")] = None,
    rated_torque: Annotated[Number, typer.Option(help="Of a motor, at its shaft [Nm].")] = None,
    peak_torque: Annotated[Number, typer.Option(help="Of a motor [Nm]. Default: three times the rated one.")] = None,
    motor_speed: Annotated[Number, typer.Option(help="Highest of a motor [rad/s]. Default: 314.")] = None,
    steering_limit: Annotated[Number, typer.Option(help="Stop of the steering [rad]. Default: 1.62.")] = None,
    floor_friction: Annotated[Number, typer.Option(help="Adhesion between wheel and floor. Default: 0.6.")] = None,
    floor_length: Annotated[Number, typer.Option(help="Free floor along the vehicle [m]. Default: enough.")] = None,
    floor_width: Annotated[Number, typer.Option(help="Free floor across the vehicle [m]. Default: enough.")] = None,
) -> None:
    """Describe your own vehicle: writes a commented vehicle file and, beside it, network and EDS files.

    They can be rehearsed on the emulator at once. On a terminal, what is not given is asked for.
    """
    numbers = {
        "wheelbase": wheelbase,
        "track_width": track_width,
        "wheel_offset": wheel_offset,
        "wheel_radius": wheel_radius,
        "gear_ratio": gear_ratio,
        "mass": mass,
        "rated_torque": rated_torque,
        "peak_torque": peak_torque,
        "motor_speed": motor_speed,
        "steering_limit": steering_limit,
        "floor_friction": floor_friction,
        "floor_length": floor_length,
        "floor_width": floor_width,
    }
    measures = check_measures(_asked_for({name: value for name, value in numbers.items() if value is not None}))
    written = write_description(measures, vehicle)
    console.print(f"Written: {', '.join(map(str, written))}", highlight=False, soft_wrap=True)
    _say_next(measures, vehicle)


def _asked_for(given: Mapping[str, float]) -> dict[str, float]:
    """What is given, and what a person at a terminal answers for the rest."""
    answers = dict(given)
    if sys.stdin.isatty():
        for name, measure in ASKED.items():
            if name not in answers:
                unit = "" if measure.unit == "1" else f" [{measure.unit}]"
                answers[name] = typer.prompt(f"{name}, {measure.meaning}{unit}", type=float)
    for name, value in answers.items():
        if not math.isfinite(value):
            raise UserError(f"{name} = {value} is no number.", "Give it in SI units.")
    return answers


def _say_next(measures: Measures, vehicle: Path) -> None:
    name = str(vehicle)
    if measures.assumed:
        console.print(
            f"Assumed, as their sources in {name} say: {', '.join(sorted(measures.assumed))}.", soft_wrap=True
        )
    console.print("Frictions and inertias are guessed from mass, lengths and rated torque; their std says how roughly.")
    command = f"quasiomni campaign --vehicle {name} --out runs/rehearsal"
    console.print(Text.assemble("Next: ", (command, "bold")), soft_wrap=True)
