"""Options that several commands share, and what several commands need."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Annotated, Final

import typer

from ident.extras import TITLES, EngineName, Extra, require, require_engine
from ident.vehicle.parameters import Parameters
from quasiomni.application import console, errors

if TYPE_CHECKING:
    from hil.bench.simulators import Simulator
    from hil.bus.urgency import Urgency
    from ident.effects import Effect  # loads CasADi, which few commands need

READERS: Final[Mapping[str, tuple[Extra, str]]] = MappingProxyType(
    {
        ".parquet": (Extra.RECORDS, "pyarrow"),
        ".mf4": (Extra.RECORDS, "asammdf"),
        ".mcap": (Extra.MCAP, "mcap"),
    }
)
"""What reads and writes files with these endings: a module, and the extra that brings it."""

DEFAULT_BUS = "unix:/tmp/can0"
"""What the emulator serves, and where the commands around it look for it."""

VehicleOption = Annotated[
    str, typer.Option("--vehicle", help="Vehicle file: `prototype`, `compact`, or the path of your own.")
]
GivenVehicleOption = Annotated[
    str | None,
    typer.Option(
        "--vehicle",
        help="Vehicle file: `prototype`, `compact`, or the path of your own. Default: that of the run folder, or the "
        "prototype.",
    ),
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
    str | None,
    typer.Option(
        "--plant",
        help="`fmu:FILE`: an FMU with torque inputs in place of the physics engine; "
        "`fmu-bus:FILE`, campaign only: an FMU of FMI-LS-BUS with its own devices.",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Take a model that was assessed as unusable all the same.")]
EngineOption = Annotated[
    EngineName | None,
    typer.Option("--engine", help="Physics engine of the emulated vehicle. Default: PyBullet where it is installed."),
]
FromOption = Annotated[
    Path | None,
    typer.Option(
        "--from",
        help="parameters.toml whose parameters and effects the emulated vehicle has, e.g. what `diagnose --extended` "
        "wrote. --effect adds to them.",
    ),
]
PriorityOption = Annotated[
    bool,
    typer.Option(
        "--priority/--no-priority",
        help="In real time the loop goes before other programs (SCHED_FIFO) and stays in memory, where permitted.",
    ),
]
GuiOption = Annotated[bool, typer.Option("--gui", help="Show the emulated vehicle in a window.")]


def say_urgency(urgency: Urgency) -> None:
    """What to do where a loop did not get what it asked for."""
    if urgency.remedy:
        errors.print(urgency.remedy, style="yellow", highlight=False, soft_wrap=True)


def parse_effects(texts: Sequence[str] | None) -> tuple[Effect, ...]:
    """The effects that were asked for."""
    if not texts:
        return ()
    from ident.effects.text import parse_effect

    return tuple(map(parse_effect, texts))


def parse_plant(text: str | None, *, force: bool, on_bus: bool = False) -> Path | None:
    """The FMU that was asked for; what it needs is here.

    Args:
        text: `fmu:FILE`, or with `on_bus` also `fmu-bus:FILE`.
        force: take a model that was assessed as unusable.
        on_bus: an FMU may bring its devices along.

    Raises:
        UserError: the text names no FMU, or its model was assessed as unusable and is not taken by force.
    """
    if text is None:
        return None
    require(Extra.EMULATOR, "--plant", ("durand",))
    require(Extra.COSIM, "--plant")
    from hil.cosimulation.assessment import (
        refuse_unusable_fmu,  # needs mathematics that commands around the bus do without
    )
    from hil.cosimulation.plant import plant_path  # needs the emulator, which a real vehicle's computer does not have
    from hil.lsbus.bench import bus_plant_path, is_on_bus  # the same

    path = bus_plant_path(text) if on_bus and is_on_bus(text) else plant_path(text)
    refuse_unusable_fmu(path, force=force)
    return path


def read_simulator(path: Path | None, *, force: bool) -> Simulator | None:
    """The model that the emulated vehicle is to be made from.

    Raises:
        UserError: the file cannot be used, or was assessed as unusable and is not taken by force.
    """
    if path is None:
        return None
    require_engine(None, "--from")
    from hil.bench import simulators  # needs mathematics, and the emulator

    return simulators.read_simulator(path, force=force)


def load_emulation() -> ModuleType:
    """The emulated side, loaded only where it is asked for."""
    require_engine(None, "The emulator")
    from hil.bench import emulation

    return emulation


def choose_engine(asked: EngineName | None) -> EngineName:
    """The engine that was asked for, or the default; says which.

    Raises:
        UserError: it is not installed.
    """
    engine = require_engine(asked, "The emulator")
    console.print(f"The vehicle is emulated in {TITLES[engine]}.", highlight=False)
    return engine


def require_readers(paths: Iterable[Path]) -> None:
    """Refuse records of kinds that cannot be read here, before the first is read.

    Raises:
        UserError: an extra is missing.
    """
    for suffix in sorted({path.suffix.lower() for path in paths} & READERS.keys()):
        extra, module = READERS[suffix]
        require(extra, f"A record that ends in {suffix}", (module,))


def tell_native(path: Path | None) -> None:
    """Say what it means to load an FMU, before it is."""
    if path is not None:
        errors.print(
            f"{path.name} is native code of whoever made it, and runs here with your rights.",
            style="yellow",
            highlight=False,
            soft_wrap=True,
        )


def truth_of(prototype: str) -> Parameters:
    """What the emulated prototype was built with; needs its data file, not the engine."""
    from hil.bench import truth

    return truth.truth_of(prototype)
