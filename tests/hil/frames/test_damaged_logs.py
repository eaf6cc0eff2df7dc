"""What a log does not hold is seen: its end, the time in which its clock was set, frames that were lost or damaged."""

from __future__ import annotations

import math
import resource
from collections.abc import Callable, Sequence
from pathlib import Path

import can
import numpy as np
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.campaign.reading import read_logs
from hil.frames import decode_log, read_log
from hil.frames.mcap_log import McapFrames
from hil.frames.recorder import LogFormat, Recorder
from hil.master import Master
from hil.network import Network
from ident.errors import RecordError

CYCLES = 120
SPEED = 300.0
"""Of the front left motor [rad/s]."""
SYNC = 0x80
Messages = list[can.Message]

WRITERS: dict[LogFormat, Callable[[Path], can.io.generic.MessageWriter]] = {
    LogFormat.BLF: can.BLFWriter,
    LogFormat.ASC: can.ASCWriter,
    LogFormat.CANDUMP: can.CanutilsLogWriter,
    LogFormat.MF4: can.MF4Writer,
    LogFormat.MCAP: McapFrames,
}


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory, network: Network) -> Messages:
    """Every frame of a step in which one wheel turns at constant speed."""
    vehicle, recorder = Flywheels(), Recorder(tmp_path_factory.mktemp("sound"))
    vehicle.drives[0].speed, vehicle.drives[0].friction = SPEED, 1e-9
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            for k in range(CYCLES):
                master.exchange((0.0, *[0.2 * math.sin(0.05 * k)] * 3))
    recorder.close()
    with can.BLFReader(path) as reader:
        return list(reader)


def written(path: Path, frames: Sequence[can.Message]) -> Path:
    with WRITERS[LogFormat(path.suffix)](path) as writer:
        for frame in frames:
            writer.on_message_received(frame)
    return path


def with_error_frames(frames: Sequence[can.Message], every: int = 50) -> Messages:
    mixed: Messages = []
    for number, frame in enumerate(frames):
        mixed.append(frame)
        if number % every == every - 1:
            mixed.append(can.Message(timestamp=frame.timestamp, is_error_frame=True))
    return mixed


def later(frames: Sequence[can.Message], cycle: int, seconds: float) -> Messages:
    """The clock of the log is set by so much before the SYNC of a cycle."""
    moved, syncs = [], 0
    for frame in frames:
        syncs += frame.arbitration_id == SYNC
        stamp = frame.timestamp + (seconds if syncs > cycle else 0.0)
        moved.append(can.Message(stamp, frame.arbitration_id, is_extended_id=False, data=frame.data, channel=0))
    return moved


@pytest.mark.parametrize("log_format", LogFormat, ids=lambda log_format: log_format.name)
def test_error_frames_change_nothing(
    tmp_path: Path, network: Network, messages: Messages, log_format: LogFormat
) -> None:
    sound = decode_log(written(tmp_path / f"sound{log_format}", messages), network)
    mixed = decode_log(written(tmp_path / f"mixed{log_format}", with_error_frames(messages)), network)
    np.testing.assert_array_equal(mixed.wheel_angles, sound.wheel_angles)
    np.testing.assert_array_equal(mixed.command_torques, sound.command_torques)


@pytest.mark.parametrize("last", ["error frames at the end", "frames at the end"])
@pytest.mark.parametrize("share", [0.999, 0.9, 0.51, 0.2])
@pytest.mark.parametrize("log_format", LogFormat, ids=lambda log_format: log_format.name)
def test_a_log_with_error_frames_that_was_cut_is_refused(
    tmp_path: Path, network: Network, messages: Messages, log_format: LogFormat, share: float, last: str
) -> None:
    frames = with_error_frames(messages)
    if last.startswith("error"):
        frames += [can.Message(timestamp=frames[-1].timestamp, is_error_frame=True)] * 500
    whole = written(tmp_path / f"whole{log_format}", frames).read_bytes()
    cut = tmp_path / f"cut{log_format}"
    cut.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(RecordError, match=r"cut\.") as caught:
        decode_log(cut, network)
    assert caught.value.remedy


