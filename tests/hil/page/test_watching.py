"""What the page is told: looks that change nothing, never wait, and say what is so."""

from __future__ import annotations

import math
import re
import socket
from collections.abc import Iterator
from dataclasses import replace
from itertools import count

import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench import emulation
from hil.bench.lockstep import LockstepBench
from hil.bench.watching import Pace
from hil.bus.bit_length import frame_bits
from hil.bus.traffic import Traffic
from hil.master import Master
from hil.network import DEFAULT_NETWORK, Network
from hil.page.channel import Channel, ClosedError, make_pair
from hil.page.emulated import Around, EmulatedView
from hil.page.opening import Address, open_page, refuse_unservable
from hil.page.plots import BusLoadMeter
from hil.page.shown import Action, Asked, BusNow, Doing, Health, Sketch, Snapshot, Told
from hil.page.watch import PERIOD, Watch
from ident.errors import UserError


class Shown:
    """A bench whose page is this test."""

    def __init__(self, vehicle: EmulatedVehicle, bench: LockstepBench, network: Network) -> None:
        ours, self.page = map(Channel, make_pair())
        self.bench = bench
        load = bench.load
        around = Around(lambda: BusNow(load.frames, (load.bits, load.bits)), lambda: Doing("straight", 1, 2))
        self.view = EmulatedView("title", vehicle, bench.devices, network, around)
        # Whenever time moves, a look is due.
        self.watch = Watch(ours, self.view, bench.faults, count(step=2 * PERIOD).__next__)
        bench.attend(self.watch.attend)

    def wait(self, duration: float) -> None:
        clock = self.bench.clock
        clock.wait_until(round(clock.now() + duration, 9))

    def snapshots(self) -> list[Snapshot]:
        return [one for one in self.page.receive() if isinstance(one, Snapshot)]

    def newest(self) -> Snapshot:
        self.wait(0.001)
        self.page.receive()
        self.wait(0.001)
        return self.snapshots()[-1]


@pytest.fixture
def network() -> Network:
    return emulation.complete_network("prototype", DEFAULT_NETWORK)


@pytest.fixture
def shown(network: Network) -> Iterator[Shown]:
    with (
        EmulatedVehicle(load_prototype(), seed=1) as vehicle,
        LockstepBench(vehicle, ground=vehicle) as bench,
    ):
        yield Shown(vehicle, bench, network)


def drive(bench: LockstepBench, network: Network, cycles: int) -> list[tuple[int, bytes]]:
    frames: list[tuple[int, bytes]] = []
    bench.listen(lambda frame: frames.append((frame.arbitration_id, bytes(frame.data))))
    with Master(bench.bus, bench.clock, network) as master:
        master.boot()
        master.enable()
        for _ in range(cycles):
            master.exchange((0.5, 0.4, -0.3, 0.2))
    return frames


