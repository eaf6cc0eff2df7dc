"""What the master saw can be had again from the recorded frames alone, and nothing finished is lost."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import can
import numpy as np
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.frames import decode_log, read_log
from hil.frames.recorder import LogFormat, Recorder, finished_steps, set_aside
from hil.master import Master, Sample
from hil.network import Network, load_network
from ident.errors import RecordError

CYCLES = 250


def torques(k: int) -> list[float]:
    return [0.3 * math.sin(0.07 * k + wheel) for wheel in range(4)]


def record(
    directory: Path, network_file: Path, log_format: LogFormat, cycles: int = CYCLES
) -> tuple[Path, list[Sample]]:
    """Drive one step called `straight`; its log and what the master saw."""
    vehicle = Flywheels()
    vehicle.encoders[0].counts = 70000
    recorder = Recorder(directory, log_format)
    with (
        LockstepBench(vehicle, network_file) as bench,
        Master(bench.bus, bench.clock, load_network(network_file), recorder) as master,
    ):
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            samples = [master.exchange(torques(k)) for k in range(cycles)]
    recorder.close()
    return path, samples


@pytest.mark.parametrize("log_format", LogFormat, ids=lambda log_format: log_format.name)
def test_decoded_frames_are_what_the_master_saw(tmp_path: Path, network_file: Path, log_format: LogFormat) -> None:
    path, samples = record(tmp_path, network_file, log_format)
    network = load_network(network_file)
    decoded = decode_log(path, network)
    np.testing.assert_array_equal(decoded.motor_torques, [sample.motor_torques for sample in samples])
    np.testing.assert_array_equal(decoded.wheel_angles, [sample.wheel_angles for sample in samples])
    np.testing.assert_array_equal(decoded.steering_angles, [sample.steering_angles for sample in samples])
    np.testing.assert_allclose(decoded.time, np.arange(CYCLES) * 0.002, atol=1e-12)
    resolution = abs(network.drives[0].torque_unit)
    np.testing.assert_allclose(decoded.command_torques, [torques(k) for k in range(CYCLES)], atol=0.51 * resolution)
    assert decoded.jitter < 1e-4


def test_the_torque_measured_at_a_sync_is_the_one_commanded_up_to_it(tmp_path: Path, network: Network) -> None:
    """Flywheel drives answer at once, so the two columns agree row by row only if neither is shifted."""
    path, _ = record(tmp_path, network.path, LogFormat.BLF)
    decoded = decode_log(path, network)
    np.testing.assert_array_equal(decoded.command_torques, decoded.motor_torques)


def test_counters_that_wrap_decode_to_continuous_angles(tmp_path: Path, network: Network) -> None:
    vehicle = Flywheels()
    vehicle.drives[1].angle, vehicle.drives[1].speed = 2 * math.pi * 2042.0, 200.0
    recorder = Recorder(tmp_path)
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            samples = [master.exchange((0.0,) * 4) for _ in range(CYCLES)]
    recorder.settle()
    raw = read_log(path)
    counts = raw.data[raw.can_id == 0x182, 4:].copy().view("<i4").ravel()
    assert (counts > 0).any()
    assert (counts < 0).any()
    angles = decode_log(path, network).wheel_angles[:, 1]
    assert np.all(np.diff(angles) > 0)
    assert np.max(np.diff(angles)) < 0.05
    np.testing.assert_allclose(angles - angles[0], [s.wheel_angles[1] - samples[0].wheel_angles[1] for s in samples])


def test_the_log_of_python_cans_own_reader_is_the_same(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path, LogFormat.BLF, cycles=40)
    table = read_log(path)
    with can.BLFReader(path) as reader:
        messages = list(reader)
    assert len(table) == len(messages)
    for row, message in enumerate(messages):
        assert table.time[row] == pytest.approx(message.timestamp, abs=1e-9)
        assert (table.can_id[row], table.length[row]) == (message.arbitration_id, message.dlc)
        assert bytes(table.data[row, : message.dlc]) == bytes(message.data)


def test_a_log_with_other_things_in_it_decodes_too(tmp_path: Path, network: Network) -> None:
    path, samples = record(tmp_path, network.path, LogFormat.BLF, cycles=40)
    mixed = tmp_path / "mixed.blf"
    with can.BLFReader(path) as reader, can.BLFWriter(mixed) as writer:
        for number, message in enumerate(reader):
            if number == 100:
                writer.log_event("a marker", message.timestamp)
                writer.on_message_received(
                    can.Message(timestamp=message.timestamp, arbitration_id=0x181, is_extended_id=True, data=b"\x01")
                )
                writer.on_message_received(can.Message(timestamp=message.timestamp, is_error_frame=True))
            writer.on_message_received(message)
    decoded = decode_log(mixed, network)
    np.testing.assert_array_equal(decoded.wheel_angles, [sample.wheel_angles for sample in samples])


def test_two_hundred_seconds_decode_in_a_few(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path, LogFormat.BLF, cycles=2000)
    start = time.process_time()
    decode_log(path, network)
    assert (time.process_time() - start) * 100_000 / 2000 < 10.0


def test_the_same_run_writes_the_same_file_bit_for_bit(tmp_path: Path, network: Network) -> None:
    paths = [record(tmp_path / name, network.path, LogFormat.BLF, cycles=100)[0] for name in ("one", "two")]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_directory_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RecordError, match="file"):
        Recorder(tmp_path / "file")


@pytest.mark.parametrize("log_format", [LogFormat.BLF, LogFormat.ASC, LogFormat.CANDUMP], ids=lambda f: f.name)
def test_a_full_disk_is_an_error_with_a_remedy_and_no_step_is_called_finished(
    small_disk: Path, log_format: LogFormat
) -> None:
    def drive(recorder: Recorder) -> None:
        generator = np.random.default_rng(1)
        for step in ("steering_left", "straight"):
            with recorder.step(step):
                for number in range(20_000 if step == "straight" else 20):
                    data = generator.bytes(8)
                    recorder(can.Message(number * 1e-3, 0x181, is_extended_id=False, data=data))
        recorder.close()

    recorder = Recorder(small_disk, log_format)
    with pytest.raises(RecordError, match="No space left") as caught:
        drive(recorder)
    recorder.settle()  # The first step gets its name beside what is recorded meanwhile.
    assert "free some space" in caught.value.remedy
    names = sorted(path.name for path in small_disk.iterdir())
    assert names == [f"000_steering_left{log_format}", f"001_straight.part{log_format}"]
    assert len(read_log(small_disk / names[0])) == 20


def test_a_file_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    """Two recorders that took the same number: one of them goes on."""
    first, second = Recorder(tmp_path), Recorder(tmp_path)
    with first.step("straight"):
        first(can.Message(arbitration_id=0x80, is_extended_id=False))
        with pytest.raises(RecordError, match="exists"), second.step("straight"):
            pass
    first.close()
    ((_, path),) = finished_steps(tmp_path)
    kept = path.read_bytes()

    def again() -> None:
        with second.step("straight"):
            second(can.Message(arbitration_id=0x181, is_extended_id=False))
        second.close()

    with pytest.raises(RecordError, match="is there"):
        again()
    assert path.read_bytes() == kept


def test_a_step_is_on_the_disk_before_it_is_called_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the master does not wait for the disk meanwhile."""
    disk, seen = threading.Event(), []
    fsync = os.fsync

    def slow(descriptor: int) -> None:
        disk.wait()
        seen.append(list(tmp_path.iterdir()))
        fsync(descriptor)

    recorder = Recorder(tmp_path)
    monkeypatch.setattr(os, "fsync", slow)
    for step in ("steering_left", "straight"):
        with recorder.step(step):
            recorder(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert finished_steps(tmp_path) == []
    disk.set()
    recorder.settle()
    assert seen[0] == [tmp_path / "000_steering_left.part.blf"] or len(seen[0]) == 2
    assert [step for step, _ in finished_steps(tmp_path)] == ["steering_left", "straight"]


def test_a_log_that_cannot_be_used_is_kept_under_another_name(tmp_path: Path) -> None:
    path = tmp_path / "003_straight.blf"
    path.write_bytes(b"whatever")
    kept = set_aside(path)
    assert (kept.name, kept.read_bytes()) == ("003_straight.unusable.blf", b"whatever")
    assert finished_steps(tmp_path) == []
    path.write_bytes(b"another")
    with pytest.raises(RecordError, match="is there"):
        set_aside(path)
    assert (path.read_bytes(), kept.read_bytes()) == (b"another", b"whatever")


def test_steps_are_numbered_and_what_lies_between_them_is_kept(tmp_path: Path, network: Network) -> None:
    record(tmp_path, network.path, LogFormat.BLF, cycles=5)
    record(tmp_path, network.path, LogFormat.BLF, cycles=5)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "000_interlude.blf",
        "001_straight.blf",
        "002_interlude.blf",
        "003_interlude.blf",
        "004_straight.blf",
        "005_interlude.blf",
    ]
    assert [(name, path.name) for name, path in finished_steps(tmp_path)] == [
        ("straight", "001_straight.blf"),
        ("straight", "004_straight.blf"),
    ]


