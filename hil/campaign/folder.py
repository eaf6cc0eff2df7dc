"""The run folder: everything a run needs to be resumed, identified and reported, here or on another machine.

| entry | what |
|---|---|
| `run.json` | seed, steps, excitations, what was driven and on which bus |
| `vehicle.toml` | the vehicle file as used |
| `simulator.toml` | the model that the emulated vehicle was made from, where there was one |
| `network/` | the network file and its EDS files as used, so that they can be read again (`carried`) |
| `frames/NNN_step.blf` | every frame, one file a step, in the order driven |
| `frames/NNN_step.part.blf` | what there is of a step that was not finished |
| `frames/NNN_step.unusable.blf` | a step that cannot be used; `--resume` drives it again |
| `parameters.toml`, `report.html` | results |
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.campaign.carried import (
    NETWORK_FILE,
    SIMULATOR_FILE,
    VEHICLE_FILE,
    carried_network,
    carried_simulator,
    carried_vehicle,
    is_carried,
)
from hil.network import Network, network_file_of
from hil.network.described import Described, load_described
from ident.campaign.excitation import FourierSeries
from ident.campaign.optimise import Excitation
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.steps import DRIVING_ORDER
from ident.errors import DataFileError
from ident.estimate.result import KnownInertia
from ident.extras import EngineName
from ident.reading import read_json
from ident.vehicle.description import VehicleDescription

SCHEMA: Final = "quasiomni.run/1"


@dataclass(frozen=True)
class RunFolder:
    """Paths inside a run folder."""

    path: Path

    @property
    def manifest(self) -> Path:
        """Plan and provenance."""
        return self.path / "run.json"

    @property
    def vehicle(self) -> Path:
        """The vehicle file as used."""
        return self.path / VEHICLE_FILE

    @property
    def simulator(self) -> Path:
        """The model that the emulated vehicle was made from, where there was one."""
        return self.path / SIMULATOR_FILE

    @property
    def network(self) -> Path:
        """The network file as used, its EDS files beside or below it."""
        return self.path / "network" / NETWORK_FILE

    @property
    def frames(self) -> Path:
        """The logs."""
        return self.path / "frames"

    @property
    def parameters(self) -> Path:
        """The result."""
        return self.path / "parameters.toml"

    @property
    def sources(self) -> tuple[Path, ...]:
        """What a run is read from: all but its results."""
        return self.manifest, self.vehicle, *self.network.parent.rglob("*"), *self.frames.glob("*")

    @property
    def report(self) -> Path:
        """The report."""
        return self.path / "report.html"


@dataclass(frozen=True)
class Run:
    """A run as its folder describes it.

    Attributes:
        folder: where it lives.
        plan: what is to be driven.
        network: of the vehicle.
        seed: of the excitation and, on the emulator, of all noise.
        bus: what it was driven on, for people.
        prototype: emulated prototype, empty on a real vehicle.
        known_inertia: B_w where it was given.
        payload: mass of the load of the loaded steps [kg].
        demo: it is a demo's, which the next one may replace.
        engine: physics engine of the emulated prototype, None on a real vehicle.
        simulator: `parameters.toml` that the emulated vehicle is made from, None for the prototype as it is.
        opened: it was read from its folder, rather than planned.
    """

    folder: RunFolder
    plan: Plan
    network: Network
    seed: int
    bus: str
    prototype: str
    known_inertia: KnownInertia | None
    payload: float = 0.0
    demo: bool = False
    engine: EngineName | None = None
    simulator: Path | None = None
    opened: bool = False

    @property
    def emulated(self) -> str:
        """What the emulator plays: a shipped prototype by name, or the vehicle file that one is derived from.

        A run folder has that file itself, so that it can be moved; one that a demo is about to replace has another's.
        """
        own = Path(self.prototype).suffix and self.opened
        return str(self.folder.vehicle) if own else self.prototype

    @property
    def rehearsed(self) -> str:
        """What an emulator plays who repeats the run: the same, or the vehicle file where a real vehicle was driven."""
        return self.emulated or str(self.folder.vehicle)


def sources_of(path: Path) -> tuple[Path, ...]:
    """The files that are read where a command is given a run folder, a folder of logs, or a file."""
    if not path.is_dir():
        return (path,)
    return (*RunFolder(path).sources, *path.glob("[0-9][0-9][0-9]_*"))


def carries_vehicle(folder: RunFolder, path: Path) -> bool:
    """Whether a vehicle file is the one that the folder carries."""
    return is_carried(carried_vehicle(path), folder.path)


def carries_simulator(folder: RunFolder, path: Path) -> bool:
    """Whether a model is the one that the folder carries."""
    return is_carried(carried_simulator(path), folder.path)


def carries_network(folder: RunFolder, path: Path) -> bool:
    """Whether a network file, with its EDS files, is the one that the folder carries."""
    return is_carried(carried_network(path), folder.network.parent)


def open_run(path: Path) -> Run:
    """Read a run folder.

    Raises:
        DataFileError: it is no run folder, or its manifest is damaged.
    """
    folder = RunFolder(path)
    if not folder.manifest.is_file():
        raise DataFileError(f"{path} is no run folder: it has no run.json.", "Name a folder that a campaign wrote.")
    described = load_described(folder.vehicle, folder.network)
    try:
        return _restore(folder, read_json(folder.manifest), described.vehicle, described.network)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise DataFileError(
            f"{folder.manifest} is damaged: {error!r}.",
            "Identify from its frames instead: quasiomni identify FOLDER/frames --vehicle ... --network ...",
        ) from error


def describe(run: Run | None, vehicle: str | None, network: Path | None) -> Described:
    """The vehicle by the files that are given, else by those of a run, else the prototype.

    Args:
        run: whose own files hold where others are not given.
        vehicle: shipped vehicle file by name, or a path.
        network: network file; where only the vehicle is given, frames of a run are still those of its own network.

    Raises:
        DataFileError: a file is missing or malformed, or two places disagree.
    """
    if run is None:
        name = vehicle or "prototype"
        return load_described(name, network or network_file_of(name))
    return load_described(vehicle or run.folder.vehicle, network or run.folder.network)


def manifest_of(run: Run) -> dict[str, Any]:
    """Contents of `run.json`; `open_run` reads them."""
    plan, inertia = run.plan, run.known_inertia
    return {
        "schema": SCHEMA,
        "seed": run.seed,
        "bus": run.bus,
        "prototype": run.prototype,
        "known_inertia": None if inertia is None else [inertia.value, inertia.std, inertia.source],
        "periods": plan.periods,
        "cycle": plan.cycle,
        **({"payload": run.payload} if run.payload else {}),
        **({"demo": True} if run.demo else {}),
        **({"engine": run.engine} if run.engine else {}),
        **({"simulator": SIMULATOR_FILE} if run.simulator else {}),
        "steps": list(plan.steps),
        "excitations": {step: excitation_entry(excitation) for step, excitation in plan.excitations.items()},
    }


def _known_step(name: str) -> str:
    if name not in DRIVING_ORDER:
        raise ValueError(f"step {name!r}, which is none of a campaign")
    return name


def excitation_entry(excitation: Excitation) -> dict[str, Any]:
    """An excitation as plain values."""
    return {
        "period": excitation.series.period,
        "cosine": excitation.series.cosine.tolist(),
        "sine": excitation.series.sine.tolist(),
        "condition": excitation.condition,
        "binding": excitation.binding,
    }


def _restore(folder: RunFolder, manifest: Mapping[str, Any], vehicle: VehicleDescription, network: Network) -> Run:
    if manifest["schema"] != SCHEMA:
        raise ValueError(f"schema {manifest['schema']!r}, not {SCHEMA!r}")
    if manifest["cycle"] != network.cycle_period:
        raise ValueError(f"a cycle of {manifest['cycle']!r} s, not that of {network.path}")
    excitations = {_known_step(step): excitation_of(entry) for step, entry in manifest["excitations"].items()}
    plan = assemble_plan(
        vehicle,
        excitations,
        steps=[_known_step(step) for step in manifest["steps"]],
        periods=int(manifest["periods"]),
        cycle=float(manifest["cycle"]),
    )
    inertia = manifest["known_inertia"]
    return Run(
        folder=folder,
        plan=plan,
        network=network,
        seed=int(manifest["seed"]),
        bus=str(manifest["bus"]),
        prototype=str(manifest["prototype"]),
        known_inertia=None if inertia is None else KnownInertia(*inertia),
        payload=float(manifest.get("payload", 0.0)),
        demo=manifest.get("demo") is True,
        engine=_engine(manifest),
        simulator=folder.simulator if "simulator" in manifest else None,
        opened=True,
    )


def _engine(manifest: Mapping[str, Any]) -> EngineName | None:
    """Of an emulated vehicle; runs of before there was a choice say none."""
    return EngineName(manifest.get("engine", EngineName.PYBULLET)) if manifest["prototype"] else None


def excitation_of(entry: Mapping[str, Any]) -> Excitation:
    """The excitation of `excitation_entry`."""
    series = FourierSeries(np.array(entry["cosine"]), np.array(entry["sine"]), float(entry["period"]))
    return Excitation(series, float(entry["condition"]), str(entry["binding"]))
