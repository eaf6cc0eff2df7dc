"""The FMU of a run with its devices on the bus, or of one of its drives alone."""

from __future__ import annotations

import time
from itertools import count
from pathlib import Path

from fmu.bus.packaging import build_bus_fmu, vehicle_plant
from fmu.bus.shaft_plant import shaft_plant
from fmu.bus.system import TxClock
from fmu.compiling import check_platforms, find_compiler
from fmu.platforms import Platform
from hil.bench.prototypes import load_emulated
from hil.campaign.folder import RunFolder, open_run, sources_of
from hil.cosimulation.export import Compiled, Exported, source_of_run, unheard
from hil.lsbus.system import drive_on_bus, vehicle_on_bus
from ident.writing import refuse_inputs, write_whole


def export_bus_fmu(
    run: Path,
    out: Path,
    platforms: tuple[Platform, ...],
    model: Path | None = None,
    *,
    drive: str | None = None,
    tx_clock: TxClock = TxClock.COUNTDOWN,
    force: bool = False,
    compiled: Compiled = unheard,
) -> Exported:
    """Build the FMU and write it.

    Args:
        run: folder, identified.
        out: file to write.
        platforms: to build for.
        model: a `parameters.toml` in place of that of the run.
        drive: role of the one drive that it is to be; None: the whole vehicle.
        tx_clock: of its bus terminal.
        force: take a model that was assessed as unusable.
        compiled: called with the progress.

    Raises:
        UserError: the run is not identified, its devices cannot be in an FMU, there is no compiler for a platform, or
            the file cannot be written or is one of the run.
    """
    refuse_inputs([out], [*sources_of(run), RunFolder(run).parameters, model])
    source, opened, compiler = source_of_run(run, model, force=force), open_run(run), find_compiler()
    check_platforms(compiler, platforms)
    network = opened.network.path
    # Of a real vehicle's power stages no file says all: what its emulated drives would have is taken, and told inside.
    emulated = load_emulated(opened.emulated if opened.prototype else str(opened.folder.vehicle), network)
    assumed = {"assumed.txt": "".join(f"{line}\n" for line in emulated.assumed).encode()} if emulated.assumed else {}
    if drive is None:
        plant, system = vehicle_plant(source), vehicle_on_bus(emulated.prototype, network, tx_clock)
    else:
        plant, system = shaft_plant(drive), drive_on_bus(emulated.prototype, network, drive, tx_clock)
    start, done, total = time.monotonic(), count(1), len(platforms)
    compiled(compiler.name, 0, total)
    content = build_bus_fmu(
        plant,
        system,
        {**source.documents, **assumed},
        platforms,
        compiler,
        lambda _: compiled(compiler.name, next(done), total),
    )
    write_whole(content, out)
    return Exported(out, len(content), time.monotonic() - start)
