"""A number that stands in several files is the same in all of them, or the files are refused with both places named."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.bench.prototypes import load_emulated, stated_by
from hil.network import DEFAULT_NETWORK, load_network, network_file_of
from hil.network.agreement import disagreements
from hil.network.described import load_described
from ident.errors import DataFileError
from ident.vehicle.description import find_data_file, load_vehicle

VEHICLES = ("prototype", "compact")

Files = dict[str, Path]


@pytest.fixture(params=VEHICLES)
def files(request: pytest.FixtureRequest, tmp_path: Path) -> Files:
    """Copies of all files of a vehicle, to be changed."""
    name = request.param
    shutil.copy(find_data_file("ident.vehicle", name), tmp_path / "vehicle.toml")
    shutil.copy(find_data_file("emulator", name), tmp_path / "prototype.toml")
    shutil.copy(network_file_of(name), tmp_path / "network.toml")
    for eds in DEFAULT_NETWORK.parent.glob("*.eds"):
        shutil.copy(eds, tmp_path / eds.name)
    return {path.name: path for path in tmp_path.iterdir()}


@pytest.mark.parametrize("name", VEHICLES)
def test_what_ships_is_one_vehicle_each(name: str) -> None:
    network = network_file_of(name)
    emulated = load_emulated(name, network)
    assert not list(disagreements(load_vehicle(name), load_network(network), stated_by(emulated.prototype)))
    assert not emulated.assumed


@pytest.mark.parametrize("name", VEHICLES)
def test_the_two_vehicles_are_not_taken_for_each_other(name: str) -> None:
    other = next(other for other in VEHICLES if other != name)
    with pytest.raises(DataFileError, match="gear_ratio"):
        load_described(name, network_file_of(other))


def scaled(entry: str) -> Callable[[str], str]:
    """The text with the value of the first entry of that name half as large again."""

    def change(text: str) -> str:
        pattern = rf"(?m)^({entry} = {{ value = )([^,]+)"
        assert re.search(pattern, text), entry
        return re.sub(pattern, lambda found: f"{found[1]}{1.5 * float(found[2]):g}", text, count=1)

    return change


def negated(entry: str) -> Callable[[str], str]:
    """The text with a direction the other way."""

    def change(text: str) -> str:
        return re.sub(rf"(?m)^({entry} = {{ value = )(-?)", lambda one: one[1] + ("" if one[2] else "-"), text, count=1)

    return change


def default(section: str) -> Callable[[str], str]:
    """An EDS with another default of an object."""

    def change(text: str) -> str:
        pattern = rf"(?ms)(^\[{section}\]$[^\[]*?^DefaultValue=)([^\n]*)"
        assert re.search(pattern, text), section
        return re.sub(pattern, lambda found: f"{found[1]}{int(found[2], 0) + 1}", text, count=1)

    return change


OF_THE_NETWORK = {
    "network.toml, gear ratio": ("network.toml", scaled("gear_ratio"), ("vehicle.toml: [geometry] gear_ratio",)),
    "network.toml, rated torque": ("network.toml", scaled("rated_torque"), ("vehicle.toml: [limits] rated_torque",)),
    "vehicle.toml, gear ratio": ("vehicle.toml", scaled("gear_ratio"), ("network.toml: [devices.wheel_drive",)),
    "vehicle.toml, rated torque": ("vehicle.toml", scaled("rated_torque"), ("network.toml: [devices.wheel_drive",)),
    "network.toml, increments": ("network.toml", scaled("counts_per_revolution"), ("drive.eds", "608Fh")),
    "network.toml, range": ("network.toml", scaled("measuring_range"), ("encoder.eds", "6002h")),
    "drive.eds, rated torque": ("drive.eds", default("6076"), ("vehicle.toml: [limits] rated_torque",)),
    "drive.eds, increments": ("drive.eds", default("608Fsub1"), ("network.toml: [devices.wheel_drive",)),
    "drive.eds, vendor": ("drive.eds", default("1018sub1"), ("vendor_id", "network.toml")),
    "drive.eds, device type": ("drive.eds", default("1000"), ("device_type", "network.toml")),
    "encoder.eds, increments": ("encoder.eds", default("6001"), ("network.toml: [devices.steering_encoder",)),
    "encoder.eds, range": ("encoder.eds", default("6002"), ("network.toml: [devices.steering_encoder",)),
    "encoder.eds, product": ("encoder.eds", default("1018sub2"), ("product_code", "network.toml")),
    "encoder.eds, revision": ("encoder.eds", default("1018sub3"), ("revision_number", "network.toml")),
}


@pytest.mark.parametrize(("name", "change", "named"), OF_THE_NETWORK.values(), ids=OF_THE_NETWORK)
def test_a_number_that_differs_is_refused_with_both_places(
    files: Files, name: str, change: Callable[[str], str], named: tuple[str, ...]
) -> None:
    load_described(files["vehicle.toml"], files["network.toml"])
    files[name].write_text(change(files[name].read_text()))
    with pytest.raises(DataFileError) as caught:
        load_described(files["vehicle.toml"], files["network.toml"])
    for word in (name, *named):
        assert word in caught.value.what
    assert caught.value.remedy


OF_THE_PROTOTYPE = (
    *(("geometry", scaled(name), name) for name in ("wheelbase", "track_width", "wheel_offset", "wheel_radius")),
    ("geometry", scaled("gear_ratio"), "gear_ratio"),
    ("drive", scaled("rated_torque"), "rated_torque"),
    ("drive", scaled("peak_torque"), "peak_torque"),
    ("drive", scaled("counts_per_revolution"), "counts_per_revolution"),
    ("steering_encoder", scaled("zero_position"), "zero_position"),
    *(("drive", negated(f"direction_{wheel}"), f"direction_{wheel}") for wheel in ("fl", "rl", "fr", "rr")),
    *(("steering_encoder", negated(f"direction_{side}"), f"direction_{side}") for side in ("left", "right")),
)


@pytest.mark.parametrize(("table", "change", "key"), OF_THE_PROTOTYPE, ids=[key for _, _, key in OF_THE_PROTOTYPE])
def test_a_prototype_that_is_another_vehicle_is_found(
    files: Files, table: str, change: Callable[[str], str], key: str
) -> None:
    prototype = files["prototype.toml"]
    prototype.write_text(change(prototype.read_text()))
    network = load_network(files["network.toml"])
    stated = stated_by(load_emulated_unchecked(prototype))
    found = [str(one.what) for one in disagreements(load_vehicle(files["vehicle.toml"]), network, stated)]
    assert any(f"prototype.toml: [{table}] {key}" in what for what in found), found


def load_emulated_unchecked(path: Path) -> object:
    from emulator.prototype import load_prototype

    return load_prototype(path)


def test_an_emulated_prototype_is_not_put_behind_the_network_of_another(files: Files) -> None:
    prototype = files["prototype.toml"]
    prototype.write_text(negated("direction_rr")(prototype.read_text()))
    with pytest.raises(DataFileError, match="direction_rr"):
        load_emulated(prototype, files["network.toml"])


def test_what_the_vehicle_file_owns_may_be_left_out_of_the_network_file(files: Files) -> None:
    before = load_described(files["vehicle.toml"], files["network.toml"]).network
    network = files["network.toml"]
    text = re.sub(
        r"(?m)^(rated_torque|gear_ratio = { value = [^1]|gear_ratio = { value = 1[0-9]).*\n", "", network.read_text()
    )
    assert "gear_ratio" in text
    assert "rated_torque" not in text
    network.write_text(text)
    after = load_described(files["vehicle.toml"], network).network
    for one, other in zip(before.drives, after.drives, strict=True):
        assert one.angle_unit == other.angle_unit
        assert one.torque_unit == other.torque_unit
    with pytest.raises(DataFileError, match="the vehicle file owns it"):
        assert load_network(network).drives[0].angle_unit


def test_an_eds_without_a_default_says_nothing(files: Files) -> None:
    eds = files["drive.eds"]
    eds.write_text(re.sub(r"(?ms)(^\[6076\]$[^\[]*?^DefaultValue=)[^\n]*", r"\g<1>0", eds.read_text()))
    load_described(files["vehicle.toml"], files["network.toml"])


MISSPELT = {
    "vehicle.toml": (
        ('name = "', 'nmae = "x"\nname = "', "nmae", "name"),
        ("[limits]", "[limits]\nrated_torqe = 1", "limits.rated_torqe", "rated_torque"),
        ('unit = "m", source', 'unit = "m", sdt = 0.1, source', "geometry.wheelbase.sdt", "std"),
        ("[geometry]", "[extra]\nx = 1\n[geometry]", "extra", "Use only"),
    ),
    "network.toml": (
        ('name = "', 'names = "x"\nname = "', "names", "name"),
        ("node_id =", "node_di = 3\nnode_id =", "master.node_di", "node_id"),
        ("[master.times]", "[master.times]\nsdo_timout = 1", "times.sdo_timout", "sdo_timeout"),
        ('eds = "drive.eds"', 'eds = "drive.eds"\nsed = 1', "devices.wheel_drive.sed", "eds"),
        ("vendor_id", "vendor_ID = 1, vendor_id", "vendor_ID", "vendor_id"),
        ("number = 1\n", "number = 1\nnumer = 2\n", "pdos.numer", "number"),
        ("subindex = 0 }", "subindex = 0, sub = 1 }", "objects.sub", "subindex"),
        ("zero_counts = 0\n", "zero_counts = 0\nzero_count = 1\n", "zero_count", "zero_counts"),
        ("[bus]\n", "[bus]\nbitrate = 5\n", "bus.bitrate", "bit_rate"),
    ),
    "prototype.toml": (
        ("[noise]", "[noise]\ntorque_senor = 1", "noise.torque_senor", "torque_sensor"),
        ("[floor]", "[flor]\nx = 1\n[floor]", "flor", "floor"),
        ('unit = "Nm", source', 'unit = "Nm", valeu = 3, source', "valeu", "value"),
    ),
}


@pytest.mark.parametrize(
    ("name", "old", "new", "key", "meant"),
    [(name, *mistake) for name, mistakes in MISSPELT.items() for mistake in mistakes],
    ids=[f"{name}: {mistake[2]}" for name, mistakes in MISSPELT.items() for mistake in mistakes],
)
def test_a_key_that_nobody_reads_is_refused_at_every_level(
    files: Files, name: str, old: str, new: str, key: str, meant: str
) -> None:
    text = files[name].read_text()
    assert old in text
    files[name].write_text(text.replace(old, new, 1))
    load = {"vehicle.toml": load_vehicle, "network.toml": load_network, "prototype.toml": load_emulated_unchecked}
    with pytest.raises(DataFileError) as caught:
        load[name](files[name])
    assert f"{key} is not known" in caught.value.what
    assert meant in caught.value.remedy
