"""Tests of a vehicle controller on the emulated vehicle. Read them as documentation of the fixtures.

Run them with `pytest examples/hil_suite`; `--hil-keep all` leaves a recording and a timeline of every test.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from vehicle_controller import Mode, VehicleController

from emulator.vehicle import EmulatedVehicle
from hil.faults import FaultInjector
from hil.testing import Expect, World, all_drives, at_rest, drive, emergency, heartbeat_state, moving

pytestmark = pytest.mark.hil(seed=3)


def test_the_vehicle_comes_up_with_all_drives_enabled(controller: VehicleController, expect: Expect) -> None:
    expect(all_drives("operation enabled")).now()
    expect(heartbeat_state("encoder_left", "operational")).within(0.2)
    expect(at_rest()).throughout(0.5)


def test_it_reaches_the_speed_that_was_wished_and_keeps_its_direction(
    driving: VehicleController, vehicle: EmulatedVehicle, expect: Expect
) -> None:
    expect(moving(faster_than=0.48)).throughout(0.5)
    _, y, heading = vehicle.ground_truth().pose
    assert abs(y) < 0.01
    assert abs(heading) < 0.01


def test_it_stops_when_nobody_renews_the_wish(driving: VehicleController, bench: World, expect: Expect) -> None:
    bench.every_cycle(driving.step)
    # 0.3 s until the wish is forgotten, 1 s of ramp from 0.5 m/s at 0.5 m/s^2, and some time to settle.
    assert expect(at_rest()).within(2.5) > 1.2
    expect(all_drives("operation enabled")).now()


def test_a_drive_that_trips_stops_the_vehicle(
    driving: VehicleController, faults: FaultInjector, expect: Expect
) -> None:
    faults.add("trip@drive_rl:code=0x2310")
    expect(emergency("drive_rl", 0x2310)).within(0.01)
    expect(drive("drive_rl", "fault")).within(0.5)
    expect(at_rest()).within(3.0)
    assert driving.mode is Mode.STOPPED
    assert "drive_rl" in driving.reason


def test_a_drive_that_loses_its_supply_stops_the_vehicle(
    driving: VehicleController, faults: FaultInjector, expect: Expect, allow: Callable[..., None]
) -> None:
    allow("lost heartbeat", "unanswered SDO")
    faults.add("power@drive_fr")
    expect(at_rest()).within(3.0)
    assert driving.mode is Mode.STOPPED
    assert "drive_fr" in driving.reason


def test_after_the_supply_is_back_the_vehicle_can_be_started_again(
    driving: VehicleController, bench: World, faults: FaultInjector, expect: Expect, allow: Callable[..., None]
) -> None:
    allow("lost heartbeat", "unanswered SDO")
    faults.add("power@drive_fr:to=1s")
    expect(at_rest()).within(3.0)
    driving.start()
    expect(all_drives("operation enabled")).now()
    # Three drives have braked, one has not: the wheels have turned, and the vehicle pulls away slowly.
    expect(moving(faster_than=0.1)).within(3.0)


def test_when_the_controller_dies_the_drives_stop_the_vehicle_by_themselves(
    driving: VehicleController, faults: FaultInjector, expect: Expect, allow: Callable[..., None]
) -> None:
    allow("lost heartbeat")
    faults.add("death@master")
    # 1016h: the drives tolerate 0.25 s without a heartbeat of the master.
    expect(emergency("drive_fl", 0x8130)).within(0.26)
    expect(at_rest()).within(3.0)


def test_an_encoder_that_leaves_the_bus_stops_the_vehicle(
    driving: VehicleController, faults: FaultInjector, expect: Expect, allow: Callable[..., None]
) -> None:
    allow("lost heartbeat", "error frames", "unanswered SDO")
    faults.add("bus_off@encoder_left:to=0.5s")
    expect(emergency("encoder_left", 0x8140)).within(0.51)
    expect(at_rest()).within(3.0)
    assert "encoder_left" in driving.reason


def test_frames_that_are_late_by_less_than_a_cycle_do_no_harm(
    driving: VehicleController, faults: FaultInjector, expect: Expect
) -> None:
    faults.add("delay@0x180-0x1ff:time=0.3ms,jitter=0.2ms,rate=50%")
    expect(moving(faster_than=0.45)).throughout(1.0)
    assert driving.mode is Mode.READY


def test_on_a_slippery_floor_it_still_stops(
    driving: VehicleController, bench: World, faults: FaultInjector, expect: Expect
) -> None:
    bench.every_cycle(driving.step)
    faults.add("friction@floor:value=0.15")
    expect(at_rest()).within(4.0)


@pytest.mark.hil(delays=True)
def test_with_the_delays_of_a_real_bus_it_drives_as_well(
    driving: VehicleController, bench: World, expect: Expect
) -> None:
    expect(moving(faster_than=0.48)).throughout(0.2)
    # 11 frames of a cycle of 2 ms at 1 Mbit/s, and the SDO traffic of the start.
    assert 0.5 < bench.bench.load.mean < 0.6
