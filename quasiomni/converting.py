"""The command that writes logs and records in other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quasiomni.application import app, console
from quasiomni.options import GivenVehicleOption, NetworkOption, require_readers


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(help="Run folder, log, or record.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="File to write: .mcap, .blf, .asc, .log, .mf4, .csv or .parquet.")
    ],
    vehicle: GivenVehicleOption = None,
    network: NetworkOption = None,
) -> None:
    """Write the frames and channels of a run, a log or a record in another format: MCAP for Foxglove, BLF, CSV, ..."""
    require_readers([source, out])
    from hil.converting.convert import convert as convert_to  # needs mathematics

    done = convert_to(source, out, vehicle, network)
    parts = [f"{done.frames} frames"] * bool(done.frames) + [f"{done.samples} samples"] * bool(done.samples)
    console.print(f"Written: {out}, {' and '.join(parts)}.", highlight=False, soft_wrap=True)
