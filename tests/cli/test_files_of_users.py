"""Attempts at files of users: whatever a command is told, what it reads and what it has not written stays."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.lock import driving
from hil.network import DEFAULT_NETWORK, load_network
from ident.campaign.excitation import FourierSeries
from ident.campaign.optimise import Excitation
from ident.campaign.plan import assemble_plan
from ident.campaign.reference import excitation_reference
from ident.campaign.steps import EXCITATIONS
from ident.records.files import write_record
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import find_data_file, load_vehicle

SHIPPED = find_data_file("ident.vehicle", "prototype")
STEPS = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)


def make_run(
    folder: Path, *, demo: bool = False, vehicle_name: str = "prototype", network: Path = DEFAULT_NETWORK
) -> RunFolder:
    """A run folder as a campaign makes it, before its first step."""
    vehicle, loaded = load_vehicle(vehicle_name), load_network(network)
    excitation = Excitation(FourierSeries(np.array([0.0]), np.array([0.1]), 5.0), 1.0, "")
    plan = assemble_plan(
        vehicle,
        {Step.STEERING_LEFT: excitation},
        steps=[Step.STEERING_LEFT],
        periods=4,
        cycle=loaded.cycle_period,
    )
    run = Run(RunFolder(folder), plan, loaded, 1, "emulator", vehicle_name, None, demo=demo)
    create_run(run, find_data_file("ident.vehicle", vehicle_name))
    return run.folder


def content(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def driven(step: Step) -> Segment:
    vehicle, spec = load_vehicle(), EXCITATIONS[step]
    series = FourierSeries(np.array([0.5, 0.0, -0.5]), np.array([0.0, 0.5, -1 / 3]), spec.period)
    reference = excitation_reference(spec, series, 4, vehicle, vehicle.prior, 0.002)
    wheels, steering = np.zeros((len(reference), 4)), np.zeros((len(reference), 2))
    for name, track in reference.tracks.items():
        wheels += track.wheels * (track.position - track.position[0])[:, None]
        if name.startswith("alpha"):
            steering[:, 0 if name == "alpha_l" else 1] = track.position
    time = np.arange(len(reference)) * 0.002
    return make_segment(Segment(step, 0.0, time, reference.feed_forward, wheels, steering, reference.period), "test")


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("records") / "record.csv"
    write_record(Record([driven(step) for step in STEPS]), path)
    return path


@pytest.fixture
def files(tmp_path: Path, record: Path) -> Path:
    """A folder with what a user has: a vehicle, a network with its EDS files, a note, a record, a run."""
    for name in ("network.toml", "drive.eds", "encoder.eds"):
        shutil.copy(DEFAULT_NETWORK.with_name(name), tmp_path / name)
    shutil.copy(SHIPPED, tmp_path / "mine.toml")
    shutil.copy(record, tmp_path / "record.csv")
    shutil.copy(SHIPPED, tmp_path / "parameters.toml")
    (tmp_path / "note.txt").write_text("what I must not forget")
    make_run(tmp_path / "run")
    (tmp_path / "run" / "parameters.toml").write_text("mine")
    return tmp_path


ATTEMPTS = {
    "a bus at a file": "emulate --bus unix:note.txt --duration 0.1",
    "commands at a file": "emulate --bus unix:can0 --control note.txt --duration 0.1",
    "a DBC over its network file": "dbc --network network.toml --out network.toml",
    "a DBC over an EDS file": "dbc --network network.toml --out ./drive.eds",
    "EDS files over those they are made from": "eds --network network.toml --out .",
    "results over the vehicle file": "identify record.csv --vehicle parameters.toml --b-w 0.12 --b-w-std 0.01 --out .",
    "results over a file of that name": "identify record.csv --b-w 0.12 --b-w-std 0.01 --out .",
    "a diagnosis over its record": "diagnose record.csv --json record.csv",
    "a diagnosis over a manifest": "diagnose run --json run/run.json",
    "a report over the vehicle of a run": "diagnose record.csv run --report run/vehicle.toml",
    "a model over the model that is judged": "diagnose record.csv --model parameters.toml --extended parameters.toml",
    "two files of one name": "diagnose record.csv --json new --report new",
    "the report of a run over its manifest": "report run --out run/run.json",
    "an FMU over a manifest": "fmu run -o run/run.json",
    "an FMU over the parameters": "fmu run -o run/parameters.toml",
    "an FMU over the EDS of a run": "fmu run -o run/network/drive.eds",
    "a plot over the record": "cosim some.fmu --record record.csv --out record.csv",
    "a campaign into a campaign": "campaign --out run",
    "a demo into a campaign": "demo --out run",
    "a campaign among files of its names": "campaign --out taken --vehicle mine.toml",
}


@pytest.mark.parametrize("line", ATTEMPTS.values(), ids=ATTEMPTS)
def test_what_a_user_has_stays(
    quasi: Callable[..., Any], files: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    (files / "taken").mkdir()
    (files / "taken" / "vehicle.toml").write_text("another one")
    monkeypatch.chdir(files)
    before = content(files)
    answer = quasi(*line.split())
    assert answer.code == 2, answer
    assert "Traceback" not in answer.err
    assert "remedy:" in answer.error
    assert content(files) == before


def test_a_demo_replaces_what_a_demo_has_left_and_nothing_else(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "demo", demo=True)
    folder.frames.mkdir()
    for name in ("000_interlude.blf", "001_straight.part.blf", "002_straight.unusable.blf", "003_straight.blf"):
        (folder.frames / name).write_bytes(b"frames")
    kept = {folder.frames / "notes.txt", folder.frames / "003_straight.csv", folder.path / "platform.fmu"}
    for path in kept:
        path.write_text("mine")
    make_run(tmp_path / "demo", demo=True, vehicle_name="compact", network=DEFAULT_NETWORK.with_name("compact.toml"))
    assert {path for path in folder.path.rglob("*") if path.is_file() and path.read_text() == "mine"} == kept
    assert list(folder.frames.glob("*.blf")) == []
    assert load_network(folder.network).name == "compact"


def test_a_folder_that_another_process_drives_is_refused_before_any_work(
    quasi: Callable[..., Any], tmp_path: Path
) -> None:
    out = tmp_path / "run"
    with driving(out):
        for more in ([], ["--resume"]):
            if more:
                make_run(out)
            answer = quasi("campaign", "--out", out, *more)
            assert answer.code == 2
            assert f"is being driven by process {os.getpid()}" in answer.error


def fill(disk: Path) -> None:
    """Leave a page of room: enough to begin a file, not to end it."""
    with (disk / "filler").open("wb", buffering=0) as filler:
        try:
            while True:
                filler.write(bytes(4096))
        except OSError:
            filler.truncate(filler.tell() - 4096)


WRITING = {
    "dbc": "dbc --out {disk}/vehicle.dbc",
    "eds": "eds --out {disk}/files",
    "identify": "identify {record} --b-w 0.12 --b-w-std 0.01 --out {disk}",
    "campaign": "campaign --out {disk}/run --b-w 0.12 --b-w-std 0.01 --skip steering_left --skip steering_right "
    "--skip straight --skip lane_change",
    "standard output": "dbc --out /dev/full",
}


@pytest.mark.parametrize("line", WRITING.values(), ids=WRITING)
def test_a_full_disk_leaves_no_half_file(quasi: Callable[..., Any], small_disk: Path, record: Path, line: str) -> None:
    fill(small_disk)
    answer = quasi(*line.format(disk=small_disk, record=record).split())
    assert answer.code == 2, answer
    assert "Traceback" not in answer.err
    assert "No space left on device" in answer.error
    assert "remedy:" in answer.error
    for path in small_disk.rglob("*"):
        assert path.is_dir() or path.name == "filler" or is_whole(path), path


def is_whole(path: Path) -> bool:
    """The files that fitted before the disk was full."""
    shipped = [DEFAULT_NETWORK, SHIPPED, *DEFAULT_NETWORK.parent.glob("*.eds")]
    return path.read_bytes() in [one.read_bytes() for one in shipped]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4"])
def test_a_record_that_does_not_fit_leaves_the_old_one(small_disk: Path, suffix: str) -> None:
    path = small_disk / f"record{suffix}"
    path.write_bytes(b"the old one")
    fill(small_disk)
    with pytest.raises(Exception, match=r"cannot be written|No space left"):
        write_record(Record([driven(Step.STRAIGHT)]), path)
    assert {entry.name for entry in small_disk.iterdir()} == {path.name, "filler"}
    assert path.read_bytes() == b"the old one"


@pytest.mark.parametrize("line", ["dbc --out {out}/vehicle.dbc", "eds --out {out}"])
def test_a_limit_of_the_file_size_leaves_no_half_file_either(tmp_path: Path, line: str) -> None:
    """The same without a disk to fill: whoever runs the tests may have no right to mount one."""
    command = [sys.executable, "-m", "quasiomni", *line.format(out=tmp_path).split()]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        # Modules that are compiled under the limit would be kept cut off, for every process after this one.
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)),
    )
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_manifest_of_a_run_says_whether_it_is_a_demo(tmp_path: Path) -> None:
    assert "demo" not in json.loads(make_run(tmp_path / "campaign").manifest.read_text())
    assert json.loads(make_run(tmp_path / "demo", demo=True).manifest.read_text())["demo"] is True
