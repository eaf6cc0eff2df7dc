"""The vehicle as the firmware and the bench see it: time, stand and floor, seeds, noise."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.engine.choice import ENGINES
from emulator.engine.display import require_display
from emulator.engine.protocol import MakeEngine
from emulator.noise import Disturbances
from emulator.prototype import Prototype, load_prototype
from emulator.vehicle import EmulatedVehicle
from ident.errors import UserError
from ident.extras import EngineName


@pytest.fixture
def vehicle(make_engine: MakeEngine) -> Iterator[EmulatedVehicle]:
    with EmulatedVehicle(load_prototype(), seed=11, noise_scale=0.0, make_engine=make_engine) as vehicle:
        yield vehicle


def command_wheels(vehicle: EmulatedVehicle, prototype: Prototype, torques: list[float]) -> None:
    """Motor torques that roll the wheels forward [Nm], whatever the mounting."""
    for drive, torque, direction in zip(vehicle.drives, torques, prototype.drive.directions, strict=True):
        drive.enable()
        drive.command(direction * torque)


@pytest.mark.parametrize("name", ["prototype", "compact"])
def test_a_lifted_wheel_spins_up_as_b_w_and_its_friction_say(name: str, make_engine: MakeEngine) -> None:
    """B_w w' + d_vw w = i_G u - d_cw from rest, solved in closed form."""
    prototype = load_prototype(name)
    p, torque, duration = prototype.truth, 0.5, 0.4
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0, make_engine=make_engine) as vehicle:
        vehicle.lift()
        command_wheels(vehicle, prototype, [torque] * 4)
        vehicle.advance(3e-3)
        start = vehicle.drives[0].velocity() / prototype.geometry.gear_ratio
        vehicle.advance(duration)
        final = (prototype.geometry.gear_ratio * torque - p["d_cw"]) / p["d_vw"]
        rate = abs(final) + (abs(start) - abs(final)) * math.exp(-p["d_vw"] / p["B_w"] * duration)
        for drive in vehicle.drives:
            assert drive.velocity() == pytest.approx(
                math.copysign(rate * prototype.geometry.gear_ratio, drive.velocity()), rel=1e-4
            )


def test_lowering_puts_the_vehicle_at_rest_with_its_wheels_as_they_were(vehicle: EmulatedVehicle) -> None:
    vehicle.lift()
    command_wheels(vehicle, load_prototype(), [0.5, 0.4, 0.3, 0.25])
    vehicle.advance(0.3)
    before = vehicle.ground_truth()
    assert min(before.wheel_rates) > 1.0
    vehicle.lower()
    after = vehicle.ground_truth()
    assert after.time == before.time
    assert after.wheel_angles == pytest.approx(before.wheel_angles, abs=1e-6)
    assert after.steering_angles == pytest.approx(before.steering_angles, abs=1e-6)
    assert np.abs([*after.twist, *after.wheel_rates, *after.steering_rates]).max() < 1e-6


def test_at_rest_without_torque_the_vehicle_stays_where_it_is(vehicle: EmulatedVehicle) -> None:
    before = vehicle.ground_truth()
    counts = [drive.position() for drive in vehicle.drives]
    vehicle.advance(5.0)
    after = vehicle.ground_truth()
    assert math.dist(before.pose[:2], after.pose[:2]) < 1e-6
    assert [drive.position() for drive in vehicle.drives] == pytest.approx(counts, abs=2)


def test_the_load_fluctuation_alone_moves_nothing() -> None:
    with EmulatedVehicle(load_prototype(), seed=11) as vehicle:
        before = vehicle.ground_truth()
        vehicle.advance(5.0)
        after = vehicle.ground_truth()
    assert math.dist(before.pose[:2], after.pose[:2]) < 1e-5
    assert after.steering_angles == pytest.approx(before.steering_angles, abs=1e-5)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(1e-4, 7e-3), min_size=1, max_size=20))
def test_time_passes_in_whole_steps_and_no_remainder_is_lost(durations: list[float]) -> None:
    with EmulatedVehicle(load_prototype(), seed=0, noise_scale=0.0) as vehicle:
        for duration in durations:
            vehicle.advance(duration)
        assert -1e-8 < sum(durations) - vehicle.time < 1e-3 + 1e-8
        assert vehicle.time / 1e-3 == pytest.approx(round(vehicle.time / 1e-3), abs=1e-9)


def test_a_cycle_is_exactly_two_steps_a_thousand_times(vehicle: EmulatedVehicle) -> None:
    for _ in range(1000):
        vehicle.advance(0.002)
    assert vehicle.time == pytest.approx(2.0, abs=1e-12)


