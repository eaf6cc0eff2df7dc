"""The whole way: master, bus, firmware, drives, physics and back."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import can
import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.master import Master, Sample
from hil.network import load_network


def drive(network_file: Path, torques: tuple[float, ...], cycles: int, seed: int) -> tuple[list[Sample], str, tuple]:
    """Samples, a digest of all frames, and the vehicle's true pose at the end."""
    digest = hashlib.sha256()

    def tap(message: can.Message) -> None:
        digest.update(repr((message.timestamp, message.arbitration_id, bytes(message.data))).encode())

    name = "prototype" if network_file.stem == "network" else network_file.stem
    with (
        EmulatedVehicle(load_prototype(name), seed=seed) as vehicle,
        LockstepBench(vehicle, network_file) as bench,
        Master(bench.bus, bench.clock, load_network(network_file), tap) as master,
    ):
        master.boot()
        master.enable()
        samples = [master.exchange(torques) for _ in range(cycles)]
        pose = vehicle.ground_truth().pose
    return samples, digest.hexdigest(), pose


def test_forward_torque_drives_the_vehicle_forward_as_far_as_its_wheels_roll(network_file: Path) -> None:
    samples, _, (x, y, heading) = drive(network_file, (0.5,) * 4, 500, seed=1)
    radius = load_prototype("prototype" if network_file.stem == "network" else "compact").geometry.wheel_radius
    rolled = [after - before for before, after in zip(samples[0].wheel_angles, samples[-1].wheel_angles, strict=True)]
    assert all(angle * radius == pytest.approx(x, rel=0.01) for angle in rolled)
    assert x > 0.02
    assert abs(y) < 0.002
    assert abs(heading) < 0.002


def test_torque_against_each_other_on_one_side_steers_that_side_only(network_file: Path) -> None:
    """Steering torque is -s a/r i_G u: backward front and forward rear wheel turn the left front wheel left."""
    samples, _, (x, _, _) = drive(network_file, (-1.0, 1.0, 0.0, 0.0), 250, seed=1)
    left, right = samples[-1].steering_angles
    assert left > math.radians(2)
    assert abs(right) < math.radians(0.2)
    assert abs(x) < 0.002


def test_one_seed_one_sequence_of_frames(network_file: Path) -> None:
    runs = [drive(network_file, (0.3, 0.4, 0.5, 0.6), 100, seed=seed)[1] for seed in (7, 7, 8)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]
