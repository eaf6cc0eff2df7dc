"""The FMU as the plant: forces, friction and rolling, against the formulas that the physics engines are held to."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
import fmpy.simulation
import numpy as np
import pytest

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.quantities import GRAVITY

STEP = 2e-3
CORNERS = ("fl", "rl", "fr", "rr")


@dataclass
class Plant:
    """A vehicle behind FMI 3.0, without viscous friction, driven by torques at its wheels.

    Attributes:
        vehicle: whose lengths and parameters it has.
        instance: of FMPy.
        references: value reference by name.
        time: that it has reached [s].
    """

    vehicle: VehicleDescription
    instance: Any
    references: dict[str, int]
    time: float = 0.0

    def __getitem__(self, symbol: str) -> float:
        """A parameter of the model."""
        return float(self.vehicle.prior[symbol])

    def write(self, **values: float) -> None:
        self.instance.setFloat64([self.references[name] for name in values], list(values.values()))

    def read(self, *names: str) -> list[float]:
        return list(self.instance.getFloat64([self.references[name] for name in names]))

    def run(self, wheel_torques: Sequence[float], duration: float) -> None:
        ratio = self.vehicle.geometry.gear_ratio
        self.write(
            **{f"torque_{corner}": torque / ratio for corner, torque in zip(CORNERS, wheel_torques, strict=True)}
        )
        for _ in range(round(duration / STEP)):
            self.instance.doStep(currentCommunicationPoint=self.time, communicationStepSize=STEP)
            self.time += STEP


Start = Callable[..., Plant]


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    folder = tmp_path_factory.mktemp("plants")

    @lru_cache
    def pack(name: str) -> Path:
        vehicle = load_vehicle(name)
        source = ModelSource(vehicle, vehicle.prior, (), {"run": "none"}, {"parameters.toml": b"# as described\n"})
        order = Order(FmiVersion.FMI3, Inputs.TORQUE, (host_platform(),))
        path = folder / f"{name}.fmu"
        path.write_bytes(build_fmu(source, order, find_compiler()))
        return path

    return pack


@pytest.fixture(params=["prototype", "compact"])
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def vehicle(name: str) -> VehicleDescription:
    return load_vehicle(name)


@pytest.fixture
def start(name: str, vehicle: VehicleDescription, packed: Callable[[str], Path]) -> Iterator[Start]:
    """Sets a plant up with values of its variables; at rest, without viscous friction."""
    path = packed(name)
    description = fmpy.read_model_description(str(path))
    references = {row.name: row.valueReference for row in description.modelVariables}
    instance = fmpy.simulation.instantiate_fmu(fmpy.extract(str(path)), description, "CoSimulation")

    def begin(**values: float) -> Plant:
        plant = Plant(vehicle, instance, references)
        instance.enterInitializationMode()
        plant.write(d_vl=0.0, d_vr=0.0, d_vw=0.0)
        plant.write(**values)
        instance.exitInitializationMode()
        return plant

    yield begin
    instance.freeInstance()


def test_driving_straight_balances_force_and_energy(start: Start) -> None:
    plant = start()
    r, torque = plant.vehicle.geometry.wheel_radius, 3 * plant["d_cw"]
    plant.run([torque] * 4, 1.0)
    distance, speed = plant.read("pose_x", "x_dot")
    mass, force = plant["m_ch"] + 4 * plant["B_w"] / r**2, 4 * (torque - plant["d_cw"]) / r
    assert speed == pytest.approx(force / mass, rel=2e-3)
    assert 0.5 * mass * speed**2 == pytest.approx(force * distance, rel=2e-3)


def test_turning_on_the_spot_has_the_inertia_of_chassis_units_and_wheels(
    start: Start, vehicle: VehicleDescription
) -> None:
    """C_ch + C_l + C_r, and four wheels that roll around the centre."""
    g = vehicle.geometry
    plant = start(alpha_l=-g.rotation_angle, alpha_r=g.rotation_angle)
    torque, lever = 3 * plant["d_cw"], g.rotation_lever
    plant.run([-torque, -torque, torque, torque], 0.5)
    inertia = plant["C_ch"] + plant["C_l"] + plant["C_r"] + 4 * plant["B_w"] * (lever / g.wheel_radius) ** 2
    moment = 4 * (torque - plant["d_cw"]) * lever / g.wheel_radius
    assert plant.read("gamma_dot")[0] == pytest.approx(moment / inertia * 0.5, rel=5e-3)


def test_the_distance_is_the_radius_times_the_angle(start: Start) -> None:
    plant = start()
    plant.run([2 * plant["d_cw"]] * 4, 1.0)
    (distance,) = plant.read("pose_x")
    angles = plant.read(*(f"beta_{corner}" for corner in CORNERS))
    assert distance > 0.01
    assert plant.vehicle.geometry.wheel_radius * np.array(angles) == pytest.approx([distance] * 4, rel=2e-3)


def test_wheels_roll_without_slip_on_a_curve(start: Start, vehicle: VehicleDescription) -> None:
    """Every wheel's rolling speed is the speed of its axle over the floor, along its heading."""
    g = vehicle.geometry
    curvature = 0.4
    left, right = (math.atan(g.wheelbase / 2 * curvature / (1 - s * curvature * g.track_width / 2)) for s in (1, -1))
    plant = start(alpha_l=left, alpha_r=right)
    plant.run([3 * plant["d_cw"]] * 4, 0.5)
    forward, yaw_rate = plant.read("x_dot", "gamma_dot")
    assert yaw_rate == pytest.approx(curvature * forward, rel=1e-2)
    alpha = plant.read("alpha_l", "alpha_r")
    signs = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    for (end, side), corner in zip(signs, CORNERS, strict=True):
        delta = end * alpha[0 if side > 0 else 1]
        x = end * g.wheelbase / 2 - side * g.wheel_offset * math.sin(delta)
        y = side * g.track_width / 2 + side * g.wheel_offset * math.cos(delta)
        along = (forward - yaw_rate * y) * math.cos(delta) + yaw_rate * x * math.sin(delta)
        (rate,) = plant.read(f"beta_{corner}_dot")
        assert rate * g.wheel_radius == pytest.approx(along, abs=5e-3 * forward)


