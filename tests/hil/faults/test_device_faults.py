"""What faults do to nodes, sensors and ground, seen from the bus."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.firmware.flywheels import Flywheels
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.faults import FaultKind
from hil.faults.fault import SPECIFICATIONS, FaultError, Target
from hil.master import Master
from hil.network import load_network
from ident.errors import BusError


def test_a_node_without_supply_is_silent_and_boots_when_it_is_back(sight) -> None:
    sight.write(1, 0x1017, 0, 10, 2)
    sight.wait(0.1)
    sight.bench.faults.add("power@drive_fl:to=0.5s")
    sight.frames.clear()
    sight.wait(0.499)
    sight.send(0x601, bytes.fromhex("4000100000000000"))
    assert {frame.arbitration_id for frame in sight.frames} == {0x601}
    sight.frames.clear()
    sight.wait(0.1)
    # Boot-up once, and then nothing: 1017h is zero again after the reset.
    assert [(frame.arbitration_id, bytes(frame.data)) for frame in sight.frames] == [(0x701, b"\x00")]
    assert sight.read(1, 0x1017) == 0


def test_a_drive_without_supply_carries_no_torque(network) -> None:
    wheels = Flywheels()
    with LockstepBench(wheels) as bench:
        master = Master(bench.bus, bench.clock, network)
        master.boot()
        master.enable()
        for _ in range(10):
            master.exchange((0.5,) * 4)
        bench.faults.add("power@drive_rl")
        assert [drive.enabled for drive in wheels.drives] == [True, False, True, True]
        assert wheels.drives[1].torque == 0.0


def test_the_emergency_stop_takes_all_power_and_keeps_it_until_it_is_released(network) -> None:
    wheels = Flywheels()
    with LockstepBench(wheels) as bench:
        emergencies: list[bytes] = []
        bench.listen(lambda frame: emergencies.append(bytes(frame.data[:3])) if frame.arbitration_id == 0x081 else None)
        master = Master(bench.bus, bench.clock, network)
        master.boot()
        master.enable()
        for _ in range(10):
            master.exchange((0.5,) * 4)
        pressed = bench.faults.add("estop")
        assert [drive.enabled for drive in wheels.drives] == [False] * 4
        assert emergencies == [b"\x00\x90\x01"]
        with pytest.raises(BusError):
            master.enable()
        assert [drive.enabled for drive in wheels.drives] == [False] * 4
        # Not even a reset of the nodes gives the power back.
        master.boot()
        with pytest.raises(BusError):
            master.enable()
        bench.faults.remove(pressed)
        assert [drive.enabled for drive in wheels.drives] == [False] * 4
        master.boot()
        master.enable()
        assert [drive.enabled for drive in wheels.drives] == [True] * 4


def test_a_node_that_is_bus_off_leaves_error_frames_and_comes_back_with_emergency_8140(sight) -> None:
    sight.bench.faults.add("bus_off@encoder_left:to=0.2s")
    assert sum(frame.is_error_frame for frame in sight.frames) == 256 // 8
    sight.frames.clear()
    sight.wait(0.1)
    sight.send(0x605, bytes.fromhex("4000100000000000"))
    assert {frame.arbitration_id for frame in sight.frames} == {0x605}
    sight.frames.clear()
    sight.wait(0.15)
    assert b"\x40\x81" in [data[:2] for data in sight.seen(0x085)]
    assert sight.read(5, 0x1000) == 0x00010196


def test_error_frames_count_in_the_load_of_the_bus(sight) -> None:
    sight.bench.faults.add("bus_off@drive_fr")
    assert sight.bench.load.errors == 32


def test_a_babbling_node_sends_at_its_rate_until_it_is_stopped(sight) -> None:
    number = sight.bench.faults.add("babble@0x001:rate=500/s,length=4")
    sight.wait(0.999)
    assert sight.seen(0x001) == [bytes(4)] * 500
    sight.bench.faults.remove(number)
    sight.wait(1.0)
    assert sight.seen(0x001) == []


def test_lost_heartbeats_leave_all_other_frames(sight) -> None:
    sight.write(1, 0x1017, 0, 10, 2)
    sight.wait(0.05)
    sight.bench.faults.add("heartbeat@drive_fl")
    sight.frames.clear()
    sight.wait(0.5)
    assert sight.seen(0x701) == []
    assert sight.read(1, 0x1000) == 0x00020192


def test_the_loss_of_the_masters_heartbeat_is_found_by_the_nodes(sight) -> None:
    sight.write(1, 0x1016, 1, 0x7F << 16 | 50, 4)
    sight.send(0x77F, b"\x05")
    sight.wait(0.04)
    sight.send(0x77F, b"\x05")
    sight.bench.faults.add("heartbeat@master")
    sight.frames.clear()
    sight.wait(0.04)
    sight.send(0x77F, b"\x05")
    sight.wait(0.04)
    assert [data[:2] for data in sight.seen(0x081)] == [b"\x30\x81"]


def test_a_drive_trips_with_the_code_that_was_asked_for(sight) -> None:
    sight.send(0x000, b"\x01\x00")
    sight.frames.clear()
    sight.bench.faults.add("trip@drive_rr:code=0x3210")
    assert [data[:2] for data in sight.seen(0x084)] == [b"\x10\x32"]
    assert sight.read(4, 0x603F) & 0xFFFF == 0x3210
    assert sight.read(4, 0x6041) & 0x4F == 0x08


def test_a_trip_in_fault_is_told_and_one_without_supply_is_found_at_boot(sight) -> None:
    sight.bench.faults.add("trip@drive_rr:code=0x3210")
    sight.frames.clear()
    sight.bench.faults.add("trip@drive_rr:code=0x2310")
    assert [data[:2] for data in sight.seen(0x084)] == [b"\x10\x23"]
    sight.frames.clear()
    sight.bench.faults.add("power@drive_fl:to=0.2s")
    sight.bench.faults.add("trip@drive_fl:code=0x7305")
    assert sight.seen(0x081) == []
    sight.wait(0.3)
    assert [data[:2] for data in sight.seen(0x081)] == [b"\x05\x73"]
    assert sight.read(1, 0x6041) & 0x4F == 0x08


def test_a_stuck_encoder_stays_and_then_shows_where_the_shaft_has_got_to(sight) -> None:
    drive = sight.bench.vehicle.drives[0]
    drive.speed, drive.friction = 2 * math.pi, 1e-12
    sight.wait(0.1)
    number = sight.bench.faults.add("stuck@drive_fl")
    first = sight.read(1, 0x6064)
    sight.wait(1.0)
    assert sight.read(1, 0x6064) == first
    assert sight.read(1, 0x606C) == 0
    sight.bench.faults.remove(number)
    assert sight.read(1, 0x6064) - first == pytest.approx(drive.counts_per_revolution, rel=1e-3)


def test_a_jump_shifts_the_count_as_long_as_it_lasts(sight) -> None:
    before = sight.read(5, 0x6004)
    number = sight.bench.faults.add("jump@encoder_left:counts=-70000")
    # 17 bits of one turn: 65536 - 70000 wraps around.
    assert sight.read(5, 0x6004) == (before - 70000) % 131072
    sight.bench.faults.remove(number)
    assert sight.read(5, 0x6004) == before


def test_on_slippery_ground_a_wheel_brings_no_more_force_than_friction_allows() -> None:
    """Newton: a = 4 wheels at mu m g / 4 each, however hard the motors turn."""
    prototype, friction = load_prototype(), 0.02
    with (
        EmulatedVehicle(prototype, seed=1, noise_scale=0.0) as vehicle,
        LockstepBench(vehicle, ground=vehicle) as bench,
    ):
        master = Master(bench.bus, bench.clock, load_network())
        master.boot()
        master.enable()
        number = bench.faults.add(f"friction@floor:value={friction}")
        for _ in range(250):
            master.exchange((1.27,) * 4)
        on_ice = vehicle.ground_truth().twist[0]
        assert on_ice / 0.5 == pytest.approx(friction * 9.80665, rel=0.05)
        bench.faults.remove(number)
        spinning = vehicle.ground_truth().wheel_rates[0] * prototype.geometry.wheel_radius
        assert spinning > 1.5 * on_ice


def test_ground_under_one_wheel_is_that_wheels_alone() -> None:
    with (
        EmulatedVehicle(load_prototype(), seed=1, noise_scale=0.0) as vehicle,
        LockstepBench(vehicle, ground=vehicle) as bench,
    ):
        master = Master(bench.bus, bench.clock, load_network())
        master.boot()
        master.enable()
        bench.faults.add("friction@wheel_rr:value=0")
        for _ in range(250):
            master.exchange((1.0,) * 4)
        rates = vehicle.ground_truth().wheel_rates
    assert rates[3] > 2 * max(rates[:3])


@given(instant=st.floats(0.0, 0.02), lost=st.integers(0, 11))
@settings(max_examples=12, deadline=None)
def test_at_whatever_moment_the_master_dies_every_drive_lets_go(instant: float, lost: int) -> None:
    """In any cycle, and within a cycle after any of its frames: some drives may have a command that others lack."""
    wheels, network = Flywheels(), load_network()
    with LockstepBench(wheels, seed=lost) as bench:
        seen: set[int] = set()
        bench.listen(lambda frame: seen.add(frame.arbitration_id))
        master = Master(bench.bus, bench.clock, network)
        master.boot()
        master.enable()
        for _ in range(20):
            master.exchange((0.3,) * 4)
        bench.faults.add(f"drop@0x201-0x204:count={max(lost, 1)}")
        bench.faults.add(f"death:from={instant}")
        with pytest.raises(BusError):
            drive_on(master)
        seen.clear()
        bench.clock.wait_until(bench.clock.now() + 3.0)
        assert not any(drive.enabled for drive in wheels.drives)
        assert {drive.torque for drive in wheels.drives} == {0.0}
    assert {0x080 + node.node_id for node in network.drives} <= seen


def drive_on(master: Master) -> None:
    for _ in range(200):
        master.exchange((0.3,) * 4)


PLACES = {
    Target.FRAMES: ["0x181", "0x180-0x1ff", "drive_fl", "node3", "master", "all"],
    Target.IDENTIFIER: ["0x001"],
    Target.SENDER: ["encoder_right", "master"],
    Target.NODE: ["drive_rr", "encoder_left", "node2"],
    Target.DRIVE: ["drive_fl", "node4"],
    Target.MASTER: ["master"],
    Target.VEHICLE: ["vehicle"],
    Target.GROUND: ["floor", "wheel_fl"],
}


class Dry:
    def wet(self, wheel: int, coefficient: float) -> None: ...

    def dry(self, wheel: int) -> None: ...


@pytest.mark.parametrize(
    ("kind", "place"), [(kind, place) for kind, one in SPECIFICATIONS.items() for place in PLACES[one.target]]
)
def test_every_fault_can_be_injected_at_each_of_its_places_and_ended_again(kind: FaultKind, place: str) -> None:
    with LockstepBench(Flywheels(), ground=Dry()) as bench:
        bench.faults.add(f"{kind}@{place}:from=10ms,to=50ms")
        bench.clock.wait_until(0.03)
        assert len(bench.faults.pending) == 1
        bench.clock.wait_until(0.1)
        assert bench.faults.pending == []


@pytest.mark.parametrize(
    "text",
    [
        "drop@0x800",
        "drop@nobody",
        "power@master",
        "trip@encoder_left",
        "death@drive_fl",
        "friction@wheel",
        "babble@all",
    ],
)
def test_a_place_that_a_fault_cannot_befall_is_refused_when_it_is_injected(text: str) -> None:
    with LockstepBench(Flywheels(), ground=Dry()) as bench, pytest.raises(FaultError):
        bench.faults.add(f"{text}:from=1s")


def test_wheels_that_stand_on_no_ground_cannot_slip(sight) -> None:
    with pytest.raises(FaultError, match="no ground"):
        sight.bench.faults.add("friction@floor")