def run_of(seed: int, noise_scale: float = 1.0) -> list[object]:
    """Everything the bus could carry, and the truth, along a short drive with steering."""
    prototype = load_prototype()
    seen: list[object] = []
    with EmulatedVehicle(prototype, seed=seed, noise_scale=noise_scale) as vehicle:
        for cycle in range(150):
            swing = 0.6 * math.sin(cycle * 0.05)
            command_wheels(vehicle, prototype, [0.5 - swing, 0.5 + swing, 0.5, 0.5])
            vehicle.advance(0.002)
            seen.append([(d.position(), d.measured_torque(), d.velocity()) for d in vehicle.drives])
            seen.append([encoder.position() for encoder in vehicle.encoders])
        seen.append(vehicle.ground_truth())
    return seen


def test_two_runs_with_one_seed_are_bit_identical() -> None:
    assert run_of(4) == run_of(4)


IN_ANOTHER_PROCESS = """
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
with EmulatedVehicle(load_prototype(), seed=4) as vehicle:
    for drive, torque in zip(vehicle.drives, (0.2, 1.0, -0.5, -0.5)):
        drive.enable()
        drive.command(torque)
    vehicle.advance(0.5)
    print(repr(vehicle.ground_truth()), [d.position() for d in vehicle.drives])
"""


def test_processes_with_one_seed_agree_to_the_last_bit() -> None:
    outputs = {
        subprocess.run(
            [sys.executable, "-c", IN_ANOTHER_PROCESS],
            env={**os.environ, "PYTHONHASHSEED": str(hash_seed)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split("GroundTruth")[1]
        for hash_seed in (1, 2, 3)
    }
    assert len(outputs) == 1


def test_another_seed_is_another_run() -> None:
    assert run_of(4) != run_of(5)


def test_without_noise_the_seed_does_not_matter() -> None:
    assert run_of(4, noise_scale=0.0) == run_of(5, noise_scale=0.0)


def rows(prototype: Prototype, seed: int, scale: float, count: int) -> dict[str, np.ndarray]:
    disturbances = Disturbances(prototype, seed=seed, scale=scale, step=1e-3)
    names = ("torque_reading", "motor_dither", "steering_dither", "load")
    seen: dict[str, list[list[float]]] = {name: [] for name in names}
    for _ in range(count):
        for name in names:
            seen[name].append(getattr(disturbances, name))
        disturbances.advance()
    return {name: np.array(values) for name, values in seen.items()}


def test_load_fluctuation_is_as_large_and_as_slow_as_stated() -> None:
    prototype = load_prototype()
    p = prototype.truth
    load = rows(prototype, 2, 1.0, 200_000)["load"]
    steering = np.array([p["d_cl"], p["d_cl"], p["d_cr"], p["d_cr"]]) / 2
    expected = prototype.noise.load_fluctuation * np.concatenate([steering, [p["d_cw"]] * 4])
    assert load.std(axis=0) == pytest.approx(expected, rel=0.08)
    assert np.abs(load.mean(axis=0) / expected).max() < 0.15
    lag = 100
    for column in load.T:
        assert np.corrcoef(column[:-lag], column[lag:])[0, 1] == pytest.approx(math.exp(-1), abs=0.06)


def test_the_load_on_a_steering_side_splits_onto_units_that_turn_against_each_other() -> None:
    load = rows(load_prototype(), 2, 1.0, 50)["load"]
    assert load[:, 0] == pytest.approx(-load[:, 1])
    assert load[:, 2] == pytest.approx(-load[:, 3])
    assert not np.allclose(load[:, 0], load[:, 2])


def test_the_size_of_one_source_does_not_shift_another() -> None:
    prototype = load_prototype()
    quiet = replace(prototype, noise=replace(prototype.noise, torque_sensor=0.0))
    first, second = rows(prototype, 9, 1.0, 3000), rows(quiet, 9, 1.0, 3000)
    assert not np.any(second["torque_reading"])
    for name in ("motor_dither", "steering_dither", "load"):
        assert np.array_equal(first[name], second[name])


def test_noise_scales_in_proportion() -> None:
    prototype = load_prototype()
    one, half = rows(prototype, 9, 1.0, 100), rows(prototype, 9, 0.5, 100)
    for name, values in one.items():
        assert half[name] == pytest.approx(values / 2)


def test_a_window_without_a_display_is_refused_with_the_remedy() -> None:
    with pytest.raises(UserError) as caught:
        require_display({})
    assert "--gui" in caught.value.remedy


@pytest.mark.bench
def test_a_bus_cycle_costs_little_more_than_two_bare_engine_steps() -> None:
    pybullet = pytest.importorskip("pybullet", reason="the bare step that is compared with is PyBullet's")
    prototype = load_prototype()
    ratios = []
    with EmulatedVehicle(prototype, seed=0, make_engine=ENGINES[EngineName.PYBULLET]) as vehicle:
        command_wheels(vehicle, prototype, [0.3] * 4)
        vehicle.advance(0.2)
        for _ in range(7):
            start = perf_counter()
            for _ in range(200):
                vehicle.advance(0.002)
            middle = perf_counter()
            for _ in range(400):
                pybullet.stepSimulation(vehicle.engine.client)
            ratios.append((middle - start) / (perf_counter() - middle))
    assert min(ratios) < 1.6
