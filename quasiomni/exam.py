"""The commands of the withheld exam of the gap diagnosis: seal, diagnose, score, calibrate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from hil.exam.answer_file import open_cases
from hil.exam.drawing import Composition, composition_of
from hil.exam.folder import ExamFolder
from hil.exam.score_figures import confusion_svg, reliability_svg
from hil.exam.score_report import score_exams, score_json, score_markdown, summary_lines
from hil.exam.scoring import removable
from hil.exam.sizes import load_rows, load_sizes, replaced, table_text
from hil.exam.sources import Source
from ident.errors import UserError
from ident.extras import Extra, require
from ident.writing import write_whole
from quasiomni.application import app, console, show_next
from quasiomni.options import EngineOption, VehicleOption, load_emulation
from quasiomni.showing import bar

exam = typer.Typer(no_args_is_help=True, help="The withheld exam of the gap diagnosis.")
app.add_typer(exam, name="exam")

JobsOption = Annotated[int, typer.Option(min=1, help="Processes on this machine.")]
SchedulerOption = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, e.g. tcp://host:8786. Default: this machine.")
]
KeyOption = Annotated[
    Path | None, typer.Option(help="Key that the exam was sealed with; not needed where it is not sealed.")
]
FolderArgument = Annotated[Path, typer.Argument(help="Folder of the exam.")]

SourceOption = Annotated[
    Source,
    typer.Option(help="What drives the cases: the emulated vehicle, one that shares no code with it, or servo axes."),
]

_DEFAULT = Composition()


@exam.command()
def seal(
    out: Annotated[Path, typer.Option(help="Folder to write, or to go on with.")],
    key: Annotated[
        Path | None,
        typer.Option(help="File of the secret, outside --out; written where it is missing. Score asks for it."),
    ] = None,
    first_seed: Annotated[
        int | None,
        typer.Option(min=1, help="In place of --key: a set to tune on, its cases known to whoever knows the seed."),
    ] = None,
    effects: Annotated[int, typer.Option(min=0, help="Cases with one effect of the library.")] = _DEFAULT.effects,
    pairs: Annotated[int, typer.Option(min=0, help="Cases with two.")] = _DEFAULT.pairs,
    none: Annotated[int, typer.Option(min=0, help="Cases without any.")] = _DEFAULT.none,
    unknown: Annotated[
        int | None,
        typer.Option(min=0, help="Cases with one the library lacks. Default: 40, none of a source without them."),
    ] = None,
    invisible: Annotated[
        int | None,
        typer.Option(min=0, help="Cases with one below the noise. Default: 24, none of a source without them."),
    ] = None,
    laws: Annotated[int, typer.Option(min=0, help="Cases with a law that has no name.")] = _DEFAULT.laws,
    faults: Annotated[
        int | None,
        typer.Option(min=0, help="Cases whose records are at fault. Default: 16, none of a source without them."),
    ] = None,
    excitations: Annotated[
        int, typer.Option(min=1, help="Pairs of campaigns, to fit and to confirm, that the cases share.")
    ] = _DEFAULT.excitations,
    vehicle: VehicleOption = "prototype",
    engine: EngineOption = None,
    source: SourceOption = Source.EMULATOR,
    sizes: Annotated[
        Path | None, typer.Option(help="Table of sizes. Default: that kept for the vehicle and the engine.")
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="Model under test (parameters.toml). Default: that kept for the vehicle and the engine."),
    ] = None,
    jobs: JobsOption = 2,
    scheduler: SchedulerOption = None,
) -> None:
    """Draw cases from a secret, drive them, write records and the sealed answer; goes on where it stopped."""
    require(Extra.EXAM, "exam seal", () if key is not None else ("pyarrow",))
    _require_cluster(scheduler)
    counts = {"effects": effects, "pairs": pairs, "none": none, "unknown": unknown, "invisible": invisible}
    composition = composition_of(source, counts | {"laws": laws, "faults": faults, "excitations": excitations})
    if source is Source.AXES:
        _refuse_of_axes({"--vehicle": vehicle != "prototype", "--engine": engine, "--sizes": sizes, "--model": model})
        from hil.exam.axes.sealing import seal_axes
        from hil.exam.order import Order

        with bar("sealing") as shown:
            sealed = seal_axes(Order(out, composition, key, first_seed, jobs, scheduler), shown)
    else:
        load_emulation()
        from hil.exam.sealing import VehicleOrder, seal
        from hil.exam.world import stored_model, stored_sizes
        from hil.exam.worlds import world_of

        world = world_of(vehicle, engine, source)
        table, judged = load_sizes(stored_sizes(world, sizes)), stored_model(world, model)
        with bar("sealing") as shown:
            order = VehicleOrder(out, composition, key, first_seed, jobs, scheduler, world, judged)
            sealed = seal(order, table, shown)
    undriven = sum(ExamFolder(out).undriven(name).is_file() for name in sealed.identifiers)
    if undriven:
        console.print(f"{undriven} cases stopped the campaign and have no records.", style="yellow")
    console.print(f"{len(sealed.identifiers)} cases. SHA-256 of the answer: {sealed.answer_hash}", highlight=False)
    if sealed.sealed:
        console.print(f"Sealed with {key}: keep it, and keep it from whoever diagnoses.", highlight=False)
    else:
        console.print(f"Not sealed: all cases follow from seed {first_seed}.", style="yellow", highlight=False)
    show_next(f"quasiomni exam diagnose {out}")


def _refuse_of_axes(given: Mapping[str, object]) -> None:
    named = next((option for option, value in given.items() if value), None)
    if named is not None:
        raise UserError(f"An exam of axes draws its machines, and takes no {named}.", f"Leave {named} out.")


@exam.command()
def diagnose(
    folder: FolderArgument,
    without_true_candidate: Annotated[
        bool, typer.Option("--without-true-candidate", help="Open the answer; leave each true candidate out.")
    ] = False,
    oracle: Annotated[
        bool, typer.Option("--oracle", help="Open the answer; gather what somebody finds who knows each candidate.")
    ] = False,
    key: KeyOption = None,
    jobs: JobsOption = 2,
    scheduler: SchedulerOption = None,
) -> None:
    """Diagnose every case from records and nominal model alone; this process cannot import the emulator."""
    require(Extra.EXAM, "exam diagnose", ("pyarrow",))
    _require_cluster(scheduler)
    if oracle and without_true_candidate:
        raise UserError("An oracle knows the true candidate: it cannot be left out.", "Ask for one after the other.")
    from hil.exam.diagnosing import diagnose_exam
    from hil.exam.oracle import ask_oracle, asked_of_oracle

    opened = ExamFolder(folder)
    if oracle:
        asked = asked_of_oracle(open_cases(opened, key))
        with bar("asking the oracle") as shown:
            ask_oracle(opened, asked, jobs=jobs, scheduler=scheduler, progress=shown)
        show_next(f"quasiomni exam score {folder}")
        return
    removed = removable(open_cases(opened, key)) if without_true_candidate else None
    with bar("diagnosing") as shown:
        diagnose_exam(opened, jobs=jobs, scheduler=scheduler, progress=shown, removed=removed)
    show_next(f"quasiomni exam score {folder}")


@exam.command()
def calibrate(
    out: Annotated[Path, typer.Option(help="Table of sizes to write.")],
    vehicle: VehicleOption = "prototype",
    engine: EngineOption = None,
    source: SourceOption = Source.EMULATOR,
    effect: Annotated[
        list[str] | None, typer.Option(help="Measure this one alone; other rows of a table that is there are kept.")
    ] = None,
    jobs: JobsOption = 2,
) -> None:
    """Measure what size each effect has in noise units, from pairs of runs that differ by the effect alone."""
    load_emulation()
    from hil.exam.calibration import calibrate
    from hil.exam.probes import EVERY
    from hil.exam.worlds import world_of

    if source is Source.AXES:
        raise UserError("Sizes of axes are measured on each drawn machine.", "Nothing needs to be calibrated for them.")
    strangers = sorted(set(effect or ()) - EVERY)
    if strangers:
        raise UserError(f"No effect is called {strangers[0]}.", f"Name some of {', '.join(sorted(EVERY))}.")
    world = world_of(vehicle, engine, source)
    kept = load_rows(out) if effect and out.is_file() else None
    with bar("measuring") as shown:
        rows = calibrate(world, jobs, shown, effect or EVERY)
    rows = rows if kept is None else replaced(kept, rows)
    write_whole(table_text(rows), out)
    console.print(f"Written: {out}")


@exam.command("score")
def score_command(
    folders: Annotated[list[Path], typer.Argument(help="Folders of exams; several are counted as one, and by world.")],
    key: Annotated[
        list[Path] | None,
        typer.Option(help="Key that an exam was sealed with; once for every key that was used, none where none was."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the score. Default: that of the exam; several need one.")
    ] = None,
) -> None:
    """Open the sealed answers and score; writes score.md, score.json, reliability.svg and confusion.svg.

    Of several worlds, the probabilities of each are calibrated on the others too.
    """
    if out is None and len(folders) > 1:
        raise UserError("Several exams have no one folder for their score.", "Name one: --out FOLDER.")
    target = out or folders[0]
    report = score_exams([ExamFolder(folder) for folder in folders], np.random.default_rng(0), key or [])
    for line in summary_lines(report):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    for name, text in (
        ("score.md", score_markdown(report, "Exam")),
        ("score.json", score_json(report)),
        ("reliability.svg", reliability_svg(report.score.bins)),
        ("confusion.svg", confusion_svg(report.score.confusion, report.score.wished)),
    ):
        write_whole(text, target / name)
    console.print(f"Written: {target / 'score.md'}, score.json, reliability.svg, confusion.svg", soft_wrap=True)


def _require_cluster(scheduler: str | None) -> None:
    if scheduler is not None:
        require(Extra.CLUSTER, "--scheduler")
