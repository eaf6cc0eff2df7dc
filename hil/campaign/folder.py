"""The run folder: everything a run needs to be resumed, identified and reported, here or on another machine.

| entry | what |
|---|---|
| `run.json` | seed, steps, excitations, what was driven and on which bus |
| `vehicle.toml` | the vehicle file as used |
| `network/` | the network file and its EDS files as used |
| `frames/NNN_step.blf` | every frame, one file a step, in the order driven |
| `parameters.toml`, `report.html` | results |
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.network import DEFAULT_NETWORK, Network, load_network
from ident.campaign.excitation import FourierSeries
from ident.campaign.optimise import Excitation
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.steps import DRIVING_ORDER
from ident.errors import CampaignError, DataFileError
from ident.estimate.identify import KnownInertia
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.run/1"


def network_file_of(vehicle: str) -> Path:
    """The network file shipped for a vehicle, by the vehicle's name or the name of its file."""
    shipped = DEFAULT_NETWORK.with_name(f"{Path(vehicle).stem}.toml")
    return shipped if shipped.is_file() else DEFAULT_NETWORK


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
        return self.path / "vehicle.toml"

    @property
    def network(self) -> Path:
        """The network file as used, its EDS files beside it."""
        return self.path / "network" / "network.toml"

    @property
    def frames(self) -> Path:
        """The logs."""
        return self.path / "frames"

    @property
    def parameters(self) -> Path:
        """The result."""
        return self.path / "parameters.toml"

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
    """

    folder: RunFolder
    plan: Plan
    network: Network
    seed: int
    bus: str
    prototype: str
    known_inertia: KnownInertia | None
    payload: float = 0.0


def refuse_used(folder: RunFolder) -> None:
    """Refuse a folder that a new run would overwrite.

    Raises:
        CampaignError: the folder already holds a run.
    """
    if folder.manifest.exists() or any(folder.frames.glob("*")):
        raise CampaignError(
            f"{folder.path} already holds a run.", "Go on with it (--resume), or name another folder (--out)."
        )


def create_run(run: Run, vehicle_file: Path) -> None:
    """Make the folder, copy vehicle and network files, write the manifest last.

    Raises:
        CampaignError: the folder already holds a run, or cannot be written.
    """
    refuse_used(run.folder)
    try:
        _write_run(run, vehicle_file)
    except OSError as error:
        raise CampaignError(
            f"{run.folder.path} cannot be made a run folder: {error.strerror or error}.",
            "Name a folder that can be written (--out), or free some space.",
        ) from error


def _write_run(run: Run, vehicle_file: Path) -> None:
    folder = run.folder
    folder.network.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(vehicle_file, folder.vehicle)
    shutil.copyfile(run.network.path, folder.network)
    for eds in {node.eds for node in run.network.nodes}:
        shutil.copyfile(eds, folder.network.parent / eds.name)
    write_whole(json.dumps(_manifest(run), indent=1), folder.manifest)


def open_run(path: Path) -> Run:
    """Read a run folder.

    Raises:
        DataFileError: it is no run folder, or its manifest is damaged.
    """
    folder = RunFolder(path)
    if not folder.manifest.is_file():
        raise DataFileError(f"{path} is no run folder: it has no run.json.", "Name a folder that a campaign wrote.")
    vehicle, network = load_vehicle(folder.vehicle), load_network(folder.network)
    try:
        manifest = json.loads(folder.manifest.read_text(encoding="utf-8"))
        return _restore(folder, manifest, vehicle, network)
    except (ValueError, KeyError, TypeError) as error:
        raise DataFileError(
            f"{folder.manifest} is damaged: {error!r}.",
            "Identify from its frames instead: quasiomni identify FOLDER/frames --vehicle ... --network ...",
        ) from error


def _manifest(run: Run) -> dict[str, Any]:
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
    )


def excitation_of(entry: Mapping[str, Any]) -> Excitation:
    """The excitation of `excitation_entry`."""
    series = FourierSeries(np.array(entry["cosine"]), np.array(entry["sine"]), float(entry["period"]))
    return Excitation(series, float(entry["condition"]), str(entry["binding"]))