def test_every_frame_of_the_bus_is_in_the_files(tmp_path: Path, network: Network) -> None:
    record(tmp_path, network.path, LogFormat.CANDUMP, cycles=20)
    lines = [line for path in sorted(tmp_path.iterdir()) for line in path.read_text().splitlines()]
    assert sum(" 000#81" in line for line in lines) == 6
    assert sum("#00" in line and " 70" in line for line in lines) >= 6
    assert any(" 601#40001000" in line for line in lines)


def test_a_step_that_fails_keeps_its_partial_name(tmp_path: Path) -> None:
    def fail(recorder: Recorder) -> None:
        with recorder.step("rotation"):
            recorder(can.Message(arbitration_id=0x80, is_extended_id=False))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail(Recorder(tmp_path))
    assert finished_steps(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == ["000_rotation.part.blf"]
    again = Recorder(tmp_path)
    with again.step("rotation") as path:
        again(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert path.name == "001_rotation.blf"


KILLED_RUN = """
import os, sys, math
from pathlib import Path
from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import load_network
from hil.frames.recorder import LogFormat, Recorder
recorder = Recorder(Path(sys.argv[1]), LogFormat(sys.argv[2]))
bench = LockstepBench(Flywheels())
master = Master(bench.bus, bench.clock, load_network(), recorder)
master.boot()
master.enable()
for step in ("steering_left", "straight"):
    with recorder.step(step):
        for k in range(1500):
            master.exchange([0.1] * 4)
        if step == "straight":
            recorder.settle()  # A real step takes longer than a disk: the one before has its name by then.
            os.kill(os.getpid(), 9)
"""


@pytest.mark.parametrize("log_format", [LogFormat.BLF, LogFormat.ASC, LogFormat.CANDUMP], ids=lambda f: f.name)
def test_a_killed_run_keeps_its_finished_steps_and_most_of_the_running_one(
    tmp_path: Path, network: Network, log_format: LogFormat
) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED_RUN, str(tmp_path), log_format.value], check=False)
    assert done.returncode == -9
    ((name, path),) = finished_steps(tmp_path)
    assert name == "steering_left"
    assert len(decode_log(path, network).time) == 1500
    partial = tmp_path / f"002_straight.part{log_format}"
    with pytest.raises(RecordError, match="truncated"):
        decode_log(partial, network)
    rest = decode_log(partial, network, accept_truncated=True)
    assert 900 < len(rest.time) < 1500


