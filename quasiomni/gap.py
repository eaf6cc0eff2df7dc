"""The commands that say why model and machine disagree, and how much nearer a simulator has come."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.campaign.asked import DiagnosisOrder
from hil.campaign.diagnosing import diagnose_records, write_answer
from quasiomni.application import app
from quasiomni.options import (
    EngineOption,
    ForceOption,
    GivenVehicleOption,
    NetworkOption,
    choose_engine,
    require_readers,
)
from quasiomni.showing import say, stages


@app.command()
def diagnose(
    records: Annotated[
        list[Path], typer.Argument(help="Run folders, logs, or CSV, Parquet or MF4 records to look for causes in.")
    ],
    confirm: Annotated[
        list[Path] | None,
        typer.Option(help="Independent record that must confirm; repeat for more. Default: held-out repeats."),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle file: `prototype`, `compact`, or the path of your own.")
    ] = None,
    network: NetworkOption = None,
    model: Annotated[
        Path | None, typer.Option(help="parameters.toml of the model under test. Default: refitted.")
    ] = None,
    axis: Annotated[
        bool, typer.Option("--axis", help="The records are of servo axes: time, position, effort.")
    ] = False,
    json: Annotated[Path | None, typer.Option(help="Write diagnosis.json here.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write an HTML report here.")] = None,
    extended: Annotated[
        Path | None, typer.Option(help="Write the parameters.toml of the model with the effects named here.")
    ] = None,
    force: ForceOption = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the smooth function of what is left.")] = 1,
) -> None:
    """Say why model and machine disagree: which effect, where, how sure, how much it closes, what to do next."""
    given = tuple(records), tuple(confirm or ())
    require_readers((*records, *given[1]))
    order = DiagnosisOrder(*given, vehicle, model, axis, seed, json, report, extended, force, network)
    with stages("diagnosing") as stage:
        answer = diagnose_records(order, stage)
    say(answer.summary)
    written = write_answer(order, answer)
    if extended is not None and extended not in written:
        say([f"{extended} is not written: no effect is named."])
    if written:
        say([f"Written: {', '.join(map(str, written))}"])


@app.command()
def gap(
    run: Annotated[Path, typer.Argument(help="Run folder, log, or CSV, Parquet or MF4 record.")],
    simulator: Annotated[
        Path, typer.Option(help="parameters.toml of the simulator as it is now: what `diagnose --extended` wrote.")
    ],
    before: Annotated[
        Path | None,
        typer.Option(help="parameters.toml of the simulator as it was. Default: that of RUN, else the vehicle file's."),
    ] = None,
    vehicle: GivenVehicleOption = None,
    network: NetworkOption = None,
    engine: EngineOption = None,
    json: Annotated[Path | None, typer.Option(help="Write the numbers here.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write an HTML report here.")] = None,
    force: ForceOption = False,
) -> None:
    """Drive recorded torques through the emulated vehicle before and after, and say how far its gap shrinks."""
    require_readers([run])
    chosen = choose_engine(engine)
    from hil.cosimulation import simulator_gap  # needs the emulator, which a diagnosis does without

    order = simulator_gap.SimulatorOrder(run, simulator, before, vehicle, network, chosen, json, report, force)
    with stages("judging the simulator") as stage:
        answer = simulator_gap.judge_simulator(order, stage)
    say(simulator_gap.summary_lines(answer))
    if written := simulator_gap.write_simulator_gap(order, answer):
        say([f"Written: {', '.join(map(str, written))}"])
