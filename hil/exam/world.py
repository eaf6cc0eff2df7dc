"""The world of an exam: which vehicle its cases are driven with, and by what physics."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from emulator.effects import Wanted
from hil.network import network_file_of
from ident.campaign.plan import Plan
from ident.errors import UserError
from ident.records.record import Record
from ident.vehicle.parameters import Parameters

DATA: Final = Path(__file__).parent / "data"
"""Tables of sizes and models of the worlds that an exam knows by itself."""


@dataclass(frozen=True)
class World(abc.ABC):
    """Vehicle and physics; sizes in noise units and the model under test are those of one world.

    Attributes:
        vehicle: shipped name, or path of a vehicle file.
        engine: name of its physics.
        option: that asks for it on the command line.
    """

    vehicle: str
    engine: str
    option: str

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

    @abc.abstractmethod
    def truth(self) -> Parameters:
        """What the vehicle was built with."""

    @abc.abstractmethod
    def can_have(self, name: str, where: str) -> bool:
        """Whether its vehicle can have an effect at a place."""

    @abc.abstractmethod
    def drive(self, plan: Plan, seed: int, effects: Sequence[Wanted]) -> Record:
        """Record of a plan driven by the vehicle.

        Args:
            plan: the campaign.
            seed: of all noise.
            effects: that the vehicle has.

        Raises:
            UserError: the vehicle cannot have the effects, or cannot drive with them.
        """

    @abc.abstractmethod
    def drive_quietly(self, plan: Plan, effects: Sequence[Wanted]) -> Record:
        """The same without noise and without a bus, as fast as can be.

        Raises:
            UserError: as `drive`.
        """


def stored_sizes(world: World, named: Path | None) -> Path:
    """The table of sizes of a world: the one that is named, else the one that the program keeps.

    Raises:
        UserError: there is none.
    """
    if named is None and not world.sizes_file.is_file():
        raise UserError(
            f"No table of sizes is kept for {world}.",
            f"Write one: quasiomni exam calibrate --vehicle {world.vehicle} {world.option} --out FILE; "
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
            "Identify one from a campaign without effects, of that vehicle in that world; then name its "
            "parameters.toml: --model FILE.",
        )
    return named or world.model_file