def test_a_log_cut_anywhere_is_truncated_or_damaged_but_never_misread(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path, LogFormat.BLF, cycles=400)
    whole = path.read_bytes()
    cut = tmp_path / "cut.blf"
    for size in (0, 3, 100, 144, 160, 500, len(whole) // 2, len(whole) - 8):
        cut.write_bytes(whole[:size])
        with pytest.raises(RecordError) as caught:
            decode_log(cut, network)
        assert "cut.blf" in caught.value.what


DAMAGES = {
    "nothing": b"",
    "text in a BLF": b"this is not a log at all, though it is long enough to hold a header" * 10,
    "zeros": bytes(1000),
}


@pytest.mark.parametrize("content", DAMAGES.values(), ids=DAMAGES)
@pytest.mark.parametrize("log_format", LogFormat, ids=lambda log_format: log_format.name)
def test_a_file_that_is_no_log_is_refused_with_its_name(tmp_path: Path, content: bytes, log_format: LogFormat) -> None:
    path = tmp_path / f"odd{log_format}"
    path.write_bytes(content)
    with pytest.raises(RecordError) as caught:
        read_log(path)
    assert path.name in caught.value.what


def test_a_missing_file_and_an_unknown_format_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="does not exist"):
        read_log(tmp_path / "nowhere.blf")
    with pytest.raises(RecordError, match="does not exist"):
        read_log(tmp_path / "a_folder_that_is_not_there")
    there = tmp_path / "somewhere.xyz"
    there.write_text("no frames")
    with pytest.raises(RecordError, match="no log of a known format"):
        read_log(there)


