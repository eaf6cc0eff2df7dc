"""What to run next, ready to copy: commands with the files that the diagnosis was made from."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from ident.diagnosis.diagnosis import Diagnosis, Verdict
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, Experiment

PROGRAM: Final = "quasiomni"
EXTENDED: Final = "extended.toml"
"""Written where no other name was given."""

REHEARSAL: Final = "runs/rehearsal"
EXPERIMENT: Final = "runs/next"
"""Run folders of the campaigns that are proposed."""

SLOPED: Final = "sloped.toml"
"""Model that knows the slope that it is judged on."""

LOAD: Final = 0.1
"""Of a known load, over the mass of the vehicle."""

ROUND: Final = 5.0
"""To whose multiples it is rounded up [kg]."""

FMU: Final = "fmu:"
"""Begins what a run was driven on where that was an FMU."""


@dataclass(frozen=True)
class Asked:
    """A diagnosis as it was asked for, as far as commands after it need that.

    Attributes:
        records, confirm: files and run folders.
        model: under test, or None.
        vehicle, network: files that were named, or None.
        axis: the records are of servo axes.
        seed: of the smooth function of what is left.
        extended: file that the extended model is written to, or None.
        run: the first run folder among the records, or None.
        campaign_vehicle: vehicle file of a campaign of the same vehicle; None for the prototype.
        bus: what that run was driven on where it was no emulated vehicle, or None.
        mass: of the vehicle [kg], or None.
    """

    records: Sequence[str]
    confirm: Sequence[str] = ()
    model: str | None = None
    vehicle: str | None = None
    network: str | None = None
    axis: bool = False
    seed: int = 1
    extended: str | None = None
    run: str | None = None
    campaign_vehicle: str | None = None
    bus: str | None = None
    mass: float | None = None


@dataclass(frozen=True)
class Command:
    """A command line.

    Attributes:
        says: what it is for.
        words: behind the name of the program.
    """

    says: str
    words: tuple[str, ...]

    @property
    def line(self) -> str:
        """To be copied into a shell."""
        return shlex.join((PROGRAM, *self.words))


def next_commands(diagnosis: Diagnosis, asked: Asked) -> list[Command]:
    """What to do with the answer, then what to drive; empty where no command helps."""
    return [*_with_the_answer(diagnosis, asked), *_to_drive(diagnosis, asked)]


def _with_the_answer(diagnosis: Diagnosis, asked: Asked) -> Iterator[Command]:
    if diagnosis.verdict.explains:
        yield from _write(asked)
        if not asked.axis:
            yield from _use(asked.extended or EXTENDED, asked)
    elif diagnosis.verdict is Verdict.NONE:
        yield from _keep(asked)


def _write(asked: Asked) -> Iterator[Command]:
    if asked.extended is None:
        yield Command("Write the model with the causes in it", (*_again(asked), "--extended", EXTENDED))


def _use(extended: str, asked: Asked) -> Iterator[Command]:
    """The extended model in the simulator and as an FMU."""
    judged = asked.confirm[0] if asked.confirm else asked.records[0]
    before = _given("--before", asked.model)
    yield Command(
        "Say how much nearer the simulator comes with it",
        ("gap", judged, "--simulator", extended, *before, *_files(asked), "--report", "simulator.html"),
    )
    vehicle = _given("--vehicle", asked.campaign_vehicle)
    yield Command(
        "Drive a campaign in the simulator that has it", ("campaign", "--from", extended, *vehicle, "--out", REHEARSAL)
    )
    if asked.run is not None:
        yield Command("Make an FMU of it", ("fmu", asked.run, "--model", extended, "--out", "extended.fmu"))


def _keep(asked: Asked) -> Iterator[Command]:
    """The plain model, which nothing speaks against."""
    if asked.axis:
        yield Command("Write the model", ("identify", asked.records[0], "--axis"))
        return
    if asked.model is None:
        yield Command("Write the model", ("identify", asked.records[0], *_files(asked)))
    if asked.run is not None and (asked.model is not None or asked.run == asked.records[0]):
        yield Command("Make an FMU of it", ("fmu", asked.run, *_given("--model", asked.model)))


def _to_drive(diagnosis: Diagnosis, asked: Asked) -> Iterator[Command]:
    """The experiment that is advised, or, where nothing is known, all that a campaign can show; then what it shows."""
    experiment = _advised(diagnosis.next_experiment)
    if asked.axis or (experiment is None and diagnosis.verdict is not Verdict.UNKNOWN):
        return
    driven = ("campaign", *_steps(experiment, asked), *_driven_on(asked))
    if _sloped(experiment):
        yield Command("Drive on the slope", driven)
        judged = replace(asked, records=(EXPERIMENT,), confirm=(), model=SLOPED)
        says = f"Write the model with that slope among its [[effects]] to {SLOPED}, and judge it"
        yield Command(says, (*_again(judged), "--report", "next.html"))
        return
    yield Command("Drive the steps that show more", driven)
    both = replace(asked, records=(*asked.records, EXPERIMENT))
    yield Command("Diagnose it with the other records", (*_again(both), "--report", "next.html"))


def _advised(text: str | None) -> Experiment | None:
    return next((one for one in DIAGNOSTIC.values() if text is not None and one.advice in text), None)


def _sloped(experiment: Experiment | None) -> bool:
    return experiment is not None and bool(experiment.given)


def _steps(experiment: Experiment | None, asked: Asked) -> tuple[str, ...]:
    """Options of a campaign that drives it: all steps of a diagnosis, or the usual ones on a slope."""
    if experiment is not None and _sloped(experiment):
        (slope,) = experiment.given
        return () if asked.bus else ("--effect", f"{slope}={math.degrees(slope.size):.0f}deg")
    loaded = experiment is not None and any(drive.payload for drive in experiment.drives)
    if not (loaded and asked.mass):
        return ("--diagnostic",)
    return ("--diagnostic", "--payload", f"{ROUND * math.ceil(LOAD * asked.mass / ROUND):.0f}")


def _driven_on(asked: Asked) -> tuple[str, ...]:
    """Where, which vehicle, and where to."""
    option = "--plant" if asked.bus is not None and asked.bus.startswith(FMU) else "--bus"
    files = (*_given("--vehicle", asked.campaign_vehicle), *_given("--network", asked.network))
    return (*_given(option, asked.bus), *files, "--out", EXPERIMENT)


def _again(asked: Asked) -> tuple[str, ...]:
    """The same diagnosis once more."""
    confirm = (word for path in asked.confirm for word in ("--confirm", path))
    seed = ("--seed", str(asked.seed)) if asked.seed != 1 else ()
    axis = ("--axis",) if asked.axis else ()
    return ("diagnose", *asked.records, *confirm, *_files(asked), *_given("--model", asked.model), *axis, *seed)


def _files(asked: Asked) -> tuple[str, ...]:
    return (*_given("--vehicle", asked.vehicle), *_given("--network", asked.network))


def _given(option: str, value: str | None) -> tuple[str, ...]:
    return () if value is None else (option, value)
