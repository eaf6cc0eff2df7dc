"""Options that several commands share, and what several commands need."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Annotated

import typer

from ident.errors import UserError
from ident.vehicle.effect_text import parse_effect
from ident.vehicle.effects import Effect

VehicleOption = Annotated[
    str, typer.Option("--vehicle", help="Vehicle file: `prototype`, `compact`, or the path of your own.")
]
NetworkOption = Annotated[
    Path | None, typer.Option("--network", help="Network file: nodes, units, directions. Default: the vehicle's.")
]
InertiaOption = Annotated[float | None, typer.Option("--b-w", help="Give B_w [kg m²] instead of lifting the wheels.")]
InertiaStdOption = Annotated[
    float | None, typer.Option("--b-w-std", help="Standard deviation of the B_w given [kg m²]; needed with --b-w.")
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the excitation and of all emulated noise.")]
EffectOption = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        help="NAME@PLACE=SIZE that the emulated vehicle has, e.g. `stribeck@steering_left=6Nm`; repeat for more. "
        "Noted nowhere in the run: name it again to --resume.",
    ),
]
PlantOption = Annotated[
    str | None, typer.Option("--plant", help="`fmu:FILE`: an FMU with torque inputs in place of the physics engine.")
]
GuiOption = Annotated[bool, typer.Option("--gui", help="Show the emulated vehicle in a window.")]


def parse_effects(texts: Sequence[str] | None) -> tuple[Effect, ...]:
    """The effects that were asked for."""
    return tuple(parse_effect(text) for text in texts or ())


def parse_plant(text: str | None) -> Path | None:
    """The FMU that was asked for."""
    if text is None:
        return None
    from hil.plants import plant_path  # needs the emulator, which a real vehicle's computer does not have

    return plant_path(text)


def load_emulation() -> ModuleType:
    """The emulated side, loaded only where it is asked for."""
    try:
        from hil import emulation
    except ImportError as error:
        raise UserError(
            f"The emulator is not installed ({error.name}).", "Install it: pip install 'quasiomni[emulator]'."
        ) from error
    return emulation
