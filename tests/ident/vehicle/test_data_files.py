from __future__ import annotations

import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from ident.errors import DataFileError
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS, read_parameters

SHIPPED = (Path(str(resources.files("ident.vehicle"))) / "data" / "prototype.toml").read_text(encoding="utf-8")
WHEELBASE = 'wheelbase = { value = 1.2, unit = "m", source = "assumed: the paper prints no geometry" }'


def file_with(folder: Path, old: str, new: str) -> Path:
    assert old in SHIPPED
    path = folder / "vehicle.toml"
    path.write_text(SHIPPED.replace(old, new, 1), encoding="utf-8")
    return path


def test_a_shipped_vehicle_can_be_what_it_says(vehicle: VehicleDescription) -> None:
    assert vehicle.prior.values.shape == vehicle.prior.std.shape == (len(PARAMETER_NAMES),)
    assert np.all(vehicle.prior.values > 0)
    assert np.all(vehicle.prior.std > 0), "a guess without uncertainty is no guess"
    geometry, limits = vehicle.geometry, vehicle.limits
    assert geometry.steering_limit > math.pi / 2, "lateral motion must be reachable"
    assert limits.peak_torque > limits.rated_torque
    assert limits.floor_length > geometry.footprint[0]
    # The motors can make the wheels slip or at least break away: rated torque beats the friction guessed.
    assert limits.rated_torque * geometry.gear_ratio > vehicle.prior["d_cw"]


def test_the_shipped_vehicles_differ_where_it_matters() -> None:
    prototype, compact = load_vehicle("prototype").geometry, load_vehicle("compact").geometry
    assert prototype.lever_ratio > 1.1
    assert compact.lever_ratio < 0.9


def test_a_vehicle_file_of_the_user_is_read_by_its_path(tmp_path: Path) -> None:
    path = file_with(tmp_path, WHEELBASE, WHEELBASE.replace("1.2", "1.3"))
    assert load_vehicle(path).geometry.wheelbase == 1.3


@pytest.mark.parametrize(
    ("old", "new", "named", "remedy"),
    [
        (WHEELBASE, "", "geometry.wheelbase is missing", "unit"),
        (WHEELBASE, "wheelbase = 1.2", "geometry.wheelbase is missing or incomplete", "source"),
        (WHEELBASE, WHEELBASE.replace('"m"', '"mm"'), "'mm'", "'m'"),
        (WHEELBASE, WHEELBASE.replace("1.2", "nan"), "geometry.wheelbase is not a finite number", "value"),
        (WHEELBASE, WHEELBASE.replace("1.2", "inf"), "geometry.wheelbase is not a finite number", "value"),
        (WHEELBASE, WHEELBASE.replace("1.2", '"long"'), "geometry.wheelbase is not a finite number", "value"),
        (WHEELBASE, WHEELBASE.replace("1.2", "true"), "geometry.wheelbase is not a finite number", "value"),
        (WHEELBASE, WHEELBASE + "\nwheelbse = 1", "geometry.wheelbse is not known", "wheelbase"),
        (WHEELBASE, WHEELBASE.replace("1.2", "-1.2"), "geometry.wheelbase = -1.2", "positive"),
        (WHEELBASE, WHEELBASE.replace("1.2", "0.15"), "wheel_radius = 0.1", "units"),
        ("wheel_offset = { value = 0.12", "wheel_offset = { value = 120", "wheel_offset = 120", "units"),
        ("wheel_offset = { value = 0.12", "wheel_offset = { value = 0", "wheel_offset = 0", "positive"),
        ("wheel_radius = { value = 0.10", "wheel_radius = { value = 100", "wheel_radius = 100", "units"),
        ("steering_limit = { value = 1.62", "steering_limit = { value = 0.5", "steering_limit = 0.5", "rad"),
        ("steering_limit = { value = 1.62", "steering_limit = { value = 92.8", "steering_limit = 92.8", "rad"),
        ("std = 80.0", "std = -80.0", "prior.m_ch", "std"),
        ("m_ch = { value = 800.0", "m_ch = { value = -800.0", "prior.m_ch = -800", "positive"),
        ("B_w = { value = 0.12", "B_w = { value = 0.0", "prior.B_w = 0", "positive"),
        ("d_vw = { value = 0.6", "d_vw = { value = -0.6", "prior.d_vw = -0.6", "negative"),
        ('unit = "kg", std = 80.0', 'unit = "t", std = 80.0', "prior.m_ch is given in 't'", "'kg'"),
        ("[prior]", "[guesses]", "no table [prior]", "[prior]"),
        ("[limits]", "[limit]", "no table [limits]", "[limits]"),
        ("peak_torque = { value = 3.8", "peak_torque = { value = 0.8", "peak_torque = 0.8", "data sheet"),
        ("floor_friction = { value = 0.6", "floor_friction = { value = 0", "floor_friction = 0", "positive"),
        ("[geometry]", "[geometry", "not valid TOML", "that place"),
    ],
)
def test_what_cannot_be_is_refused_by_name_and_with_a_remedy(
    tmp_path: Path, old: str, new: str, named: str, remedy: str
) -> None:
    path = file_with(tmp_path, old, new)
    with pytest.raises(DataFileError) as caught:
        load_vehicle(path)
    assert named in caught.value.what
    assert str(path) in caught.value.what
    assert remedy in caught.value.remedy


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match="does not exist"):
        load_vehicle(tmp_path / "none.toml")


def test_an_unknown_name_lists_what_is_shipped() -> None:
    with pytest.raises(DataFileError) as caught:
        load_vehicle("prototipe")
    assert "compact, prototype" in caught.value.remedy


def test_identified_parameters_carry_more_than_is_read(tmp_path: Path) -> None:
    """A file of results has intervals beside value and std; they are no reason to refuse it."""
    entries = "\n".join(
        f'[parameters.{name}]\nvalue = {index}.5\nunit = "{unit}"\nstd = 0.1\nci95 = [0.0, 1.0]\nsource = "run"'
        for index, (name, unit) in enumerate(PARAMETER_UNITS.items())
    )
    path = tmp_path / "parameters.toml"
    path.write_text(entries)
    parameters = read_parameters(path, "parameters")
    np.testing.assert_array_equal(parameters.values, np.arange(11) + 0.5)
    assert parameters.std_of("m_ch") == 0.1


def test_replacing_a_parameter_leaves_the_original_alone(vehicle: VehicleDescription) -> None:
    before = vehicle.prior["m_ch"]
    assert vehicle.prior.replaced(m_ch=1.0)["m_ch"] == 1.0
    assert vehicle.prior["m_ch"] == before