@pytest.mark.parametrize("compression", [0, 6])
def test_what_is_left_of_an_unfinished_log_with_error_frames_can_be_had(
    tmp_path: Path, network: Network, messages: Messages, compression: int
) -> None:
    path = tmp_path / "cut.blf"
    with can.BLFWriter(path, compression_level=compression, max_container_size=4096) as writer:
        for frame in with_error_frames(messages):
            writer.on_message_received(frame)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(RecordError, match=r"truncated after \d+ frames, .* cut off"):
        decode_log(path, network)
    rest = decode_log(path, network, accept_truncated=True)
    assert CYCLES / 4 < len(rest.time) < CYCLES


@pytest.mark.parametrize("seconds", [1e9, 86400.0, 3600.0, 0.1, 0.02, 0.007, 0.0013, -0.0008, -0.0033, -0.1, -3600.0])
@pytest.mark.parametrize("log_format", [LogFormat.BLF, LogFormat.CANDUMP], ids=lambda log_format: log_format.name)
def test_a_clock_that_was_set_is_refused_at_its_place(
    tmp_path: Path, network: Network, messages: Messages, log_format: LogFormat, seconds: float
) -> None:
    path = tmp_path / f"set{log_format}"
    if log_format is LogFormat.CANDUMP:
        # Its writer of python-can would hold the stamps back; candump itself does not.
        frames = later(messages, 60, seconds)
        path.write_text(
            "".join(
                f"({1.7e9 + frame.timestamp:.6f}) can0 {frame.arbitration_id:03X}#{frame.data.hex().upper()}\n"
                for frame in frames
            )
        )
    else:
        written(path, later(messages, 60, seconds))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(RecordError, match=r"t = 0\.11[6-9] s|t = 0\.12[0-2] s"):
        decode_log(path, network)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def test_a_master_that_was_late_is_no_clock_that_was_set(tmp_path: Path, network: Network) -> None:
    """The same stamps, but the wheel has turned meanwhile."""
    vehicle, recorder = Flywheels(), Recorder(tmp_path)
    vehicle.drives[0].speed, vehicle.drives[0].friction = SPEED, 1e-9
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, network, recorder) as master:
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            for k in range(CYCLES):
                bench.clock.wait_until(bench.clock.now() + (0.0033 if k == 60 else 0.0))
                master.exchange((0.0,) * 4)
    recorder.close()
    assert decode_log(path, network).resampled


def test_logs_of_another_cycle_are_told_by_their_period(
    tmp_path: Path, messages: Messages, rewritten_network: Callable[..., Network]
) -> None:
    slower = rewritten_network(("cycle_period = { value = 0.002", "cycle_period = { value = 0.004"))
    with pytest.raises(RecordError, match=r"every 2\.000 ms, and the network file says 4\.000 ms"):
        decode_log(written(tmp_path / "log.blf", messages), slower)


def test_a_lost_command_is_named(tmp_path: Path, network: Network, messages: Messages) -> None:
    commands = [number for number, frame in enumerate(messages) if frame.arbitration_id == 0x203]
    rest = [frame for number, frame in enumerate(messages) if number != commands[40]]
    with pytest.raises(RecordError, match=r"no command to node 3 \(drive_fr\) in 1 of 120 cycles"):
        decode_log(written(tmp_path / "log.blf", rest), network)