def test_a_wheel_holds_under_less_than_its_coulomb_torque(start: Start) -> None:
    """Its friction is smooth: it gives way by a fraction of a millimetre, and then stands."""
    plant = start()
    plant.run([0.98 * plant["d_cw"]] * 4, 2.0)
    (settled,) = plant.read("pose_x")
    plant.run([0.98 * plant["d_cw"]] * 4, 2.0)
    assert abs(settled) < 2e-3
    assert plant.read("pose_x")[0] == pytest.approx(settled, abs=2e-5)
    plant.run([1.1 * plant["d_cw"]] * 4, 1.0)
    assert plant.read("pose_x")[0] > settled + 5e-3


@pytest.mark.parametrize(("side", "symbol"), [(0, "d_cl"), (1, "d_cr")])
def test_a_steering_side_holds_until_its_own_and_its_wheels_friction_break(
    start: Start, side: int, symbol: str
) -> None:
    """Breakaway of the wheel torques M_rear = -M_front: 2 (a/r) M = d_c + 2 (a/r) d_cw."""
    plant = start()
    rho = plant.vehicle.geometry.lever_ratio
    breakaway = (plant[symbol] + 2 * rho * plant["d_cw"]) / (2 * rho)
    signs, name = ([-1.0, 1.0, 0.0, 0.0], "alpha_l") if side == 0 else ([0.0, 0.0, 1.0, -1.0], "alpha_r")
    plant.run([0.98 * breakaway * sign for sign in signs], 2.0)
    (settled,) = plant.read(name)
    plant.run([0.98 * breakaway * sign for sign in signs], 2.0)
    assert abs(settled) < 1e-2
    assert plant.read(name)[0] == pytest.approx(settled, abs=1e-4)
    plant.run([1.1 * breakaway * sign for sign in signs], 0.5)
    assert plant.read(name)[0] > settled + 1e-2


def test_a_parked_vehicle_stays_on_a_slope_at_half_its_dry_friction(start: Start) -> None:
    plant = start()
    weight = plant["m_ch"] * GRAVITY
    plant.write(slope_x=math.asin(0.5 * 4 * plant["d_cw"] / plant.vehicle.geometry.wheel_radius / weight))
    plant.run([0.0] * 4, 3.0)
    assert abs(plant.read("pose_x")[0]) < 1e-3


def test_a_load_is_accelerated_with_the_vehicle(start: Start) -> None:
    plant = start()
    load = 0.2 * plant["m_ch"]
    plant.write(payload=load)
    r, torque = plant.vehicle.geometry.wheel_radius, 3 * plant["d_cw"]
    plant.run([torque] * 4, 1.0)
    mass = plant["m_ch"] + load + 4 * plant["B_w"] / r**2
    assert plant.read("x_dot")[0] == pytest.approx(4 * (torque - plant["d_cw"]) / r / mass, rel=2e-3)


def test_friction_that_is_higher_at_rest_holds_until_it_breaks(start: Start) -> None:
    names = [f"wheel_{corner}" for corner in CORNERS]
    plant = start(**{f"stribeck.{name}.amplitude": 2.0 for name in names})
    plant.run([plant["d_cw"] + 1.8] * 4, 1.0)
    assert abs(plant.read("pose_x")[0]) < 1e-3
    plant.run([plant["d_cw"] + 2.6] * 4, 1.0)
    assert plant.read("pose_x")[0] > 5e-3
