"""The master on a bench: commissioning, cyclic exchange in vehicle signs, supervision, and an orderly end."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from emulator.power_stage import Trip
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.master.drive_states import TO_OPERATION_ENABLED, decode_state
from hil.master.errors import (
    ConfigurationError,
    DriveStateError,
    IdentityError,
    MissingNodeError,
    ModeError,
    NodeLostError,
    UnitsError,
)
from hil.network import Network, load_network
from hil.network.cia import DriveState
from ident.errors import BusError, RecordError

STILL = (0.0, 0.0, 0.0, 0.0)
INERTIA = FRICTION = 1e-3


def shaft_angle(torque: float, duration: float) -> float:
    """Angle of a flywheel from rest under constant torque, its friction included [rad]."""
    rate = FRICTION / INERTIA
    return torque / FRICTION * (duration - (1 - math.exp(-rate * duration)) / rate)


def drive(master: Master, cycles: int, torque: float = 0.0) -> None:
    for _ in range(cycles):
        master.exchange((torque,) * 4)


def enabled(bench: LockstepBench, network: Network) -> Master:
    master = Master(bench.bus, bench.clock, network)
    master.boot()
    master.enable()
    return master


def test_all_drives_are_enabled_after_boot_and_enable(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    assert master.drive_states == (DriveState.OPERATION_ENABLED,) * 4
    assert all(drive.enabled for drive in flywheels.drives)


def test_positive_torque_rolls_every_wheel_forward_by_newtons_law(network_file: Path) -> None:
    """Whatever the mounting, the gear and the PDO layout: one network file, one meaning."""
    network, vehicle = load_network(network_file), Flywheels()
    torques = (0.1, 0.2, -0.3, 0.4)
    with LockstepBench(vehicle, network_file) as bench:
        master = enabled(bench, network)
        start = master.exchange(torques)
        for _ in range(100):
            sample = master.exchange(torques)
    for wheel, node in enumerate(network.drives):
        rounded = round(torques[wheel] / abs(node.torque_unit)) * abs(node.torque_unit)
        turned = sample.wheel_angles[wheel] - start.wheel_angles[wheel]
        expected = shaft_angle(rounded, 0.2) / node.quantities["gear_ratio"].value
        assert turned == pytest.approx(expected, abs=2 * abs(node.angle_unit))
        assert sample.motor_torques[wheel] == pytest.approx(rounded)
        assert math.copysign(1.0, vehicle.drives[wheel].angle * torques[wheel]) == node.rotation
    assert sample.time - start.time == pytest.approx(0.2)


def test_steering_angles_are_measured_from_the_zero_of_the_network_file(network_file: Path) -> None:
    network, vehicle = load_network(network_file), Flywheels()
    vehicle.encoders[0].counts = 65536 + 131072 // 8
    vehicle.encoders[1].counts = 65536 - 131072 // 12
    with LockstepBench(vehicle, network_file) as bench:
        sample = enabled(bench, network).exchange(STILL)
    left, right = network.encoders
    assert sample.steering_angles[0] == pytest.approx(left.rotation * math.pi / 4)
    assert sample.steering_angles[1] == pytest.approx(-right.rotation * math.pi / 6, abs=1e-4)


def test_a_command_acts_from_the_sync_that_follows_it(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    master.exchange((0.127, 0.0, 0.0, 0.0))
    assert flywheels.drives[0].torque == pytest.approx(0.127)
    assert flywheels.drives[0].angle == 0.0
    master.exchange(STILL)
    assert flywheels.drives[0].angle == pytest.approx(shaft_angle(0.127, 0.002), rel=1e-9)


def test_wheel_angles_go_on_when_the_32_bit_counter_wraps(bench, network, flywheels) -> None:
    flywheels.drives[0].angle = 2 * math.pi * (2**31 - 20_000) / 1048576
    flywheels.drives[2].angle = -2 * math.pi * (2**31 - 20_000) / 1048576
    flywheels.drives[0].speed, flywheels.drives[2].speed = 30.0, -30.0
    master = enabled(bench, network)
    angles = [master.exchange(STILL).wheel_angles for _ in range(50)]
    for wheel in (0, 2):
        steps = [after[wheel] - before[wheel] for before, after in pairwise(angles)]
        assert all(step == pytest.approx(30.0 * 0.002 / 20, rel=0.2) for step in steps)


def test_torque_beyond_the_field_saturates_instead_of_turning_round(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    master.exchange((1000.0, -1000.0, 1000.0, -1000.0))
    # 6072h limits to 300 %.
    assert [round(drive.torque / 1.27, 3) for drive in flywheels.drives] == [3.0, -3.0, -3.0, 3.0]


def test_an_orderly_end_ramps_the_torque_down_and_leaves_no_power_on(bench, network, flywheels) -> None:
    seen: list[float] = []
    with Master(bench.bus, bench.clock, network) as master:
        master.boot()
        master.enable()
        for _ in range(10):
            master.exchange((1.0,) * 4)
        advance = flywheels.advance

        def watched(duration: float) -> None:
            seen.append(flywheels.drives[0].torque)
            advance(duration)

        flywheels.advance = watched
    assert not any(drive.enabled for drive in flywheels.drives)
    falls = [before - after for before, after in pairwise(seen)]
    assert max(falls) < 0.05
    assert seen[-1] == 0.0


def test_nodes_are_left_without_faults_when_the_master_has_gone(bench, network, flywheels) -> None:
    with enabled(bench, network):
        pass
    listener = bench.open_bus()
    bench.clock.wait_until(bench.clock.now() + 2.0)
    emergencies = []
    while (message := listener.recv(0.0)) is not None:
        if 0x81 <= message.arbitration_id <= 0xFF:
            emergencies.append(message)
    assert emergencies == []


def test_a_master_can_pause_for_long_and_go_on(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    drive(master, 50, torque=0.2)
    before = master.exchange((0.0,) * 4)
    master.shut_down()
    bench.clock.wait_until(bench.clock.now() + 30.0)
    master.boot()
    master.enable()
    after = master.exchange((0.0,) * 4)
    assert after.time - before.time == pytest.approx(30.0, abs=0.5)
    assert after.wheel_angles[0] > before.wheel_angles[0]
    assert master.overruns == 0


def test_an_error_in_the_program_stops_the_drives(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    drive(master, 1, torque=1.0)
    with pytest.raises(ZeroDivisionError), master:
        raise ZeroDivisionError
    assert not any(drive.enabled for drive in flywheels.drives)


def test_a_disk_that_is_full_stops_the_drives_all_the_same(bench, network, flywheels) -> None:
    written = 0

    def fill_the_disk(message: can.Message) -> None:
        nonlocal written
        written += 1
        if written > 1000:
            raise RecordError("full", "free some space")

    def campaign() -> None:
        with Master(bench.bus, bench.clock, network, fill_the_disk) as master:
            master.boot()
            master.enable()
            drive(master, 1000, torque=1.0)

    with pytest.raises(RecordError):
        campaign()
    assert not any(drive.enabled for drive in flywheels.drives)


def test_a_bus_that_refuses_some_frames_does_not_keep_the_drives_from_being_stopped(
    bench, network, flywheels, monkeypatch
) -> None:
    send, refused = bench.bus.send, iter([True] * 7)

    def send_when_free(message: can.Message, timeout: float | None = None) -> None:
        if next(refused, False):
            raise can.CanOperationError("transmit buffer full")
        send(message, timeout)

    master = enabled(bench, network)
    drive(master, 5, torque=1.0)
    monkeypatch.setattr(bench.bus, "send", send_when_free)
    with pytest.raises(ZeroDivisionError), master:
        raise ZeroDivisionError
    assert not any(drive.enabled for drive in flywheels.drives)


def test_a_node_that_is_lost_during_the_orderly_end_does_not_leave_the_others_under_torque(
    bench, network, flywheels
) -> None:
    master = enabled(bench, network)
    drive(master, 5, torque=1.0)
    with pytest.raises(NodeLostError, match=r"node 6"), master:
        bench.devices.nodes[6].sync_frames = list
    assert not any(drive.enabled for drive in flywheels.drives)


def test_the_others_are_stopped_before_a_faulty_drive_is_asked_for_its_error(bench, network, flywheels) -> None:
    """A drive that has lost its supply answers no SDO; its neighbours must not push on for the time-out."""
    master = enabled(bench, network)
    drive(master, 5, torque=0.5)
    flywheels.drives[1].trip(Trip.OVER_VOLTAGE)
    object_access, still_enabled = master.object_access(network.drives[1]), []
    read = object_access.read

    def silent(index: int, subindex: int = 0) -> int:
        still_enabled.append([drive.enabled for drive in flywheels.drives])
        read(index, subindex)
        raise MissingNodeError("silent", "look")

    object_access.read = silent
    with pytest.raises(DriveStateError, match=r"node 2 .*603Fh cannot be read"):
        drive(master, 3, torque=0.5)
    assert still_enabled == [[False] * 4]


def test_the_master_never_needs_more_than_five_seconds_for_a_node_that_is_not_there(rewritten_network) -> None:
    network = rewritten_network(("id = 4\n", "id = 9\n"))
    start = time.perf_counter()
    with LockstepBench(Flywheels()) as bench, pytest.raises(MissingNodeError, match=r"node 9 \(drive_rr\)"):
        Master(bench.bus, bench.clock, network).boot()
    assert bench.clock.now() == pytest.approx(network.times["boot_timeout"], rel=0.1)
    assert time.perf_counter() - start < 1.0


def test_every_missing_node_is_named_at_once(network) -> None:
    from hil.bus.lockstep import LockstepHub

    hub = LockstepHub(0.002, 1e6)
    with hub.open() as bus, pytest.raises(MissingNodeError) as caught:
        Master(bus, hub.clock, network).boot()
    for node in network.nodes:
        assert node.label in caught.value.what


WRONG = {
    "product": ("product_code = 0x402", "product_code = 0x403", IdentityError, "1018h:2"),
    "device type": ("device_type = 0x00010196", "device_type = 0x00020196", IdentityError, "1000h:0"),
    "rated torque": ("rated_torque = { value = 1.27", "rated_torque = { value = 2.39", UnitsError, "6076h"),
    "motor increments": (
        "counts_per_revolution = { value = 1048576",
        "counts_per_revolution = { value = 65536",
        UnitsError,
        "608Fh",
    ),
    "encoder units": (
        "counts_per_revolution = { value = 131072",
        "counts_per_revolution = { value = 4096",
        UnitsError,
        "6001h",
    ),
    "measuring range": (
        "measuring_range = { value = 131072",
        "measuring_range = { value = 65536",
        UnitsError,
        "6002h",
    ),
}


@pytest.mark.parametrize(("old", "new", "kind", "named"), WRONG.values(), ids=WRONG)
def test_a_device_that_is_not_the_one_described_is_named_before_anything_moves(
    bench, flywheels, rewritten_network: Callable[..., Network], old: str, new: str, kind: type[BusError], named: str
) -> None:
    network = rewritten_network((old, new))
    with pytest.raises(kind) as caught:
        Master(bench.bus, bench.clock, network).check()
    assert named in caught.value.what
    assert "node" in caught.value.what
    assert caught.value.remedy
    assert not any(drive.enabled for drive in flywheels.drives)


def test_a_drive_without_torque_mode_is_refused(bench, network, flywheels) -> None:
    nodes = bench.devices.nodes
    nodes[3].object_dictionary.on_read(0x6502, 0, lambda: 0x05)
    with pytest.raises(ModeError, match=r"node 3 \(drive_fr\)"):
        Master(bench.bus, bench.clock, network).check()


def test_a_drive_that_stays_in_another_mode_is_refused(bench, network) -> None:
    bench.devices.nodes[2].object_dictionary.on_read(0x6061, 0, lambda: 3)
    with pytest.raises(ModeError, match="6061h"):
        Master(bench.bus, bench.clock, network).boot()


def test_a_refused_configuration_names_node_object_and_abort(bench, network) -> None:
    from emulator.firmware.dictionary import AbortCode, AbortError

    def refuse(_value: int) -> None:
        raise AbortError(AbortCode.DEVICE_STATE)

    bench.devices.nodes[5].object_dictionary.on_write(0x1017, 0, refuse)
    with pytest.raises(ConfigurationError) as caught:
        Master(bench.bus, bench.clock, network).boot()
    assert "node 5" in caught.value.what
    assert "1017h" in caught.value.what
    assert "present device state" in caught.value.what


def test_a_fault_while_driving_is_reported_with_its_code(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    master.exchange((0.5,) * 4)
    flywheels.drives[1].trip(Trip.OVER_CURRENT)
    with pytest.raises(DriveStateError) as caught:
        drive(master, 3, torque=0.5)
    assert "node 2 (drive_rl)" in caught.value.what
    assert "2310h" in caught.value.what


def test_a_fault_that_was_there_before_is_reset_on_the_way_to_operation_enabled(bench, network, flywheels) -> None:
    master = Master(bench.bus, bench.clock, network)
    master.boot()
    flywheels.drives[0].trip(Trip.OVER_CURRENT)
    master.enable()
    assert master.drive_states == (DriveState.OPERATION_ENABLED,) * 4


def test_a_drive_that_cannot_be_enabled_is_named(bench, network, flywheels) -> None:
    master = Master(bench.bus, bench.clock, network)
    master.boot()
    bench.devices.nodes[4].application.sample = lambda: flywheels.drives[3].trip(Trip.OVER_VOLTAGE)
    start = bench.clock.now()
    with pytest.raises(DriveStateError, match=r"node 4 \(drive_rr\) does not reach operation enabled"):
        master.enable()
    assert bench.clock.now() - start < 1.5


def test_a_node_that_falls_silent_is_named_within_the_time_out(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    bench.devices.nodes[6].network.send = lambda can_id, data: None
    bench.devices.nodes[6].sync_frames = list
    start = bench.clock.now()
    with pytest.raises(NodeLostError, match=r"node 6 \(encoder_right\)"):
        master.exchange(STILL)
    assert bench.clock.now() - start == pytest.approx(network.times["sample_timeout"], abs=0.003)


def test_a_node_that_somebody_stopped_is_noticed_by_its_heartbeat_or_its_silence(bench, network) -> None:
    master = enabled(bench, network)
    other = bench.open_bus()
    other.send(can.Message(arbitration_id=0, is_extended_id=False, data=b"\x80\x05"))
    with pytest.raises(NodeLostError, match=r"node 5 \(encoder_left\)"):
        drive(master, 200)


def test_a_heartbeat_that_was_on_its_way_as_the_node_was_started_is_no_node_that_left(bench, network) -> None:
    node = bench.devices.nodes[1]
    usual = node.sync_frames

    def behind_a_late_heartbeat():
        node.sync_frames = usual
        node.network.send(0x701, b"\x7f")
        return usual()

    node.sync_frames = behind_a_late_heartbeat
    master = enabled(bench, network)
    drive(master, 200)
    node.object_dictionary.write(0x1017, 0, 0, downloaded=True)
    node.network.send(0x701, b"\x7f")
    with pytest.raises(NodeLostError, match=r"node 1 \(drive_fl\) has left the NMT state operational"):
        drive(master, 200)


def test_a_node_whose_heartbeat_stops_is_noticed_though_its_tpdos_go_on(bench, network) -> None:
    master = enabled(bench, network)
    bench.devices.nodes[6].object_dictionary.write(0x1017, 0, 0, downloaded=True)
    with pytest.raises(NodeLostError, match=r"node 6 \(encoder_right\) has sent no heartbeat"):
        drive(master, 500)
    assert bench.clock.now() < 1.0


def test_drives_trip_when_the_master_dies(bench, network, flywheels) -> None:
    master = enabled(bench, network)
    for _ in range(100):
        master.exchange((0.5,) * 4)
    bench.clock.wait_until(bench.clock.now() + 1.5)
    assert not any(drive.enabled for drive in flywheels.drives)


def test_a_tpdo_of_another_length_is_named(bench, network) -> None:
    master = enabled(bench, network)
    bench.open_bus().send(can.Message(arbitration_id=0x183, is_extended_id=False, data=b"\x00"))
    # The stray frame came before the SYNC and is not taken for an answer to it ...
    master.exchange(STILL)
    # ... but one that the node itself sends is.
    node = bench.devices.nodes[3]
    node.sync_frames = lambda: [(0x183, b"\x00", node.network)]
    with pytest.raises(ConfigurationError, match=r"node 3 \(drive_fr\).*1 bytes"):
        master.exchange(STILL)


def test_two_runs_send_the_same_frames_at_the_same_times(network) -> None:
    def run() -> list[tuple[float, int, bytes, bool]]:
        frames: list[tuple[float, int, bytes, bool]] = []

        def tap(message: can.Message) -> None:
            frames.append((message.timestamp, message.arbitration_id, bytes(message.data), message.is_rx))

        with LockstepBench(Flywheels()) as bench, Master(bench.bus, bench.clock, network, tap) as master:
            master.boot()
            master.enable()
            for k in range(300):
                master.exchange([0.3 * math.sin(0.05 * k + wheel) for wheel in range(4)])
        return frames

    assert run() == run()


def test_statuswords_are_decoded_with_their_masks() -> None:
    for state in DriveState:
        mask, pattern = state.value
        for extra in range(0, 65536, 97):
            word = pattern | extra & ~mask
            assert decode_state(word) is state
    assert decode_state(0x0021 | 0x0040) is None
    assert set(TO_OPERATION_ENABLED) == set(DriveState)
