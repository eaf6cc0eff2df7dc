"""Logs of any kind through the bench: by their stamps, whoever recorded them, wherever they begin."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from copy import deepcopy
from itertools import count
from pathlib import Path

import can
import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.frames.recorder import LogFormat, make_writer
from hil.master import Master
from hil.network import Network
from hil.page.channel import Channel, make_pair
from hil.page.emulated import Around, EmulatedView
from hil.page.shown import BusNow, Snapshot
from hil.page.watch import PERIOD, Watch
from hil.replay.comparing import Compared, compare
from hil.replay.parties import Answer
from hil.replay.playing import Player
from hil.replay.recording import read_logs
from hil.replay.replaying import ReplayAnswer, ReplayOrder, replay
from ident.errors import RecordError, UserError

SLIPS = "friction@wheel_rl:value=0.01,from=0.7s"
SLIPS_FROM = 0.7
Messages = list[can.Message]


def drive(network: Network, *faults: str, seed: int = 1, cycles: int = 500) -> tuple[Messages, float]:
    """Every frame from the boot-up on, all wheels driven ahead, and when the drives were enabled [s]."""
    frames: Messages = []
    with EmulatedVehicle(load_prototype(), seed=seed) as vehicle, LockstepBench(vehicle, ground=vehicle) as bench:
        # A master overwrites its messages in every cycle.
        master = Master(bench.bus, bench.clock, network, lambda message: frames.append(deepcopy(message)))
        master.boot()
        master.enable()
        begin = bench.clock.now()
        for fault in faults:
            bench.faults.add(fault)
        for _ in range(cycles):
            master.exchange((0.9,) * 4)
    return frames, begin


@pytest.fixture(scope="module")
def sound(network: Network) -> tuple[Messages, float]:
    return drive(network)


def written(path: Path, frames: Sequence[can.Message]) -> Path:
    writer = make_writer(path, LogFormat(path.suffix))
    for frame in frames:
        writer.on_message_received(frame)
    writer.stop()
    return path


def replayed(path: Path, emulations: int | None = None) -> ReplayAnswer:
    return replay(ReplayOrder([path], emulations=emulations), lambda *_: None)


def driven(frames: Messages, begin: float) -> Messages:
    """Without the boot-up: what a log of a drive holds that somebody began to record later."""
    first = next(k for k, frame in enumerate(frames) if frame.timestamp > begin and frame.arbitration_id == 0x80)
    return frames[first:]


@pytest.mark.parametrize("log_format", LogFormat, ids=lambda log_format: log_format.name)
def test_a_log_that_begins_in_the_middle_agrees_within_noise_in_every_format(
    tmp_path: Path, sound: tuple[Messages, float], log_format: LogFormat
) -> None:
    answer = replayed(written(tmp_path / f"drive{log_format}", driven(*sound)))
    assert answer.emulations == 3
    assert not answer.in_step
    assert answer.compared.agrees, headline_of(answer)
    assert not answer.compared.identical, "the noise of a vehicle that stood there before is another one"
    assert len(answer.compared.tracks) == 14


def headline_of(answer: ReplayAnswer) -> str:
    return ", ".join(f"{track.node.role} {track.item.name}" for track in answer.compared.ranked())


def test_a_wheel_that_loses_its_grip_is_shown_where_and_when_it_does(tmp_path: Path, network: Network) -> None:
    answer = replayed(written(tmp_path / "slips.blf", driven(*drive(network, SLIPS))))
    first = answer.compared.ranked()[0]
    assert (first.node.role, first.item.index) == ("drive_rl", 0x6064)
    assert SLIPS_FROM - 0.02 < float(first.time[first.differing[0]]) < SLIPS_FROM + 0.05
    assert first.difference[first.differing[-1]] * first.unit[0] < 0, "the emulated wheel, with grip, turns less"


def test_in_step_with_its_master_the_first_bit_of_a_slipping_wheel_is_seen(tmp_path: Path, network: Network) -> None:
    frames, begin = drive(network, SLIPS)
    compared = in_step(written(tmp_path / "slips.log", frames), network)
    first = compared.ranked()[0]
    assert (first.node.role, first.item.index) == ("drive_rl", 0x6064)
    assert begin + SLIPS_FROM < float(first.time[first.differing[0]]) < begin + SLIPS_FROM + 0.01


def in_step(path: Path, network: Network) -> Compared:
    recording = read_logs([path])
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle, ground=vehicle) as bench:
        return compare(Player(bench, network).in_step(recording, lambda *_: None), (), network)


def test_a_log_with_its_boot_up_needs_nobody_else(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    answer = replayed(written(tmp_path / "whole.log", sound[0]))
    assert answer.compared.agrees, headline_of(answer)


def test_in_step_every_frame_of_a_recorded_test_is_the_same(
    tmp_path: Path, network: Network, sound: tuple[Messages, float]
) -> None:
    assert in_step(written(tmp_path / "whole.log", sound[0]), network).identical


def without(can_id: int, begin: float) -> Callable[[Messages], Messages]:
    return lambda frames: [f for f in frames if f.arbitration_id != can_id or f.timestamp < begin]


def test_a_node_that_falls_silent_in_the_record_is_named_with_the_instant(
    tmp_path: Path, network: Network, sound: tuple[Messages, float]
) -> None:
    frames, begin = sound
    compared = in_step(written(tmp_path / "silent.log", without(0x183, begin + 0.5)(frames)), network)
    (event,) = compared.events
    assert (event.node.role, event.answer) == ("drive_fr", Answer.SAMPLE)
    assert event.recorded_at is None
    assert event.emulated_at == pytest.approx(begin + 0.5, abs=0.003)


def test_an_emergency_that_nobody_emulates_is_named(
    tmp_path: Path, network: Network, sound: tuple[Messages, float]
) -> None:
    frames, begin = sound
    data = struct.pack("<HB5x", 0x4310, 0x09)
    at = next(k for k, f in enumerate(frames) if f.timestamp > begin + 0.3 and f.arbitration_id == 0x80)
    hot = can.Message(frames[at].timestamp - 1e-4, 0x82, is_extended_id=False, data=data)
    compared = in_step(written(tmp_path / "hot.log", [*frames[:at], hot, *frames[at:]]), network)
    (event,) = compared.events
    assert (event.node.role, event.answer, event.recorded, event.emulated_at) == (
        "drive_rl",
        Answer.EMERGENCY,
        data,
        None,
    )


def test_cycles_that_a_master_left_out_are_left_out_again(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    """Time goes on by them: the emulated wheels are as far as the recorded ones."""
    frames = driven(*sound)
    begin = frames[0].timestamp
    kept = [f for f in frames if not begin + 0.3995 < f.timestamp < begin + 0.4075]
    assert len(frames) - len(kept) > 40
    answer = replayed(written(tmp_path / "hasty.blf", kept))
    assert answer.compared.agrees, headline_of(answer)


def test_stamps_of_another_epoch_and_jitter_change_nothing(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    frames = []
    for number, frame in enumerate(driven(*sound)):
        late = 3e-4 * ((number * 7919) % 11) / 11
        frames.append(
            can.Message(
                1.7e9 + frame.timestamp + late, frame.arbitration_id, is_extended_id=False, data=frame.data, channel=0
            )
        )
    answer = replayed(written(tmp_path / "late.blf", sorted(frames, key=lambda frame: frame.timestamp)))
    assert answer.compared.agrees, headline_of(answer)


def test_a_filtered_log_without_heartbeats_trips_nobody(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    frames = [frame for frame in driven(*sound) if frame.arbitration_id < 0x700]
    answer = replayed(written(tmp_path / "filtered.blf", frames))
    assert answer.compared.agrees, headline_of(answer)


MISTAKES = {
    "no log": (["missing.blf"], "missing.blf does not exist"),
    "no format": (["notes.txt"], "notes.txt is no log of a known format"),
    "another network": (["strangers.log"], "has no samples of node 1"),
    "not in their order": (["b.log", "a.log"], "begins before b ends"),
    "a folder among logs": ([".", "a.log"], "not all that is named"),
}


@pytest.mark.parametrize(("names", "said"), MISTAKES.values(), ids=MISTAKES)
def test_what_cannot_be_replayed_is_said_with_a_remedy(tmp_path: Path, names: list[str], said: str) -> None:
    (tmp_path / "notes.txt").write_text("no log")
    (tmp_path / "strangers.log").write_text("(1.000000) can0 0C1#00\n(1.002000) can0 080#\n")
    (tmp_path / "a.log").write_text("(1.000000) can0 080#\n")
    (tmp_path / "b.log").write_text("(2.000000) can0 080#\n(2.500000) can0 080#\n")
    with pytest.raises(UserError, match=said) as caught:
        replay(ReplayOrder([tmp_path / name for name in names]), lambda *_: None)
    assert caught.value.remedy


def test_a_clock_that_was_set_by_a_year_is_refused(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    frames = driven(*sound)
    for frame in (late := frames[-100:]):
        frame.timestamp += 3e7
    path = written(tmp_path / "year.blf", frames)
    for frame in late:
        frame.timestamp -= 3e7
    with pytest.raises(RecordError, match="clock may have been set"):
        replayed(path)


def test_one_emulation_is_watched_and_watching_changes_nothing(
    tmp_path: Path, sound: tuple[Messages, float], network: Network
) -> None:
    path = written(tmp_path / "drive.blf", driven(*sound))
    seen: list[float] = []
    told: list[tuple[str, int, int]] = []

    def begin(vehicle: EmulatedVehicle, bench: LockstepBench, complete: Network) -> None:
        assert complete.drives[0].role == network.drives[0].role
        ours, theirs = map(Channel, make_pair())
        around = Around(lambda: BusNow(bench.load.frames, (bench.load.bits,) * 2))
        view = EmulatedView("replay", vehicle, bench.devices, complete, around)
        watch = Watch(ours, view, bench.faults, count(step=2 * PERIOD).__next__)

        def attend() -> None:
            watch.attend()
            seen.extend(one.time for one in theirs.receive() if isinstance(one, Snapshot))

        bench.attend(attend)

    watched = replay(ReplayOrder([path]), lambda *words: told.append(words), begin)
    alone = replayed(path)
    assert len(seen) > 900
    assert seen == sorted(seen), "one emulation of three"
    assert told[-1][1] == told[-1][2] > 0, "the last word is that all is done"
    assert watched.notes == alone.notes
    assert watched.compared.answers == alone.compared.answers
    for one, other in zip(watched.compared.tracks, alone.compared.tracks, strict=True):
        assert (one.emulated == other.emulated).all()


def test_what_was_injected_while_it_was_watched_is_in_the_answer(tmp_path: Path, sound: tuple[Messages, float]) -> None:
    path = written(tmp_path / "drive.blf", driven(*sound))

    def begin(_vehicle: EmulatedVehicle, bench: LockstepBench, _network: Network) -> None:
        bench.faults.add("stuck@drive_fl:from=0.5s")

    answer = replay(ReplayOrder([path], emulations=1), lambda *_: None, begin)
    assert any("stuck@drive_fl" in note for note in answer.notes)
    assert not answer.compared.agrees
