"""Sentences about simulated time, each of which can be true and false."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import can
import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import load_network
from hil.testing import (
    Condition,
    Expect,
    World,
    all_drives,
    at_rest,
    drive,
    emergency,
    frame,
    heartbeat_state,
    moving,
    travelled,
)
from ident.errors import UserError


@pytest.fixture
def world() -> Iterator[World]:
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle) as bench:
        yield World(bench, vehicle, load_network())


@pytest.fixture
def master(world: World) -> Master:
    master = Master(world.bus, world.clock, world.network)
    master.boot()
    world.every_cycle(lambda: master.exchange((0.5,) * 4) if master._enabled else master._exchange((0.0,) * 4))
    return master


def after(world: World, instant: float) -> Condition:
    return Condition("time to come", lambda *_: world.now >= instant - 1e-12, lambda *_: "it has not")


def test_within_waits_just_as_long_as_it_takes(world: World) -> None:
    assert Expect(world)(after(world, 0.25)).within(1.0) == pytest.approx(0.25, abs=1e-9)
    assert world.now == pytest.approx(0.25, abs=1e-9)


def test_within_fails_when_the_time_is_over_and_not_before(world: World) -> None:
    with pytest.raises(AssertionError, match=r"time to come within 0.3 s; at t = 0.300 s, 0.300 s later, it has not"):
        Expect(world)(after(world, 0.4)).within(0.3)


def test_throughout_and_never_look_at_the_whole_span(world: World) -> None:
    Expect(world)(after(world, 0.2)).never_within(0.1)
    with pytest.raises(AssertionError, match="never time to come"):
        Expect(world)(after(world, 0.2)).never_within(0.15)
    Expect(world)(after(world, 0.2)).throughout(0.1)
    with pytest.raises(AssertionError, match="throughout"):
        Expect(world)(after(world, 5.0)).throughout(0.1)


def test_frames_count_from_the_instant_of_the_expectation_on(world: World) -> None:
    expect = Expect(world)
    request = can.Message(arbitration_id=0x601, data=bytes.fromhex("4000100000000000"), is_extended_id=False)
    world.bus.send(request)
    expect(frame(0x581, "43 00 10 00 92 01")).now()
    expect(frame(0x581, "43 ?? ?? 00 92")).now()
    with pytest.raises(AssertionError, match="the last one held 43 00 10"):
        expect(frame(0x581, "60")).now()
    world.run(0.01)
    with pytest.raises(AssertionError, match="none of the 0 frames"):
        expect(frame(0x581)).within(0.01)


def test_emergencies_and_heartbeats_are_read_from_the_bus(world: World, master: Master) -> None:
    expect = Expect(world)
    expect(heartbeat_state("encoder_left", "operational")).within(0.2)
    with pytest.raises(AssertionError, match="it said operational"):
        expect(heartbeat_state("encoder_left", "stopped")).within(0.2)
    with pytest.raises(AssertionError, match="it sent none"):
        expect(emergency("drive_fl")).within(0.01)
    world.faults.add("trip@drive_fl:code=0x4310")
    expect(emergency("drive_fl")).now()
    expect(emergency("drive_fl", 0x4310)).now()


def test_states_of_drives_are_those_of_the_drives_themselves(world: World, master: Master) -> None:
    expect = Expect(world)
    expect(all_drives("switch on disabled")).now()
    with pytest.raises(AssertionError, match="drive_fl is switch on disabled"):
        expect(drive("drive_fl", "operation enabled")).within(0.01)
    master.enable()
    expect(all_drives("operation enabled")).now()


def test_motion_is_that_of_the_chassis(world: World, master: Master) -> None:
    expect = Expect(world)
    expect(at_rest()).now()
    master.enable()
    took = expect(moving(faster_than=0.1)).within(3.0)
    assert took == pytest.approx(expect(moving(faster_than=0.2)).within(3.0), rel=0.5)
    expect(travelled(0.05)).within(2.0)
    with pytest.raises(AssertionError, match="it moves at"):
        expect(at_rest()).now()


def test_a_step_that_lets_no_time_pass_is_named_instead_of_a_hang(world: World) -> None:
    world.every_cycle(lambda: None)
    with pytest.raises(UserError, match="no simulated time"):
        world.run(1.0)


@pytest.mark.parametrize("wrong", [lambda: drive("drive_fl", "happy"), lambda: heartbeat_state("drive_fl", "happy")])
def test_states_that_do_not_exist_are_refused_at_once(wrong) -> None:
    with pytest.raises(UserError, match="happy"):
        wrong()


def test_samples_follow_the_vehicle_every_ten_milliseconds(world: World, master: Master) -> None:
    master.enable()
    world.run(1.0)
    times = [sample.time for sample in world.samples]
    steps = [later - earlier for earlier, later in pairwise(times)]
    assert max(steps[5:]) == pytest.approx(0.01, abs=0.0021)
    assert world.samples[-1].speed == pytest.approx(world.speed(), abs=0.02)


def test_what_comes_true_within_a_step_that_takes_long_is_dated_and_not_missed(world: World, master: Master) -> None:
    """A controller that stops a vehicle in one call: the wheels come to rest long before the call returns."""

    def long_step() -> None:
        for _ in range(250):
            master._exchange((0.0,) * 4)

    world.every_cycle(long_step)
    begin = world.now
    took = Expect(world)(after(world, begin + 0.2)).within(0.3)
    assert took == pytest.approx(0.2, abs=0.015)
    assert world.now - begin == pytest.approx(0.5, abs=0.01)
    with pytest.raises(AssertionError):
        Expect(world)(after(world, world.now + 0.4)).within(0.3)
