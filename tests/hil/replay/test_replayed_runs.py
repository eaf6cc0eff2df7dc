"""A run of the emulator, replayed: the same vehicle says the same to the bit, another one shows where it is another."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from hil.bench import emulation
from hil.campaign.driving import drive_run
from hil.campaign.folder import Run, RunFolder, open_run
from hil.campaign.order import Order
from hil.campaign.runner import check_network
from hil.frames import FrameTable, read_log
from hil.frames.recorder import LogFormat
from hil.network import load_network, network_file_of
from hil.replay.replaying import ReplayAnswer, ReplayOrder, replay
from hil.replay.report import as_json, headline, render_page, summary_lines
from ident.campaign.plan import make_plan
from ident.effects.text import parse_effect
from ident.errors import RecordError
from ident.estimate.result import KnownInertia
from ident.extras import default_engine
from ident.records.record import Step
from ident.vehicle.description import load_vehicle

CHANGED = "stribeck@wheel_rr=0.5Nm"
RESOLUTION = 2e-9
"""Stamps of a BLF log are whole nanoseconds [s]."""


def campaign(folder: Path, effects: tuple[str, ...] = (), steps: tuple[Step, ...] = (Step.WHEEL_LIFTED,)) -> Run:
    network = load_network(network_file_of("prototype"))
    plan = make_plan(load_vehicle(), np.random.default_rng(1), steps=steps, periods=4, cycle=network.cycle_period)
    inertia = KnownInertia(0.121, 0.001, "given")
    engine = default_engine()
    run = Run(RunFolder(folder), plan, network, 1, "emulator, in lockstep", "prototype", inertia, engine=engine)
    order = Order(folder, "prototype", None, steps, 4, 1, inertia, LogFormat.BLF, run.bus, "prototype", engine=engine)
    wanted = tuple(map(parse_effect, effects))
    with emulation.bench("prototype", 1, False, network.path, wanted, engine=engine) as bench:
        check_network(bench.bus, bench.clock, network)
        drive_run(run, order, bench.bus, bench.clock, bench.operator, lambda *_: None)
    return open_run(folder)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return campaign(tmp_path_factory.mktemp("sound") / "run")


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return campaign(tmp_path_factory.mktemp("changed") / "run", (CHANGED,))


@pytest.fixture(scope="module")
def answer_of_changed(changed: Run) -> ReplayAnswer:
    return replay(ReplayOrder([changed.folder.path]), lambda *_: None)


def lifted(run: Run) -> FrameTable:
    return read_log(next(run.folder.frames.glob("*_wheel_lifted.blf")))


def test_a_run_of_the_emulator_agrees_with_the_emulator_bit_by_bit(sound: Run) -> None:
    answer = replay(ReplayOrder([sound.folder.path]), lambda *_: None)
    compared = answer.compared
    assert compared.answers > 30_000
    assert compared.equal == compared.answers
    assert compared.identical
    assert compared.agrees
    assert compared.latest < RESOLUTION
    assert headline(answer) == f"All {compared.answers} recorded answers in {answer.logs} logs agree bit by bit."
    assert all(len(track.time) > 2000 for track in compared.tracks)


@pytest.mark.slow
def test_a_run_with_hands_between_its_sessions_agrees_bit_by_bit(tmp_path: Path) -> None:
    run = campaign(tmp_path / "run", steps=(Step.WHEEL_LIFTED, Step.LANE_CHANGE))
    compared = replay(ReplayOrder([run.folder.path]), lambda *_: None).compared
    assert compared.answers > 100_000
    assert compared.identical


def test_one_wheel_with_another_friction_is_shown_at_its_node_and_in_the_cycle_in_which_it_begins_to_matter(
    sound: Run, changed: Run, answer_of_changed: ReplayAnswer
) -> None:
    """The two logs themselves say when: until then their masters have sent the same."""
    first, *others = answer_of_changed.compared.ranked()
    assert (first.node.role, first.item.index) == ("drive_rr", 0x6064)
    logs = [lifted(run) for run in (sound, changed)]
    rows = [np.flatnonzero(table.can_id == 0x184) for table in logs]
    both = min(map(len, rows))
    unlike = (logs[0].data[rows[0][:both]] != logs[1].data[rows[1][:both]]).any(axis=1)
    stamp = float(logs[1].time[rows[1][int(np.argmax(unlike))]])
    mark = next(mark for mark in answer_of_changed.marks if mark.name.endswith("wheel_lifted"))
    begun = float(first.time[first.differing[0]])
    assert begun == pytest.approx(mark.time + stamp - mark.stamp, abs=1e-6)
    assert others == [], "in the air the wheels do not know of each other"


def test_what_was_found_can_be_had_as_text_numbers_and_page(answer_of_changed: ReplayAnswer) -> None:
    assert "drive_rr, 6064h Position actual value" in headline(answer_of_changed)
    assert "wheel_lifted" in headline(answer_of_changed)
    assert any(line.strip().startswith("drive_rr, 6064h") for line in summary_lines(answer_of_changed))
    numbers = json.loads(json.dumps(as_json(answer_of_changed), allow_nan=False))
    entry = next(one for one in numbers["objects"] if one["node"] == "drive_rr" and one["index"] == 0x6064)
    assert entry["first"]["recorded"] != entry["first"]["emulated"]
    assert entry["unit"] == "rad"
    assert not numbers["agrees"]
    page = render_page(answer_of_changed)
    assert "drive_rr" in page
    assert 'id="timeline"' in page


def test_the_vehicle_with_the_same_friction_agrees_again(changed: Run) -> None:
    answer = replay(ReplayOrder([changed.folder.path], effects=(parse_effect(CHANGED),)), lambda *_: None)
    assert answer.compared.identical


def test_a_run_whose_end_nobody_knows_is_refused(sound: Run, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    copy_tree(sound.folder.path, folder)
    log = sorted((folder / "frames").iterdir())[-1]
    log.rename(log.with_name(log.name.replace(".blf", ".part.blf")))
    with pytest.raises(RecordError, match="not finished") as caught:
        replay(ReplayOrder([folder]), lambda *_: None)
    assert "one by one" in caught.value.remedy


def test_a_run_that_was_gone_on_with_is_refused(sound: Run, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    copy_tree(sound.folder.path, folder)
    frames = folder / "frames"
    logs = sorted(frames.iterdir())
    for number, log in enumerate(logs, start=len(logs)):
        (frames / f"{number:03d}_{log.name[4:]}").write_bytes(log.read_bytes())
    with pytest.raises(RecordError, match="gone on with"):
        replay(ReplayOrder([folder]), lambda *_: None)


def copy_tree(source: Path, target: Path) -> None:
    shutil.copytree(source, target)