def test_the_sketch_and_the_looks_say_where_the_vehicle_is_and_how_its_nodes_are(
    shown: Shown, network: Network
) -> None:
    (sketch,) = [one for one in shown.page.receive() if isinstance(one, Sketch)]
    assert [name for name, _ in sketch.drives] == ["drive_fl", "drive_rl", "drive_fr", "drive_rr"]
    assert sketch.encoders == (("encoder_left", 5), ("encoder_right", 6))
    master = Master(shown.bench.bus, shown.bench.clock, network)
    master.boot()
    master.enable()
    for _ in range(100):
        sample = master.exchange((0.5, 0.4, -0.3, 0.2))
        shown.page.receive()
    shown.wait(0.0005)
    now = shown.snapshots()[-1]
    vehicle = shown.bench.vehicle
    assert isinstance(vehicle, EmulatedVehicle)
    truth = vehicle.ground_truth()
    assert now.pose.position[:2] == pytest.approx(truth.pose[:2], abs=1e-3)
    assert now.pose.angles[4:] == pytest.approx(truth.wheel_angles, abs=1e-2)
    # What a wheel carries adds up to the weight, and the drives push with torque times ratio over radius.
    assert sum(now.pose.normal_forces) == pytest.approx(sketch.weight, rel=0.05)
    geometry = load_prototype().geometry
    forces = [one.torque * geometry.gear_ratio / geometry.wheel_radius for one in now.drives]
    assert now.pose.drive_forces == pytest.approx(forces)
    assert [drive.state for drive in now.drives] == ["operation enabled"] * 4
    assert [drive.asked for drive in now.drives] == pytest.approx((0.5, 0.4, -0.3, 0.2), abs=2e-3)
    assert [drive.torque for drive in now.drives] == pytest.approx(sample.motor_torques, abs=0.05)
    assert all(math.isnan(drive.position_error) for drive in now.drives)
    assert [one.angle for one in now.encoders] == pytest.approx(truth.steering_angles, abs=2e-4)
    assert [one.error for one in now.encoders] == pytest.approx((0.0, 0.0), abs=2e-4)
    assert now.doing == Doing("straight", 1, 2)
    assert now.bus.frames > 1000


def test_a_bench_with_a_page_sends_the_same_frames_to_the_last_bit(network: Network) -> None:
    def frames(watched: bool) -> list[tuple[int, bytes]]:
        with EmulatedVehicle(load_prototype(), seed=3) as vehicle, LockstepBench(vehicle) as bench:
            shown = Shown(vehicle, bench, network) if watched else None
            driven = drive(bench, network, 200)
            if shown is not None:
                assert shown.watch.looks > 200
            return driven

    assert frames(watched=True) == frames(watched=False)


def test_what_is_asked_on_the_page_is_done_between_two_steps_and_answered(shown: Shown) -> None:
    shown.page.send(Asked(Action.INJECT, "stuck@encoder_left"))
    shown.page.send(Asked(Action.INJECT, "stuck@encoder_middle"))
    shown.wait(0.001)
    told = [one for one in shown.page.receive() if isinstance(one, Told)]
    assert [one.refused for one in told] == [False, True]
    assert "encoder_middle" in told[1].text
    assert [fault.text for fault in shown.newest().faults] == ["stuck@encoder_left"]
    shown.page.send(Asked(Action.STOP))
    shown.page.send(Asked(Action.STOP))
    now = shown.newest()
    assert now.stopped
    assert [drive.error_code for drive in now.drives] == [0x9000] * 4
    assert sum(fault.text == "estop@vehicle" for fault in now.faults) == 1
    # Ending all faults does not release the stop by the way.
    shown.page.send(Asked(Action.END_ALL))
    now = shown.newest()
    assert [fault.text for fault in now.faults] == ["estop@vehicle"]
    shown.page.send(Asked(Action.RELEASE))
    assert not shown.newest().stopped


def test_an_encoder_that_lies_and_a_node_without_supply_are_seen(shown: Shown) -> None:
    shown.bench.faults.add("jump@encoder_right:counts=100")
    shown.bench.faults.add("power@drive_rl")
    shown.bench.faults.add("bus_off@drive_rr")
    now = shown.newest()
    assert abs(now.encoders[1].error) > 10 * abs(now.encoders[0].error)
    assert [drive.nmt for drive in now.drives] == ["pre-operational", "no supply", "pre-operational", "bus-off"]
    assert [drive.health for drive in now.drives] == [Health.IDLE, Health.BROKEN, Health.IDLE, Health.BROKEN]


def test_a_page_that_does_not_read_is_never_waited_for_and_one_that_has_gone_is_forgotten(shown: Shown) -> None:
    for _ in range(1000):
        shown.wait(0.001)
    assert shown.watch.looks >= 1000
    assert 0 < shown.watch.late < 1000
    shown.page.close()
    shown.wait(0.1)
    assert shown.watch.gone
    looks = shown.watch.looks
    shown.wait(0.1)
    assert shown.watch.looks == looks


