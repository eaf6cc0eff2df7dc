"""Making a run folder: nothing of another run is overwritten, and a demo may replace what a demo has left."""

from __future__ import annotations

import json
from pathlib import Path

from hil.campaign.carried import (
    Files,
    carried_network,
    carried_simulator,
    carried_vehicle,
    check_readable,
    refuse_others,
    write_carried,
)
from hil.campaign.folder import Run, RunFolder, manifest_of
from hil.campaign.lock import refuse_driven
from hil.frames.recorder import recorded_files
from ident.errors import CampaignError, DataFileError
from ident.reading import read_json
from ident.writing import write_whole


def refuse_used(
    folder: RunFolder,
    vehicle_file: Path,
    network_file: Path,
    *,
    simulator: Path | None = None,
    by_demo: bool = False,
) -> None:
    """Refuse a folder in which a new run would overwrite anything; a demo may replace what a demo has left.

    Raises:
        CampaignError: the folder already holds a run or other files of its names, or another process drives into it.
    """
    refuse_driven(folder.path)
    if by_demo and is_demo(folder):
        return
    if _holds_run(folder):
        raise _used(folder)
    refuse_others(_top_files(vehicle_file, simulator), folder.path)
    refuse_others(carried_network(network_file), folder.network.parent)


def _top_files(vehicle_file: Path, simulator: Path | None) -> Files:
    return {**carried_vehicle(vehicle_file), **(carried_simulator(simulator) if simulator is not None else {})}


def _holds_run(folder: RunFolder) -> bool:
    return folder.manifest.exists() or any(folder.frames.glob("*"))


def _used(folder: RunFolder) -> CampaignError:
    return CampaignError(
        f"{folder.path} already holds a run.", "Go on with it (--resume), or name another folder (--out)."
    )


def is_demo(folder: RunFolder) -> bool:
    """Whether a demo has made the folder; one whose manifest cannot be read is somebody's work."""
    try:
        manifest = read_json(folder.manifest)
    except DataFileError:
        return False
    return isinstance(manifest, dict) and manifest.get("demo") is True


def create_run(run: Run, vehicle_file: Path) -> None:
    """Make the folder, carry vehicle and network files into it, read them back, and write the manifest last.

    Whoever creates a run that others may create at the same time does so while `driving` the folder. A demo replaces
    logs, files and manifest of an earlier demo.

    Raises:
        CampaignError: the folder already holds a run or other files of these names, or does not read as planned.
        UserError: it cannot be written.
    """
    folder = run.folder
    replaced = run.demo and is_demo(folder)
    if replaced:
        _delete_logs(folder)
    elif _holds_run(folder):
        raise _used(folder)
    write_carried(_top_files(vehicle_file, run.simulator), folder.path, replace=replaced)
    write_carried(carried_network(run.network.path), folder.network.parent, replace=replaced)
    check_readable(folder.vehicle, folder.network, run.plan.vehicle, run.network)
    write_whole(json.dumps(manifest_of(run), indent=1), folder.manifest)


def _delete_logs(folder: RunFolder) -> None:
    try:
        for log in recorded_files(folder.frames):
            log.unlink()
    except OSError as error:
        raise CampaignError(
            f"The logs of the last demo in {folder.frames} cannot be deleted: {error.strerror}.",
            "Name another folder (--out).",
        ) from error
