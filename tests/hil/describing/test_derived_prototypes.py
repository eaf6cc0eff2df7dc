"""The emulated vehicle that is derived from a description is one that there can be, and adds up to its truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from emulator.derivation import Wiring, derive_prototype
from emulator.rigid_bodies import RigidBody
from emulator.vehicle import EmulatedVehicle
from hil.bench.prototypes import load_emulated
from hil.describing import check_measures, write_description
from hil.network import network_file_of
from ident.errors import DataFileError
from ident.vehicle.description import VehicleDescription, load_vehicle

WIRING = Wiring(8192, (1, -1, 1, -1), 65536, (1000, 60000), (1, -1), 0.004)


@pytest.fixture(params=range(20, 40))
def vehicle(
    request: pytest.FixtureRequest, draw_measures: Callable[[int], dict[str, float]], tmp_path: Path
) -> VehicleDescription:
    path = tmp_path / "mine.toml"
    write_description(check_measures(draw_measures(request.param)), path)
    return load_vehicle(path)


def can_be(body: RigidBody) -> bool:
    return body.mass > 0 and min(body.inertia) > 0 and 2 * max(body.inertia) < sum(body.inertia)


def test_bodies_can_be_and_add_up_to_the_priors(vehicle: VehicleDescription) -> None:
    prototype = derive_prototype(vehicle, WIRING).prototype
    bodies, prior, geometry = prototype.rigid_bodies, vehicle.prior, vehicle.geometry
    assert all(map(can_be, (bodies.chassis, *bodies.knuckles, bodies.wheel)))
    unit = bodies.knuckles[0].mass + bodies.wheel.mass
    assert bodies.chassis.mass + 4 * unit == pytest.approx(prior["m_ch"])
    corner = (geometry.wheelbase**2 + geometry.track_width**2) / 4
    assert bodies.chassis.inertia[2] + 4 * unit * corner == pytest.approx(prior["C_ch"])
    assert bodies.wheel.inertia[1] == pytest.approx(prior["B_w"])


def test_wiring_and_motors_are_those_of_the_files(vehicle: VehicleDescription) -> None:
    prototype = derive_prototype(vehicle, WIRING).prototype
    assert prototype.drive.counts_per_revolution == 8192
    assert prototype.drive.directions == (1, -1, 1, -1)
    assert prototype.drive.interpolation_time == 0.004
    assert prototype.encoder.zero_positions == (1000, 60000)
    assert prototype.encoder.directions == (1, -1)
    assert prototype.drive.rated_torque == vehicle.limits.rated_torque
    assert prototype.drive.peak_torque == vehicle.limits.peak_torque


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"B_w": 3.0}, "B_w"),
        ({"C_ch": 0.5}, "C_ch"),
        ({"d_cw": 0.0}, "d_cw"),
    ],
)
def test_priors_that_no_body_has_are_refused(changed: dict[str, float], named: str) -> None:
    vehicle = load_vehicle()
    with pytest.raises(DataFileError, match=named):
        derive_prototype(replace(vehicle, prior=vehicle.prior.replaced(**changed)), WIRING)


def test_a_derived_vehicle_stands_with_its_wheels_straight_and_reads_its_zeros(
    draw_measures: Callable[[int], dict[str, float]], tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    network = write_description(check_measures(draw_measures(1)), path)[1]
    text = network.read_text()
    assert text.count("zero_counts = 65536") == 2
    network.write_text(text.replace("zero_counts = 65536", "zero_counts = 40000", 1))
    emulated = load_emulated(path, network_file_of(str(path)))
    with EmulatedVehicle(emulated.prototype, seed=1) as vehicle:
        assert [encoder.position() for encoder in vehicle.encoders] == pytest.approx([40000, 65536], abs=5)
        assert np.abs(vehicle.ground_truth().steering_angles).max() < 1e-3


def test_a_motor_without_overload_never_gets_too_hot() -> None:
    vehicle = load_vehicle()
    limits = replace(vehicle.limits, peak_torque=vehicle.limits.rated_torque)
    prototype = derive_prototype(replace(vehicle, limits=limits), WIRING).prototype
    with EmulatedVehicle(prototype, seed=1) as emulated:
        emulated.lift()
        drive = emulated.drives[0]
        drive.enable()
        drive.command(limits.rated_torque)
        emulated.advance(0.5)
        assert 0 < drive.thermal_load <= 1.0
