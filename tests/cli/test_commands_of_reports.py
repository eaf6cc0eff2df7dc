"""Every command that the page of a diagnosis proposes is one of this program, with options that it has."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import pytest
import typer

from ident.diagnosis.diagnosis import Diagnosis, Gap, Verdict
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC
from ident.report.commands import EXTENDED, Asked, Command, next_commands
from quasiomni import load_commands
from quasiomni.application import app

RUN = Asked(("runs/first",), ("runs/second",), run="runs/first", mass=845.0)
FILE = Asked(("a record.csv",), model="parameters.toml", vehicle="mine.toml", network="net.toml", seed=3)
AXIS = Asked(("axis.csv",), ("other.csv",), axis=True)
REAL = replace(RUN, bus="socketcan:can0", campaign_vehicle="runs/first/vehicle.toml")
GIVEN = replace(RUN, extended="mine.toml", confirm=())


def diagnosis(verdict: Verdict, advice: str | None = None) -> Diagnosis:
    return Diagnosis(verdict, (), (), Gap(3.0, 1.0, 1.0), (), advice)


def _all() -> Iterator[Command]:
    advised = (None, *(f"To see x as well: {one.advice}." for one in DIAGNOSTIC.values()))
    verdicts = (Verdict.EFFECT, Verdict.LAW, Verdict.NONE, Verdict.UNKNOWN)
    for verdict, advice, asked in product(verdicts, advised, (RUN, FILE, AXIS, REAL, GIVEN)):
        yield from next_commands(diagnosis(verdict, advice), asked)


LINES = sorted({command.line for command in _all()})


@pytest.mark.parametrize("line", LINES)
def test_a_proposed_command_parses(line: str) -> None:
    program, name, *words = shlex.split(line)
    assert program == "quasiomni"
    load_commands([name])
    command = typer.main.get_group(app).commands[name]
    with command.make_context(name, words) as context:
        assert context.params


def names(verdict: Verdict, asked: Asked, advice: str | None = None) -> list[str]:
    return [command.words[0] for command in next_commands(diagnosis(verdict, advice), asked)]


def test_a_cause_is_written_put_into_the_simulator_and_into_an_fmu() -> None:
    first, gap, campaign, fmu = next_commands(diagnosis(Verdict.EFFECT), RUN)
    assert first.line == f"quasiomni diagnose runs/first --confirm runs/second --extended {EXTENDED}"
    assert gap.words[:4] == ("gap", "runs/second", "--simulator", EXTENDED)
    assert campaign.words[:3] == ("campaign", "--from", EXTENDED)
    assert fmu.words[:4] == ("fmu", "runs/first", "--model", EXTENDED)


def test_what_was_written_already_is_not_written_again() -> None:
    gap, *_ = next_commands(diagnosis(Verdict.EFFECT), GIVEN)
    assert gap.words[:4] == ("gap", "runs/first", "--simulator", "mine.toml")


def test_an_axis_has_no_simulator_no_fmu_and_no_campaign() -> None:
    assert names(Verdict.EFFECT, AXIS) == ["diagnose"]
    assert names(Verdict.NONE, AXIS) == ["identify"]
    assert names(Verdict.UNKNOWN, AXIS) == []


def test_a_record_without_a_run_folder_makes_no_fmu() -> None:
    assert names(Verdict.EFFECT, FILE) == ["diagnose", "gap", "campaign"]


def test_the_experiment_that_is_advised_is_driven_where_the_record_was() -> None:
    load, again = next_commands(diagnosis(Verdict.UNKNOWN, DIAGNOSTIC["known payload"].advice), REAL)
    assert load.words[:5] == ("campaign", "--diagnostic", "--payload", "85", "--bus")
    assert "runs/next" in again.words
    slope, judged = next_commands(diagnosis(Verdict.UNKNOWN, DIAGNOSTIC["on a slope"].advice), RUN)
    assert "slope@chassis=1deg" in slope.words
    assert judged.words[:4] == ("diagnose", "runs/next", "--model", "sloped.toml")
    real, _ = next_commands(diagnosis(Verdict.UNKNOWN, DIAGNOSTIC["on a slope"].advice), REAL)
    assert "--effect" not in real.words
