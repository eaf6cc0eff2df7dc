"""The C devices in an FMU send what the emulator's firmware sends: the same frames, in the same order, in time."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu.bus.system import BusSystem
from hil.lsbus.system import vehicle_on_bus
from hil.network import DEFAULT_NETWORK
from tests.hil.lsbus.stimuli import (
    CYCLE,
    DISABLE_VOLTAGE,
    ENABLE,
    FAULT_RESET,
    OF_THE_FMU,
    PRE_OPERATIONAL,
    QUICK_STOP,
    RESET_COMMUNICATION,
    RESET_NODE,
    SHUTDOWN,
    START,
    STOP,
    SWITCH_ON,
    SYNC,
    command,
    heartbeat,
    mapped,
    nmt,
    read,
    sequences,
    to_operation_enabled,
    write,
)
from tests.hil.lsbus.twins import Data, Remote, Stimulus, Wait, open_twins, silent_prototype

DRIVES = (1, 2, 3, 4)
SYSTEM: BusSystem = vehicle_on_bus(silent_prototype(), DEFAULT_NETWORK)


@pytest.fixture
def agree(bus_fmu: Path, platform: Path):  # type: ignore[no-untyped-def]
    with open_twins(bus_fmu, platform) as twins:
        yield twins.agree


def cycles(torques: tuple[int, int, int, int], count: int) -> list[Stimulus]:
    commands = [command(node, ENABLE, torque) for node, torque in zip(DRIVES, torques, strict=True)]
    return [stimulus for _ in range(count) for stimulus in (*commands, Wait(CYCLE), SYNC)]


def test_every_object_reads_alike_but_the_eds_of_the_device(agree) -> None:  # type: ignore[no-untyped-def]
    asked = [
        read(node.node_id, row.index, row.subindex)
        for node in SYSTEM.nodes
        for row in SYSTEM.devices[node.device].objects
        if row.index not in OF_THE_FMU
    ]
    answers = agree([*asked, read(1, 0x1234), read(1, 0x1018, 9), read(1, 0x6040, 1), read(6, 0x6040)])
    assert len(answers) == len(asked) + 4


def test_texts_go_in_segments(agree) -> None:  # type: ignore[no-untyped-def]
    segments = [Data(0x601, bytes((0x60 | toggle,)) + bytes(7)) for toggle in (0x00, 0x10, 0x00)]
    answers = agree([read(1, 0x1008), *segments, *segments])
    text = b"".join(data[1:] for _, _, data in answers[1:4]).rstrip(b"\x00")
    assert text == b"quasiomni wheel drive"


def test_a_number_may_be_written_in_segments(agree) -> None:  # type: ignore[no-untyped-def]
    begin = Data(0x601, struct.pack("<BHBI", 0x21, 0x1017, 0, 2))
    answers = agree([begin, Data(0x601, b"\x0b\x64\x00" + bytes(5)), Wait(0.35), read(1, 0x1017)])
    assert [can_id for _, can_id, _ in answers].count(0x701) == 4


@pytest.mark.parametrize("frame", [b"\x11" + bytes(7), b"\x00\x01" + bytes(6), b"\x0f" + bytes(7), b"\x60" + bytes(7)])
def test_wrong_segments_end_a_transfer(agree, frame: bytes) -> None:  # type: ignore[no-untyped-def]
    begin = Data(0x601, struct.pack("<BHBI", 0x21, 0x1017, 0, 2))
    assert agree([begin, Data(0x601, frame), Data(0x601, frame)])[-1][2][0] in (0x80, 0x20)


def test_a_client_that_falls_silent_is_told_after_a_second(agree) -> None:  # type: ignore[no-untyped-def]
    assert agree([read(1, 0x1008), Wait(1.5)])[-1] == (1.0, 0x581, bytes.fromhex("8008100000000405"))


def test_nmt_states_and_resets(agree) -> None:  # type: ignore[no-untyped-def]
    commands = (START, STOP, PRE_OPERATIONAL, START, RESET_COMMUNICATION, START, RESET_NODE, STOP)
    stimuli: list[Stimulus] = [write(2, 0x1017, 0, 50, 2)]
    for one in commands:
        stimuli += [nmt(one, 2), read(2, 0x1001), Wait(0.12), Remote(0x702), Remote(0x703)]
    assert agree([*stimuli, nmt(0x55), nmt(START, 9), Data(0, b"\x01")])


def test_the_vehicle_is_driven(agree) -> None:  # type: ignore[no-untyped-def]
    """Bit by bit the same: power stage, current loop, resolution, and the vehicle under them."""
    stimuli = [
        *to_operation_enabled(DRIVES),
        *cycles((300, 300, -300, -300), 250),
        *cycles((400, -300, 200, -100), 250),
    ]
    answers = agree(stimuli)
    positions = [struct.unpack("<Hhi", data)[2] for _, can_id, data in answers if can_id == 0x181]
    assert abs(positions[-1] - positions[0]) > 100_000


@pytest.mark.parametrize("option", range(9))
def test_a_quick_stop_in_motion(agree, option: int) -> None:  # type: ignore[no-untyped-def]
    stop = [command(node, QUICK_STOP) for node in DRIVES]
    after: list[Stimulus] = [stimulus for _ in range(400) for stimulus in (Wait(CYCLE), SYNC)]
    again = [command(node, ENABLE) for node in DRIVES]
    agree(
        [
            *(write(node, 0x605A, 0, option, 2) for node in DRIVES),
            *to_operation_enabled(DRIVES),
            *cycles((600, 600, -600, -600), 200),
            *stop,
            *after,
            *again,
            *after[:20],
        ]
    )


@pytest.mark.parametrize("word", [SHUTDOWN, SWITCH_ON, DISABLE_VOLTAGE])
@pytest.mark.parametrize("option", [0, 1])
def test_leaving_operation_in_motion(agree, word: int, option: int) -> None:  # type: ignore[no-untyped-def]
    options = [write(node, index, 0, option, 2) for node in DRIVES for index in (0x605B, 0x605C)]
    after: list[Stimulus] = [stimulus for _ in range(100) for stimulus in (Wait(CYCLE), SYNC)]
    leave = [command(node, word) for node in DRIVES]
    agree([*options, *to_operation_enabled(DRIVES), *cycles((600, 600, -600, -600), 100), *leave, *after])


@pytest.mark.parametrize("abort", range(4))
@pytest.mark.parametrize("reaction", range(5))
def test_a_master_that_dies(agree, abort: int, reaction: int) -> None:  # type: ignore[no-untyped-def]
    watch = [write(node, 0x1016, 1, 0x7F << 16 | 50, 4) for node in DRIVES]
    options = [
        write(node, index, 0, value, 2) for node in DRIVES for index, value in ((0x6007, abort), (0x605E, reaction))
    ]
    reset = [command(node, FAULT_RESET) for node in DRIVES]
    driven = [*to_operation_enabled(DRIVES), heartbeat(), *cycles((500, 500, -500, -500), 20)]
    back: list[Stimulus] = [nmt(START), heartbeat(), *reset, SYNC, Wait(0.01), SYNC]
    answers = agree([*watch, *options, *driven, Wait(0.6), *back])
    assert any(can_id == 0x081 for _, can_id, _ in answers)


def test_more_than_a_motor_can_do_for_long(agree) -> None:  # type: ignore[no-untyped-def]
    """Peak torque against each other, wheels held: over-current or a blocked motor, told by EMCY."""
    answers = agree([*to_operation_enabled(DRIVES), *cycles((3000, -3000, -3000, 3000), 900)])
    assert any(can_id == 0x081 and data[:2] != b"\x00\x00" for _, can_id, data in answers)


def test_event_driven_pdos_inhibit_times_and_event_timers(agree) -> None:  # type: ignore[no-untyped-def]
    timed = [
        *mapped(5, 0x1800, (0x60040020,), transmission=255),
        write(5, 0x6200, 0, 20, 2),
        write(1, 0x1801, 1, 0x80000281, 4),
        write(1, 0x1801, 3, 50, 2),
        write(1, 0x1801, 2, 254, 1),
        write(1, 0x1801, 5, 30, 2),
        write(1, 0x1801, 1, 0x281, 4),
    ]
    assert len(agree([*timed, *to_operation_enabled(DRIVES), *cycles((300, 300, -300, -300), 60), Wait(0.2)])) > 60


def test_numbered_syncs_windows_and_lengths(agree) -> None:  # type: ignore[no-untyped-def]
    numbered = [write(node, 0x1019, 0, 10, 1) for node in range(1, 7)]
    counted: list[Stimulus] = [
        stimulus for k in range(25) for stimulus in (Wait(CYCLE), Data(0x080, bytes((k % 10 + 1,))))
    ]
    agree([*numbered, *to_operation_enabled(DRIVES), *counted, SYNC, Data(0x080, b"\x01\x02"), *counted[:4]])


def test_a_node_makes_the_syncs_and_others_follow(agree) -> None:  # type: ignore[no-untyped-def]
    producing = [write(1, 0x1006, 0, 5000, 4), write(1, 0x1005, 0, 0x40000080, 4)]
    answers = agree([*to_operation_enabled(DRIVES), *producing, Wait(0.1)])
    assert [can_id for _, can_id, _ in answers].count(0x080) == 20


def test_nodes_watch_each_others_heartbeats(agree) -> None:  # type: ignore[no-untyped-def]
    stimuli = [write(1, 0x1016, 2, 2 << 16 | 60, 4), write(2, 0x1017, 0, 40, 2), nmt(START), Wait(0.2)]
    assert any(can_id == 0x081 for _, can_id, _ in agree([*stimuli, write(2, 0x1017, 0, 0, 2), Wait(0.2)]))


def test_wrong_lengths_and_missing_pdos(agree) -> None:  # type: ignore[no-untyped-def]
    late = [write(1, 0x1400, 5, 20, 2)]
    wrong: list[Stimulus] = [Data(0x201, bytes(3)), Data(0x201, bytes(8)), command(1, ENABLE), Wait(0.05)]
    agree([*late, *to_operation_enabled(DRIVES), *wrong, command(1, ENABLE), SYNC, Wait(0.001)])


def test_encoders_scale_turn_round_and_take_a_preset(agree) -> None:  # type: ignore[no-untyped-def]
    scaled = [write(5, 0x6001, 0, 3600, 4), write(5, 0x6002, 0, 3600, 4), write(5, 0x6003, 0, 900, 4)]
    ask: list[Stimulus] = [read(5, 0x6004), read(5, 0x6030, 1), read(5, 0x6509)]
    turned = [write(5, 0x6000, 0, 5, 2), *ask, write(5, 0x6000, 0, 0, 2), *ask, write(5, 0x6000, 0, 2, 2)]
    agree([*scaled, *ask, *turned, *to_operation_enabled(DRIVES), *cycles((500, -500, -500, 500), 100), *ask])


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(stimuli=sequences(SYSTEM, 60))
def test_whatever_a_master_does(bus_fmu: Path, platform: Path, stimuli: list[Stimulus]) -> None:
    with open_twins(bus_fmu, platform) as twins:
        twins.agree(stimuli)


@pytest.mark.slow
@settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck))
@given(stimuli=sequences(SYSTEM, 200), seed=st.just(0))
def test_whatever_a_master_does_for_long(bus_fmu: Path, platform: Path, stimuli: list[Stimulus], seed: int) -> None:
    with open_twins(bus_fmu, platform) as twins:
        twins.agree(stimuli)
