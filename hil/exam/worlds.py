"""The worlds that there are: the emulated vehicle in its engines, and one that shares no code with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from emulator.effects import INJECTORS, Wanted
from emulator.engine.choice import ENGINES
from emulator.vehicle import EmulatedVehicle
from hil.bench.prototypes import Emulated, load_emulated
from hil.bench.truth import truth_of
from hil.exam.driving import drive
from hil.exam.quiet import drive_quietly
from hil.exam.sources import Source
from hil.exam.sources.campaigns import drive_campaign
from hil.exam.sources.independent import Truth
from hil.exam.sources.lacking import can_have
from hil.exam.world import World
from ident.campaign.plan import Plan
from ident.effects import Effect
from ident.errors import UserError
from ident.extras import EngineName, require_engine
from ident.records.record import Record
from ident.vehicle.parameters import Parameters, exact_parameters

LENGTHS: Final = "prototype"
"""The vehicle whose lengths the independent one has."""


@dataclass(frozen=True)
class EmulatedWorld(World):
    """The emulated vehicle in an engine."""

    def emulated(self) -> Emulated:
        """Prototype and network.

        Raises:
            DataFileError: a file is missing or malformed, or two places disagree.
        """
        return load_emulated(self.vehicle, self.network_file)

    def truth(self) -> Parameters:
        """Of the prototype."""
        return truth_of(self.vehicle)

    def can_have(self, name: str, where: str) -> bool:
        """Whether there is an injector for it."""
        return name in INJECTORS and where in INJECTORS[name].places

    def drive(self, plan: Plan, seed: int, effects: Sequence[Wanted]) -> Record:
        """Over the bus."""
        with self._emulate(seed, effects, 1.0) as vehicle:
            return drive(plan, vehicle, self.emulated().network, self.vehicle, seed)

    def drive_quietly(self, plan: Plan, effects: Sequence[Wanted]) -> Record:
        """Sampled and controlled in every cycle as over the bus."""
        with self._emulate(0, effects, 0.0) as vehicle:
            return drive_quietly(plan, vehicle, self.emulated().prototype)

    def _emulate(self, seed: int, effects: Sequence[Wanted], noise_scale: float) -> EmulatedVehicle:
        return EmulatedVehicle(
            self.emulated().prototype,
            seed=seed,
            noise_scale=noise_scale,
            make_engine=ENGINES[EngineName(self.engine)],
            effects=effects,
        )


@dataclass(frozen=True)
class IndependentWorld(World):
    """The independent vehicle (`hil.exam.sources`)."""

    def truth(self) -> Parameters:
        """Of `Truth`."""
        return exact_parameters(Truth().parameters)

    def can_have(self, name: str, where: str) -> bool:
        """Whether it was written for that vehicle."""
        return can_have(name, where)

    def drive(self, plan: Plan, seed: int, effects: Sequence[Wanted]) -> Record:
        """All steps side by side."""
        return drive_campaign(plan, seed, _of_the_library(effects))

    def drive_quietly(self, plan: Plan, effects: Sequence[Wanted]) -> Record:
        """The same without noise, from wheels that stand as they should."""
        return drive_campaign(plan, 0, _of_the_library(effects), noise=0.0)


def _of_the_library(effects: Sequence[Wanted]) -> list[Effect]:
    strangers = [str(effect) for effect in effects if not isinstance(effect, Effect)]
    if strangers:
        raise UserError(f"The independent vehicle has no {strangers[0]}.", "Ask for effects of the library, and laws.")
    return [effect for effect in effects if isinstance(effect, Effect)]


def world_of(vehicle: str, engine: EngineName | None, source: Source = Source.EMULATOR) -> World:
    """A world by what the command line says of it.

    Args:
        vehicle: shipped name, or path of a vehicle file.
        engine: of the emulated vehicle; None: that which it has by default.
        source: what drives the cases.

    Raises:
        UserError: the engine is not installed, or the independent vehicle is asked for what it cannot be.
    """
    if source is Source.EMULATOR:
        name = require_engine(engine, "An exam")
        return EmulatedWorld(vehicle, str(name), f"--engine {name}")
    if engine is not None or vehicle != LENGTHS:
        asked = f"--engine {engine}" if engine is not None else f"--vehicle {vehicle}"
        raise UserError(
            f"The vehicle from first principles has physics and parameters of its own, and takes no {asked}.",
            f"Leave {asked} out, or take --source {Source.EMULATOR}.",
        )
    return IndependentWorld(vehicle, str(source), f"--source {source}")
