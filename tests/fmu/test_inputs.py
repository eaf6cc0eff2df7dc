"""Inputs as people drive them: ramps over a step, values between internal steps, bounds, limits of the drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.vehicle.geometry import WHEELS
from tests.fmu.test_behaviour import Vehicle

Array = NDArray[np.float64]
Build = Callable[[FmiVersion, Inputs], Path]
Open = Callable[..., Vehicle]

LONG, SHORT, STOP = 0.05, 0.0005, 2.0
TORQUES = tuple(f"torque_{wheel}" for wheel in WHEELS)
WATCHED = ("pose_x", "pose_y", "gamma", "alpha_l", "alpha_r")


def wanted(time: float) -> list[float]:
    """Smooth torques [Nm], twice there and back, that drive and steer."""
    drive, steer = 1.5 * math.sin(2 * math.pi * time), 0.9 * math.sin(3 * math.pi * time)
    return [drive - steer, drive + steer, drive + steer, drive - 0.8 * steer]


@pytest.fixture
def opened() -> Iterator[Open]:
    vehicles: list[Vehicle] = []

    def open_one(path: Path, **settings: Any) -> Vehicle:
        vehicles.append(Vehicle(path, "CoSimulation", **settings))
        return vehicles[-1]

    yield open_one
    for vehicle in vehicles:
        vehicle.instance.freeInstance()


def write(vehicle: Vehicle, values: list[float]) -> None:
    setter = vehicle.instance.setFloat64 if vehicle.is_new else vehicle.instance.setReal
    setter([vehicle.references[name] for name in TORQUES], values)


def write_rates(vehicle: Vehicle, rates: list[float], order: int = 1) -> None:
    vehicle.instance.setRealInputDerivatives([vehicle.references[name] for name in TORQUES], [order] * 4, rates)


def travel(vehicle: Vehicle, interval: float, *, ramps: bool) -> Array:
    """Watched values every LONG [s] (N, 5)."""
    rows, per_row = [], round(LONG / interval)
    for cycle in range(round(STOP / interval)):
        now, later = wanted(cycle * interval), wanted((cycle + 1) * interval)
        write(vehicle, now)
        if ramps:
            write_rates(vehicle, [(end - start) / interval for start, end in zip(now, later, strict=True)])
        vehicle.instance.doStep(cycle * interval, interval)
        if (cycle + 1) % per_row == 0:
            rows.append(vehicle.read(*WATCHED))
    return np.array(rows)


@pytest.fixture(scope="module")
def truth(build: Build) -> Array:
    """The same drive with ramps of half a millisecond."""
    vehicle = Vehicle(build(FmiVersion.FMI2, Inputs.TORQUE), "CoSimulation").begin()
    rows = travel(vehicle, SHORT, ramps=True)
    vehicle.instance.freeInstance()
    return rows


def part_missed(rows: Array, truth: Array) -> float:
    """Largest error of positions and of angles, over the largest motion of each."""
    errors, motions = np.abs(rows - truth).max(axis=0), np.ptp(truth, axis=0)
    return float(max(errors[kind].max() / motions[kind].max() for kind in (slice(0, 2), slice(2, 5))))


def test_ramps_are_right_to_the_second_order_of_the_step(build: Build, opened: Open, truth: Array) -> None:
    """Half the step, a quarter of the error; at 10 ms less of it than of inputs held for 2 ms."""
    path = build(FmiVersion.FMI2, Inputs.TORQUE)
    held = part_missed(travel(opened(path).begin(), LONG, ramps=False), truth)
    steps = (LONG, LONG / 2, LONG / 5)
    long, half, fifth = (part_missed(travel(opened(path).begin(), step, ramps=True), truth) for step in steps)
    assert long < held / 2
    assert long / half == pytest.approx(4.0, rel=0.1)
    assert fifth < part_missed(travel(opened(path).begin(), 2e-3, ramps=False), truth)


def test_inputs_given_between_internal_steps_make_long_steps_as_right_as_short_ones(
    build: Build, opened: Open, truth: Array
) -> None:
    vehicles: list[Vehicle] = []

    def update(_: Any, time: float, set_requested: bool, *__: Any) -> None:
        assert set_requested
        write(vehicles[0], wanted(time))

    path = build(FmiVersion.FMI3, Inputs.TORQUE)
    vehicles.append(opened(path, intermediate_update=update).begin())
    short = part_missed(travel(opened(path).begin(), 2e-3, ramps=False), truth)
    assert part_missed(travel(vehicles[0], LONG, ramps=False), truth) < 1.1 * short


def test_only_inputs_can_be_set_between_internal_steps(build: Build, opened: Open) -> None:
    vehicles: list[Vehicle] = []
    said: list[str] = []

    def update(*_: Any) -> None:
        vehicle = vehicles[0]
        said.append(vehicle.refused(lambda: vehicle.write("m_ch", 500.0)))
        said.append(vehicle.refused(vehicle.instance.terminate))
        assert vehicle.read("torque_fl") == [0.0]

    vehicles.append(opened(build(FmiVersion.FMI3, Inputs.TORQUE), intermediate_update=update).begin())
    vehicles[0].instance.doStep(0.0, 1e-3)
    assert "m_ch cannot be set in the present mode" in said[0]
    assert "in intermediate update" in said[1]
    vehicles[0].write("m_ch", 500.0)


def test_a_ramp_is_for_one_step_and_its_end_stays(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI2, Inputs.TORQUE)).begin()
    write(vehicle, [0.0] * 4)
    write_rates(vehicle, [10.0, 20.0, 0.0, -10.0])
    vehicle.instance.doStep(0.0, 0.01)
    expected = pytest.approx([0.1, 0.2, 0.0, -0.1], abs=1e-12)
    assert vehicle.read(*TORQUES) == expected
    vehicle.instance.doStep(0.01, 0.01)
    assert vehicle.read(*TORQUES) == expected


def test_ramps_that_cannot_be_are_refused_by_name_and_none_is_taken(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI2, Inputs.TORQUE)).begin()
    references, instance = vehicle.references, vehicle.instance
    for rate in (math.nan, math.inf):
        assert "torque_rr" in vehicle.refused(lambda rate=rate: write_rates(vehicle, [1.0, 1.0, 1.0, rate]))
    assert "order 1" in vehicle.refused(lambda: write_rates(vehicle, [1.0] * 4, order=2))
    for name in ("m_ch", "pose_x", "mode"):
        said = vehicle.refused(lambda name=name: instance.setRealInputDerivatives([references[name]], [1], [1.0]))
        assert name in said
    instance.doStep(0.0, 0.01)
    assert vehicle.read(*TORQUES) == [0.0] * 4


def test_a_ramp_out_of_the_bounds_of_an_input_refuses_the_step_and_changes_nothing(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI2, Inputs.TORQUE)).begin(payload=1.0)
    vehicle.instance.setRealInputDerivatives([vehicle.references["payload"]], [1], [-1000.0])
    assert "payload is out of its bounds" in vehicle.refused(lambda: vehicle.instance.doStep(0.0, 0.1))
    assert vehicle.read("payload", "time") == [1.0, 0.0]


def rows_of(path: Path) -> dict[str, dict[str, str]]:
    folder = Path(fmpy.extract(str(path)))
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    rows = (row for row in root.iter() if row.get("causality") == "input")
    return {str(row.get("name")): {**row.attrib, **(row[0].attrib if len(row) else {})} for row in rows}


def test_inputs_say_for_what_they_are_meant(variant: Path, source: ModelSource) -> None:
    limits, geometry = source.vehicle.limits, source.vehicle.geometry
    largest = {"torque": limits.peak_torque, "speed": limits.motor_speed / geometry.gear_ratio}
    rows = rows_of(variant)
    for name, row in rows.items():
        assert float(row["nominal"]) > 0
        if name.startswith(tuple(largest)):
            size = largest[name.partition("_")[0]]
            assert (float(row["min"]), float(row["max"])) == (-size, size)
            assert float(row["nominal"]) < size
    assert float(rows["payload"]["min"]) == 0.0
    assert float(rows["slope_x"]["max"]) == math.pi / 2


def test_torques_beyond_their_bounds_are_taken_as_they_are(build: Build, opened: Open) -> None:
    vehicle = opened(build(FmiVersion.FMI2, Inputs.TORQUE)).begin()
    write(vehicle, [100.0] * 4)
    assert vehicle.read("drive_torque_fl") == [100.0]


def test_on_request_they_are_limited_to_what_the_motors_can(source: ModelSource, opened: Open, tmp_path: Path) -> None:
    path, peak = tmp_path / "limited.fmu", source.vehicle.limits.peak_torque
    order = Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),), limited=True)
    path.write_bytes(build_fmu(source, order, find_compiler()))
    limited, exact = opened(path).begin(), opened(path).begin()
    write(limited, [100.0, -100.0, 0.99 * peak, 0.0])
    write(exact, [peak, -peak, 0.99 * peak, 0.0])
    assert limited.read("drive_torque_fl", "drive_torque_rl", "drive_torque_fr") == [peak, -peak, 0.99 * peak]
    for vehicle in (limited, exact):
        vehicle.instance.doStep(0.0, 0.1)
    assert limited.read(*WATCHED) == exact.read(*WATCHED)
    limited.write("drive_torque_limit", 1.0)
    assert limited.read("drive_torque_fl") == [1.0]
