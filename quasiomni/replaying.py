"""The command that plays a record into the bench and says where the emulated nodes answer otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ident.errors import UserError
from ident.extras import require_engine
from quasiomni.application import app
from quasiomni.options import (
    EffectOption,
    EngineOption,
    ForceOption,
    FromOption,
    GivenVehicleOption,
    NetworkOption,
    parse_effects,
)
from quasiomni.paging import (
    LOOPBACK,
    PORT,
    Told,
    WebHostOption,
    WebOption,
    WebPortOption,
    paging,
    plan_page,
    say_where,
    watching_replay,
)
from quasiomni.scenarios import Stand
from quasiomni.showing import bar, say


@app.command()
def replay(
    logs: Annotated[
        list[Path], typer.Argument(help="Run folder, or logs in their order: candump, BLF, ASC, MF4 or MCAP.")
    ],
    vehicle: GivenVehicleOption = None,
    network: NetworkOption = None,
    engine: EngineOption = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the emulated noise. Default: that of the run, else 1.")
    ] = None,
    effect: EffectOption = None,
    simulator: FromOption = None,
    stand: Annotated[
        Stand | None, typer.Option(help="Where the vehicle stands. Default: by the names of the logs, else the floor.")
    ] = None,
    emulations: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Emulate so often with other noise; what these differ by is no difference. Default: 1 for a run of "
            "the emulator, else 3.",
        ),
    ] = None,
    json: Annotated[Path | None, typer.Option(help="Write the numbers here.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write an HTML report with the timeline here.")] = None,
    force: ForceOption = False,
    web: WebOption = False,
    web_host: WebHostOption = LOOPBACK,
    web_port: WebPortOption = PORT,
    web_pace: Annotated[
        float, typer.Option("--web-pace", min=0.0, help="With --web: seconds of the log a second; 0 takes all it gets.")
    ] = 1.0,
) -> None:
    """Play a record into the bench: which emulated node answers otherwise, where and when. Exit code 1 if one does."""
    require_engine(engine, "The emulator")
    address = plan_page(web, web_host, web_port)
    if address is None and web_pace != 1.0:
        raise UserError("--web-pace is of the page.", "Add --web, or leave it out.")
    from hil.replay import replaying  # needs the emulator, which a vehicle's computer does not have
    from hil.replay import report as reports

    order = replaying.ReplayOrder(
        tuple(logs),
        vehicle,
        network,
        engine,
        parse_effects(effect),
        simulator,
        seed,
        None if stand is None else stand is Stand.JACK,
        emulations,
        json,
        report,
        force,
    )
    with paging(address) as page:
        say_where(page)
        with bar("replaying") as shown:
            told = Told(unit="frames", follow=lambda _, done, total: shown(done, total))
            begin = watching_replay(page, f"replay of {', '.join(map(str, logs))}", told, web_pace)
            answer = replaying.replay(order, told, begin)
    say(reports.summary_lines(answer))
    if json is not None:
        reports.write_json(answer, json)
    if report is not None:
        reports.write_page(answer, report)
    if order.files:
        say([f"Written: {', '.join(map(str, order.files))}"])
    if not answer.compared.agrees:
        raise typer.Exit(1)
