"""A run folder carries its network so that it can be read again, wherever the EDS files of its author lay."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hil.campaign.carried import (
    Files,
    carried_network,
    carried_vehicle,
    check_readable,
    is_carried,
    write_carried,
)
from hil.descriptions import write_device_files
from hil.network import DEFAULT_NETWORK, Network, Role, load_network
from ident.errors import CampaignError, UserError
from ident.vehicle.description import find_data_file, load_vehicle

SHIPPED = find_data_file("ident.vehicle", "prototype")
DRIVE, ENCODER = "drive.eds", "encoder.eds"


@pytest.fixture
def network_at(tmp_path: Path) -> Callable[[str, str], Path]:
    """A network file whose EDS files lie at the paths given, seen from it."""

    def write(drive: str, encoder: str) -> Path:
        home = tmp_path / "author" / "vehicle"
        home.mkdir(parents=True)
        text = DEFAULT_NETWORK.read_text()
        for shipped, there in ((DRIVE, drive), (ENCODER, encoder)):
            target = home / there
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(DEFAULT_NETWORK.with_name(shipped), target)
            text = text.replace(f'"{shipped}"', f'"{there}"')
        path = home / "my network.toml"
        path.write_text(text)
        return path

    return write


def carried(path: Path, folder: Path) -> tuple[Files, Network]:
    files = carried_network(path)
    write_carried(files, folder)
    return files, load_network(folder / "network.toml")


INSIDE = {
    "beside it": (DRIVE, ENCODER),
    "in a subfolder": ("eds/drive.eds", "eds/encoder.eds"),
    "of one name in two folders": ("a/device.eds", "b/device.eds"),
    "with spaces and umlauts": ("EDS Dateien/Antrieb für Räder.eds", "encoder.EDS"),
}
OUTSIDE = {
    "above it": ("../drive.eds", "../encoder.eds"),
    "one inside, one outside": ("drive.eds", "../shared/encoder.eds"),
    "of one name outside": ("../a/device.eds", "../b/device.eds"),
    "by a detour": ("../vehicle/drive.eds", "./encoder.eds"),
}


@pytest.mark.parametrize("where", [*INSIDE.values(), *OUTSIDE.values()], ids=[*INSIDE, *OUTSIDE])
def test_what_is_carried_reads_as_what_was_planned_with(
    network_at: Callable[[str, str], Path], tmp_path: Path, where: tuple[str, str]
) -> None:
    path = network_at(*where)
    planned = load_network(path)
    folder = tmp_path / "run" / "network"
    files, _ = carried(path, folder)
    shutil.rmtree(path.parent.parent)
    moved = shutil.move(folder, tmp_path / "elsewhere")
    (moved.parent / "vehicle.toml").write_bytes(SHIPPED.read_bytes())
    check_readable(moved.parent / "vehicle.toml", moved / "network.toml", load_vehicle(), planned)
    read = load_network(moved / "network.toml")
    assert read.node(Role.DRIVE_FL).eds.read_bytes() == DEFAULT_NETWORK.with_name(DRIVE).read_bytes()
    assert read.node(Role.ENCODER_LEFT).eds.read_bytes() == DEFAULT_NETWORK.with_name(ENCODER).read_bytes()
    assert carried_network(moved / "network.toml") == files, "carried again, it is the same"


def test_an_absolute_path_is_carried_too(network_at: Callable[[str, str], Path], tmp_path: Path) -> None:
    path = network_at(str(tmp_path / "far" / "drive.eds"), ENCODER)
    _, read = carried(path, tmp_path / "run")
    assert all(tmp_path / "run" in node.eds.parents for node in read.nodes)


@pytest.mark.parametrize("where", INSIDE.values(), ids=INSIDE)
def test_a_network_with_its_files_beside_it_is_carried_byte_for_byte(
    network_at: Callable[[str, str], Path], where: tuple[str, str]
) -> None:
    path = network_at(*where)
    assert carried_network(path)["network.toml"] == path.read_bytes()


def test_where_a_path_has_to_change_comments_and_all_other_lines_stay(network_at: Callable[[str, str], Path]) -> None:
    path = network_at("../drive.eds", ENCODER)
    before, after = (text.splitlines() for text in (path.read_text(), carried_network(path)["network.toml"].decode()))
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert changed == [
        ('eds = "../drive.eds"', 'eds = "eds/1_wheel_drive.eds"'),
        ('eds = "encoder.eds"', 'eds = "eds/2_steering_encoder.eds"'),
    ]


def test_a_resumed_campaign_knows_its_network_and_any_other(
    network_at: Callable[[str, str], Path], tmp_path: Path
) -> None:
    path = network_at("../drive.eds", ENCODER)
    folder = tmp_path / "run"
    write_carried(carried_network(path), folder)
    assert is_carried(carried_network(path), folder)
    eds = path.parent / "../drive.eds"
    eds.write_bytes(eds.read_bytes() + b"\n; another line\n")
    assert not is_carried(carried_network(path), folder), "an EDS file is part of the network"


def test_a_file_that_was_changed_since_the_planning_is_found_before_anything_moves(tmp_path: Path) -> None:
    network, vehicle = load_network(), load_vehicle()
    write_carried({**carried_network(DEFAULT_NETWORK), **carried_vehicle(SHIPPED)}, tmp_path)
    files = tmp_path / "vehicle.toml", tmp_path / "network.toml"
    check_readable(*files, vehicle, network)
    for path, old, new in (
        (files[1], "rotation = -1", "rotation = 1"),
        (files[0], "gear_ratio = { value = 2", "gear_ratio = { value = 3"),
    ):
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        with pytest.raises(CampaignError, match=f"{path.name} does not say what the campaign was planned with"):
            check_readable(*files, vehicle, network)
        path.write_text(text)


def test_files_of_others_are_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "vehicle.toml").write_text("mine")
    with pytest.raises(CampaignError, match="is there, and is not this campaign's"):
        write_carried(carried_vehicle(SHIPPED), tmp_path)
    assert (tmp_path / "vehicle.toml").read_text() == "mine"


def test_eds_files_of_one_name_are_all_written_for_other_tools(
    network_at: Callable[[str, str], Path], tmp_path: Path
) -> None:
    network = load_network(network_at("a/device.eds", "b/device.eds"))
    written = {path.name: path.read_bytes() for path in write_device_files(network, tmp_path / "out")}
    assert written["device.eds"] == DEFAULT_NETWORK.with_name(DRIVE).read_bytes()
    assert written["device_2.eds"] == DEFAULT_NETWORK.with_name(ENCODER).read_bytes()
    assert b"LastEDS=device_2.eds" in written["05_encoder_left.dcf"]


def test_eds_files_are_not_written_over_their_sources(network_at: Callable[[str, str], Path]) -> None:
    path = network_at(DRIVE, ENCODER)
    with pytest.raises(UserError, match="is read by this very command"):
        write_device_files(load_network(path), path.parent)
