"""What faults do to frames: counted, dated and compared at the connector."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench

HEARTBEAT = 0x701
"""Heartbeats of the first drive, every 10 ms, are the traffic in most of these tests."""


@pytest.fixture
def beating(sight):
    sight.write(1, 0x1017, 0, 10, 2)
    sight.wait(0.05)
    sight.frames.clear()
    return sight


def test_dropped_frames_do_not_arrive_and_the_others_do(beating) -> None:
    beating.bench.faults.add("drop@0x701")
    beating.write(2, 0x1017, 0, 10, 2)
    beating.wait(1.0)
    assert len([frame for frame in beating.frames if frame.arbitration_id == 0x702]) > 90
    assert beating.seen(HEARTBEAT) == []


def test_a_fault_begins_and_ends_at_its_instants(beating) -> None:
    begin = beating.bench.clock.now()
    beating.bench.faults.add("drop@0x701:from=0.205s,to=0.405s")
    beating.wait(1.0)
    stamps = [frame.timestamp - begin for frame in beating.frames if frame.arbitration_id == HEARTBEAT]
    assert not [stamp for stamp in stamps if 0.206 < stamp < 0.405]
    gap = max(after - before for before, after in itertools.pairwise(stamps))
    assert gap == pytest.approx(0.21, abs=1e-3)


@given(rate=st.floats(0.05, 0.95), seed=st.integers(0, 2**31))
@settings(max_examples=6, deadline=None)
def test_the_share_that_is_dropped_is_the_rate_within_five_standard_deviations(rate: float, seed: int) -> None:
    with LockstepBench(Flywheels(), seed=seed) as bench:
        bench.faults.add(f"drop@0x701:rate={rate}")
        arrived = 0

        def count(message) -> None:
            nonlocal arrived
            arrived += message.arbitration_id == HEARTBEAT

        bench.listen(count)
        bench.devices.nodes[1].object_dictionary.write(0x1017, 0, 1)
        bench.clock.wait_until(2.0)
    expected, deviation = 2000 * (1 - rate), math.sqrt(2000 * rate * (1 - rate))
    assert abs(arrived - expected) < 5 * deviation + 2


def test_late_frames_are_late_by_what_was_asked_for(beating) -> None:
    begin = beating.bench.clock.now()
    beating.wait(0.1)
    before = [frame.timestamp for frame in beating.frames]
    beating.frames.clear()
    beating.bench.faults.add("delay@0x701:time=3ms")
    beating.wait(0.1)
    after = [frame.timestamp for frame in beating.frames]
    assert begin < before[0]
    phases = {round(stamp % 0.01, 5) for stamp in before}
    assert {round((stamp - 0.003) % 0.01, 5) for stamp in after} == phases


def test_jitter_spreads_the_delay_over_its_whole_range(beating) -> None:
    beating.wait(0.1)
    phase = beating.frames[-1].timestamp % 0.01
    beating.frames.clear()
    beating.bench.faults.add("delay@0x701:time=1ms,jitter=4ms")
    beating.wait(4.0)
    delays = [(frame.timestamp - phase) % 0.01 for frame in beating.frames]
    assert 0.001 - 1e-6 <= min(delays) < 0.0012
    assert 0.0048 < max(delays) <= 0.005 + 1e-6


def test_doubled_frames_come_so_many_times(beating) -> None:
    beating.bench.faults.add("duplicate@0x701:copies=2")
    beating.wait(0.1)
    assert len(beating.seen(HEARTBEAT)) == 30


@pytest.mark.parametrize("bits", [1, 3, 8])
def test_corrupted_frames_differ_in_so_many_bits(beating, bits: int) -> None:
    beating.bench.faults.add(f"corrupt@0x701:bits={bits}")
    beating.wait(0.5)
    differences = [(data[0] ^ 0x7F).bit_count() for data in beating.seen(HEARTBEAT)]
    assert set(differences) == {bits}


def test_overtaken_frames_come_after_the_next_ones(sight) -> None:
    sight.bench.faults.add("reorder@0x601-0x606:count=1")
    sight.write(1, 0x1017, 0, 10, 2)
    assert sight.seen(0x581) == []
    sight.write(2, 0x1017, 0, 10, 2)
    answers = [frame.arbitration_id for frame in sight.frames if frame.arbitration_id in (0x581, 0x582)]
    assert answers == [0x582, 0x581]


def test_what_is_still_held_back_goes_out_when_the_fault_ends(sight) -> None:
    number = sight.bench.faults.add("reorder@0x601")
    sight.write(1, 0x1017, 0, 10, 2)
    assert sight.seen(0x581) == []
    sight.bench.faults.remove(number)
    assert len(sight.seen(0x581)) == 1


def test_a_short_pdo_is_answered_by_an_emergency(sight) -> None:
    sight.send(0x000, b"\x01\x01")
    sight.frames.clear()
    sight.bench.faults.add("length@0x201:bytes=-1,count=1")
    sight.send(0x201, b"\x06\x00\x00\x00")
    sight.send(0x080)
    assert [data[:2] for data in sight.seen(0x081)] == [b"\x10\x82"]


def test_a_count_limits_how_often(beating) -> None:
    beating.bench.faults.add("drop@0x701:count=3")
    beating.wait(0.1)
    assert len(beating.seen(HEARTBEAT)) == 7


def test_faults_of_a_node_befall_what_it_sends_and_nothing_else(sight) -> None:
    sight.bench.faults.add("drop@drive_rl")
    sight.write(2, 0x1017, 0, 10, 2)
    sight.write(1, 0x1017, 0, 10, 2)
    sight.wait(0.1)
    senders = {frame.arbitration_id for frame in sight.frames}
    assert senders & {0x582, 0x702} == set()
    assert {0x581, 0x701} <= senders


def test_when_the_master_is_dead_nothing_of_it_arrives(sight) -> None:
    sight.bench.faults.add("death")
    sight.write(1, 0x1017, 0, 10, 2)
    sight.wait(0.1)
    assert {frame.arbitration_id for frame in sight.frames} == {0x601}


def test_two_faults_act_one_after_the_other(beating) -> None:
    beating.bench.faults.add("duplicate@0x701")
    beating.bench.faults.add("length@0x701:bytes=1")
    beating.wait(0.1)
    frames = beating.seen(HEARTBEAT)
    assert len(frames) == 20
    assert set(frames) == {b"\x7f\x00"}


def test_another_fault_beside_it_changes_nothing_about_a_random_one() -> None:
    def arrivals(*others: str) -> list[float]:
        with LockstepBench(Flywheels(), seed=9) as bench:
            stamps: list[float] = []
            bench.listen(lambda message: stamps.append(message.timestamp) if message.arbitration_id == 0x701 else None)
            bench.faults.add("drop@0x701:rate=50%")
            for other in others:
                bench.faults.add(other)
            bench.devices.nodes[1].object_dictionary.write(0x1017, 0, 5)
            bench.devices.nodes[2].object_dictionary.write(0x1017, 0, 7)
            bench.clock.wait_until(1.0)
        return [round(stamp, 3) for stamp in stamps]

    assert arrivals() == arrivals("drop@0x702:rate=50%", "corrupt@0x702:rate=30%")
