"""On the lockstep bus the SYNC moves time, and waiting costs simulated, not real, seconds."""

from __future__ import annotations

import time
from itertools import pairwise

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.bus.lockstep import LockstepHub


def sync() -> can.Message:
    return can.Message(arbitration_id=0x80, is_extended_id=False)


def frame(can_id: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=can_id, is_extended_id=False, data=data)


def test_each_sync_but_the_first_moves_time_by_one_cycle_period(bench: LockstepBench, flywheels: Flywheels) -> None:
    for k in range(10):
        bench.bus.send(sync())
        assert bench.clock.now() == pytest.approx(0.002 * k, abs=1e-12)
        assert flywheels.time == pytest.approx(0.002 * k, abs=1e-12)


def test_a_master_that_moves_the_clock_itself_does_not_move_it_twice(bench: LockstepBench) -> None:
    bench.bus.send(sync())
    bench.clock.wait_until(0.002)
    bench.bus.send(sync())
    assert bench.clock.now() == 0.002


def test_the_grid_of_cycles_does_not_drift_in_a_hundred_thousand_cycles() -> None:
    hub = LockstepHub(cycle_period=0.002, bit_rate=1e6)
    bus = hub.open()
    message = sync()
    for _ in range(100_001):
        bus.send(message)
    assert hub.clock.now() == 200.0


def test_waiting_in_vain_costs_simulated_time_only(bench: LockstepBench) -> None:
    while bench.bus.recv(0.0) is not None:
        pass
    begin, start = bench.clock.now(), time.perf_counter()
    assert bench.bus.recv(60.0) is None
    assert bench.clock.now() == pytest.approx(begin + 60.0)
    assert time.perf_counter() - start < 1.0


def test_waiting_ends_at_the_frame_that_a_timer_sends(bench: LockstepBench) -> None:
    bench.bus.send(frame(0x601, bytes.fromhex("2b17100032000000")))  # 1017h = 50 ms
    while bench.bus.recv(0.0) is not None:
        pass
    begin = bench.clock.now()
    heartbeat = bench.bus.recv(10.0)
    assert heartbeat is not None
    assert heartbeat.arbitration_id == 0x701
    assert bench.clock.now() - begin <= 0.05
    assert heartbeat.timestamp == pytest.approx(0.05, abs=2e-4)


def test_waiting_for_ever_for_what_cannot_come_is_an_error_and_not_a_hang(bench: LockstepBench) -> None:
    while bench.bus.recv(0.0) is not None:
        pass
    with pytest.raises(can.CanOperationError, match="wait forever"):
        bench.bus.recv(None)


def test_stamps_lie_one_frame_length_apart_on_a_busy_bus() -> None:
    hub = LockstepHub(cycle_period=0.002, bit_rate=500e3)
    one, two = hub.open(), hub.open()
    for _ in range(3):
        one.send(frame(0x555, b"\x55" * 8))
    stamps = [message.timestamp for _ in range(3) if (message := two.recv(0.0)) is not None]
    for earlier, later in pairwise(stamps):
        assert 111 / 500e3 <= later - earlier <= 135 / 500e3


def test_a_burst_of_sdo_takes_the_time_that_the_bus_needs_for_it(bench: LockstepBench) -> None:
    for _ in range(200):
        bench.bus.send(frame(0x601, bytes.fromhex("4000100000000000")))
        while bench.bus.recv(0.0) is not None:
            pass
    least = 200 * 2 * 111e-6
    assert least - 0.002 <= bench.clock.now() <= 1.3 * least


def test_two_endpoints_hear_the_devices_and_each_other(bench: LockstepBench) -> None:
    listener = bench.open_bus()
    bench.bus.send(frame(0x601, bytes.fromhex("4000100000000000")))
    heard = [message.arbitration_id for _ in range(2) if (message := listener.recv(0.0)) is not None]
    assert heard == [0x601, 0x581]