@pytest.mark.parametrize("bit", [0, 3, 9, 14, 20, 30])
@pytest.mark.parametrize("log_format", [LogFormat.BLF, LogFormat.CANDUMP], ids=lambda log_format: log_format.name)
def test_a_bit_that_flipped_in_a_position_is_refused_or_no_more_than_noise(
    tmp_path: Path, network: Network, messages: Messages, log_format: LogFormat, bit: int
) -> None:
    positions = [number for number, frame in enumerate(messages) if frame.arbitration_id == 0x182]
    frames = list(messages)
    hit = frames[positions[70]]
    data = bytearray(hit.data)
    data[4 + bit // 8] ^= 1 << bit % 8
    frames[positions[70]] = can.Message(hit.timestamp, hit.arbitration_id, is_extended_id=False, data=data)
    path = written(tmp_path / f"000_straight{log_format}", frames)
    if bit >= 9:
        with pytest.raises(RecordError, match=r"beta_rl at sample 70 .* no motion"):
            read_logs([path], network)
    else:
        sound = read_logs([written(tmp_path / f"001_straight{log_format}", messages)], network).segments[0]
        off = read_logs([path], network).segments[0].wheel_angles - sound.wheel_angles
        assert 0 < np.max(np.abs(off)) <= 2**bit * abs(network.drives[1].angle_unit) * 1.001


@pytest.mark.parametrize("counts", [1, 16, 17, 512])
def test_a_lone_sample_of_an_encoder_that_rests_is_refused_beyond_the_flicker_of_its_counts(
    tmp_path: Path, network: Network, messages: Messages, counts: int
) -> None:
    """Steering stands still in all of it: a record of channels would take that sample itself for the resolution."""
    frames = list(messages)
    positions = [number for number, frame in enumerate(frames) if frame.arbitration_id == 0x186]
    assert len({bytes(frames[number].data) for number in positions}) == 1
    hit = frames[positions[70]]
    off = (int.from_bytes(hit.data, "little") - counts) % 2**17
    frames[positions[70]] = can.Message(
        hit.timestamp, hit.arbitration_id, is_extended_id=False, data=off.to_bytes(4, "little")
    )
    path = written(tmp_path / "000_straight.log", frames)
    if counts > 16:
        with pytest.raises(RecordError, match=rf"6004h of .* is {counts} counts off at sample 70, .* no motion"):
            read_logs([path], network)
    else:
        read_logs([path], network)


@pytest.mark.parametrize(
    "line",
    [
        "(1.0) can0 181#0102030",
        "(1.0) can0 1G1#00",
        "(1.0) can0 181",
        "1.0 can0 181#00",
        "(nan) can0 181#00",
        "garbage",
    ],
)
def test_a_line_that_is_no_frame_is_named_by_its_number(tmp_path: Path, line: str) -> None:
    path = tmp_path / "odd.log"
    path.write_text(f"(0.5) can0 181#00\n{line}\n(1.5) can0 181#00\n")
    with pytest.raises(RecordError, match="line 2"):
        read_log(path)


@pytest.mark.parametrize(
    "line", ["  0.1 1  181  Rx   d 8 01 02 03", "  0.1 1  1G1  Rx   d 1 01", "  0,1 1  181  Rx   d 1 01", "garbage"]
)
def test_a_line_of_an_asc_log_that_is_none_is_named_by_its_number(tmp_path: Path, line: str) -> None:
    path = tmp_path / "odd.asc"
    head = "date Mon Jan 1 10:00:00.000 am 2024\nbase hex  timestamps absolute\ninternal events logged\n"
    path.write_text(f"{head}{line}\n  0.2 1  181  Rx   d 1 01\nEnd TriggerBlock\n")
    with pytest.raises(RecordError, match="line 4"):
        read_log(path)


def test_other_events_of_an_asc_log_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "events.asc"
    path.write_text(
        "date Mon Jan 1 10:00:00.000 am 2024\nbase dec  timestamps absolute\nno internal events logged\n"
        "// version 13.0.0\nBegin Triggerblock Mon Jan 1 10:00:00.000 am 2024\n   0.000000 Start of measurement\n"
        "   0.001000 CAN 1 Status:chip status error active\n   0.002000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0\n"
        "   0.003000 1  385             Rx   d 2 16 255  Length = 200000 BitCount = 64 ID = 385\n"
        "   0.004000 1  ErrorFrame\n   0.005000 1  385             Tx   r\n   0.006000 1  385x            Rx   d 1 1\n"
        "End TriggerBlock\n"
    )
    table = read_log(path)
    assert len(table) == 4
    assert (table.can_id[0], table.length[0], bytes(table.data[0, :2])) == (385, 2, b"\x10\xff")


def test_stamps_that_count_from_the_line_before_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "relative.asc"
    path.write_text("base hex  timestamps relative\n  0.1 1  181  Rx   d 1 01\nEnd TriggerBlock\n")
    with pytest.raises(RecordError, match="absolute"):
        read_log(path)