def without(source: Path, target: Path, drop) -> Path:
    """A copy of a log without the frames for which `drop(number, message)` is true."""
    with can.BLFReader(source) as reader, can.BLFWriter(target) as writer:
        for number, message in enumerate(reader):
            if not drop(number, message):
                writer.on_message_received(message)
    return target


def test_a_node_that_is_not_in_the_log_is_named(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path, LogFormat.BLF, cycles=20)
    gap = without(path, tmp_path / "gap.blf", lambda _, message: message.arbitration_id == 0x183)
    with pytest.raises(RecordError, match=r"no samples of node 3 \(drive_fr\)"):
        decode_log(gap, network)


def test_a_log_of_another_vehicle_is_told_by_its_nodes(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path.with_name("compact.toml"), LogFormat.BLF, cycles=20)
    with pytest.raises(RecordError, match="network file"):
        decode_log(path, network)


def test_a_lost_sample_is_named_by_node_and_time(tmp_path: Path, network: Network) -> None:
    path, _ = record(tmp_path, network.path, LogFormat.BLF, cycles=20)
    seen = iter(range(100))
    gap = without(path, tmp_path / "gap.blf", lambda _, message: message.arbitration_id == 0x185 and next(seen) == 7)
    with pytest.raises(RecordError, match=r"node 5 \(encoder_left\) has no sample in 1 of 20 cycles \(t = 0.014 s\)"):
        decode_log(gap, network)


def stumble(bench: LockstepBench, master: Master, recorder: Recorder, delays: dict[int, float]) -> list[Sample]:
    """Drive a step in which the computer has no time for the master now and then: cycle -> delay [s]."""
    with recorder.step("straight"):
        samples = []
        for k in range(200):
            bench.clock.wait_until(bench.clock.now() + delays.get(k, 0.0))
            samples.append(master.exchange((0.0, *[0.02 * math.sin(0.05 * k)] * 3)))
    return samples


STUMBLES = {
    "late by less than a cycle": ({50: 0.0033, 120: 0.0025}, 0, 201),
    "late by some cycles": ({50: 0.0073}, 3, 203),
    "late by exactly one cycle": ({50: 0.004}, 1, 201),
    "never late": ({}, 0, 200),
}


@pytest.mark.parametrize(("delays", "missing", "rows"), STUMBLES.values(), ids=STUMBLES)
def test_a_master_short_of_time_leaves_a_record_that_is_still_uniform_and_true(
    tmp_path: Path, network: Network, delays: dict[int, float], missing: int, rows: int
) -> None:
    vehicle, recorder = Flywheels(), Recorder(tmp_path)
    vehicle.drives[0].speed, vehicle.drives[0].friction = 100.0, 1e-9
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        samples = stumble(bench, master, recorder, delays)
        assert master.overruns == (missing > 0)
    recorder.settle()
    ((_, path),) = finished_steps(tmp_path)
    decoded = decode_log(path, network)
    assert (decoded.missing, decoded.resampled, len(decoded.time)) == (missing, rows > 200, rows)
    # The wheel turns at constant speed: its angle tells the time at which it was sampled.
    # Six heartbeats that were due meanwhile may come before the SYNC and delay its stamp.
    speed, stamp_error = 100.0 / 20, 400e-6 if decoded.resampled else 0.0
    errors = decoded.wheel_angles[:, 0] - decoded.wheel_angles[0, 0] - speed * decoded.time
    assert np.max(np.abs(errors)) < 1e-6 + speed * stamp_error
    assert decoded.wheel_angles[-1, 0] == pytest.approx(samples[-1].wheel_angles[0], abs=1e-6 + speed * stamp_error)


def test_more_cycles_left_out_than_can_be_interpolated_are_an_error(tmp_path: Path, network: Network) -> None:
    recorder = Recorder(tmp_path)
    with LockstepBench(Flywheels()) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        stumble(bench, master, recorder, {100: 0.030})
    recorder.settle()
    ((_, path),) = finished_steps(tmp_path)
    with pytest.raises(RecordError, match=r"14 cycles in a row are missing after t = 0.198 s"):
        decode_log(path, network)
    assert decode_log(path, network, longest_gap=20).missing == 14