def test_looks_are_forty_milliseconds_apart(shown: Shown) -> None:
    instants = iter([10.0, 10.01, 10.02, 10.03, 10.0401, 10.05, 10.081])
    ours, theirs = make_pair()
    watch = Watch(Channel(ours), shown.view, shown.bench.faults, lambda: next(instants))
    seen = []
    for _ in range(7):
        watch.attend()
        seen.append(watch.looks)
    theirs.close()
    assert seen == [1, 1, 1, 1, 2, 2, 3]


def test_traffic_without_and_with_all_stuff_bits_holds_the_bits_that_are_sent() -> None:
    traffic = Traffic()
    bits = 0
    for length in range(9):
        for fill in (0x00, 0x55, 0xFF):
            traffic.by_length[length] += 1
            bits += frame_bits(0x181, bytes([fill] * length))
    least, most = traffic.bits
    assert traffic.frames == 27
    assert least <= bits <= most
    assert most < 1.25 * least


def test_the_load_is_that_of_the_last_moments(shown: Shown) -> None:
    now = shown.newest()
    meter = BusLoadMeter(1000.0)
    for k in range(100):
        # 100 bits a second, then 500.
        bits = 10 * min(k, 50) + 50 * max(k - 50, 0)
        meter.take(_at(now, 0.1 * k, bits))
    assert meter.load == pytest.approx((0.5, 0.5), rel=1e-6)


def _at(now: Snapshot, instant: float, bits: int) -> Snapshot:
    return replace(now, time=instant, bus=replace(now.bus, bits=(bits, bits)))


def test_messages_pass_in_their_order_and_an_end_is_noticed() -> None:
    ours, theirs = map(Channel, make_pair())
    for number in range(3):
        assert ours.send(Told(str(number)))
    ours.close()
    assert [one.text for one in theirs.receive() if isinstance(one, Told)] == ["0", "1", "2"]
    with pytest.raises(ClosedError):
        theirs.receive()
    with pytest.raises(ClosedError):
        theirs.send(Told("nobody"))


def test_a_port_that_is_taken_and_a_foreign_address_are_refused_before_anything_is_done() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(UserError, match="is taken"):
        refuse_unservable(Address(port=taken.getsockname()[1]))
    with pytest.raises(UserError, match=re.escape("cannot be served at 192.0.2.1")):
        refuse_unservable(Address("192.0.2.1", 0))
    with pytest.raises(UserError, match=re.escape("cannot be served at no.such.host.invalid")):
        refuse_unservable(Address("no.such.host.invalid", 0))


def test_only_this_computer_is_loopback() -> None:
    assert Address().is_loopback
    assert Address("localhost").is_loopback
    assert not Address("0.0.0.0").is_loopback


def test_the_page_comes_up_by_itself_and_ends_with_its_owner() -> None:
    with open_page(Address(port=0)) as page:
        assert page.wait().startswith("http://127.0.0.1:")
        process = page._process
        assert process.poll() is None
    assert process.poll() is not None


def test_what_is_watched_passes_no_faster_than_asked_and_makes_up_for_nothing() -> None:
    wall, simulated = 0.0, 10.0

    def sleep(duration: float) -> None:
        nonlocal wall
        wall += duration

    looks: list[float] = []
    pace = Pace(lambda: simulated, 2.0, lambda: looks.append(wall), lambda: wall, sleep)
    for _ in range(100):
        simulated += 0.02
        pace.attend()
    assert wall == pytest.approx(1.0, abs=0.01)
    wall += 5.0
    pace.attend()
    begin = wall
    for _ in range(100):
        simulated += 0.02
        pace.attend()
    assert wall - begin == pytest.approx(1.0, abs=0.01)
    simulated += 2.0
    begin = len(looks)
    pace.attend()
    assert len(looks) - begin > 40, "what is asked on the page is not kept waiting by a long move of time"
