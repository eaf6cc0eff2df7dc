"""The world of an exam: which vehicle its cases are driven with, in which physics engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from emulator.effects import Wanted
from emulator.engine.choice import ENGINES
from emulator.vehicle import EmulatedVehicle
from hil.bench.prototypes import Emulated, load_emulated
from hil.campaign.folder import network_file_of
from ident.errors import UserError
from ident.extras import EngineName, require_engine

DATA: Final = Path(__file__).parent / "data"
"""Tables of sizes and models of the worlds that an exam knows by itself."""


@dataclass(frozen=True)
class World:
    """Vehicle and engine; sizes in noise units and the model under test are those of one world.

    Attributes:
        vehicle: that the emulator plays: shipped name, or path of a vehicle file.
        engine: of its physics.
    """

    vehicle: str
    engine: EngineName

    def __str__(self) -> str:
        return f"{self.vehicle} in {self.engine}"

    @property
    def network_file(self) -> Path:
        """Of the vehicle."""
        return network_file_of(self.vehicle)

    @property
    def sizes_file(self) -> Path:
        """Where the program keeps its table of sizes; never there for the path of a vehicle file."""
        return DATA / f"sizes.{self.vehicle}.{self.engine}.json"

    @property
    def model_file(self) -> Path:
        """Where the program keeps the model under test, as identified from a campaign without effects."""
        return DATA / f"model.{self.vehicle}.{self.engine}.toml"

    def emulated(self) -> Emulated:
        """Prototype and network.

        Raises:
            DataFileError: a file is missing or malformed, or two places disagree.
        """
        return load_emulated(self.vehicle, self.network_file)

    def emulate(self, seed: int, effects: Sequence[Wanted], noise_scale: float = 1.0) -> EmulatedVehicle:
        """The vehicle, to be closed.

        Args:
            seed: of all noise.
            effects: that it has.
            noise_scale: factor on every random source.

        Raises:
            UserError: it cannot have the effects.
        """
        return EmulatedVehicle(
            self.emulated().prototype,
            seed=seed,
            noise_scale=noise_scale,
            make_engine=ENGINES[self.engine],
            effects=effects,
        )


def world_of(vehicle: str, engine: EngineName | None) -> World:
    """The world of a vehicle and an engine; None: the engine that emulated vehicles have by default.

    Raises:
        UserError: the engine is not installed.
    """
    return World(vehicle, require_engine(engine, "An exam"))


def stored_sizes(world: World, named: Path | None) -> Path:
    """The table of sizes of a world: the one that is named, else the one that the program keeps.

    Raises:
        UserError: there is none.
    """
    if named is None and not world.sizes_file.is_file():
        raise UserError(
            f"No table of sizes is kept for {world}.",
            f"Write one: quasiomni exam calibrate --vehicle {world.vehicle} --engine {world.engine} --out FILE; "
            "then name it: --sizes FILE.",
        )
    return named or world.sizes_file


def stored_model(world: World, named: Path | None) -> Path:
    """The model under test of a world: the one that is named, else the one that the program keeps.

    Raises:
        UserError: there is none.
    """
    if named is None and not world.model_file.is_file():
        raise UserError(
            f"No model to be tested is kept for {world}.",
            "Identify one from a campaign without effects, of that vehicle in that engine; then name its "
            "parameters.toml: --model FILE.",
        )
    return named or world.model_file
