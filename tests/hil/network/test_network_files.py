"""Network files describe a vehicle; what cannot be is refused with the place named."""

from __future__ import annotations

import configparser
import math
from pathlib import Path

import canopen
import pytest

from hil.network import DEFAULT_NETWORK, DRIVES, ENCODERS, PdoDirection, load_network
from ident.errors import DataFileError


def test_every_shipped_file_describes_six_nodes_in_wheel_order(network_file: Path) -> None:
    network = load_network(network_file)
    assert tuple(node.role for node in network.drives) == DRIVES
    assert tuple(node.role for node in network.encoders) == ENCODERS
    assert len({node.node_id for node in network.nodes}) == 6


def test_the_two_vehicles_are_wired_differently() -> None:
    one, two = load_network(), load_network(DEFAULT_NETWORK.with_name("compact.toml"))
    for first, second in zip(one.drives, two.drives, strict=True):
        assert first.node_id != second.node_id
        assert first.rotation == -second.rotation
        assert first.angle_unit != second.angle_unit
        assert [pdo.objects for pdo in first.pdos] != [pdo.objects for pdo in second.pdos]


def test_one_turn_of_the_wheel_is_gear_ratio_times_the_counts_of_the_motor(network_file: Path) -> None:
    for node in load_network(network_file).drives:
        counts = node.quantities["counts_per_revolution"].value * node.quantities["gear_ratio"].value
        assert node.angle_unit * counts == pytest.approx(node.rotation * 2 * math.pi)
        assert node.torque_unit * 1000 == pytest.approx(node.rotation * node.quantities["rated_torque"].value)


def test_every_pdo_fits_into_a_frame_and_uses_the_predefined_identifiers(network_file: Path) -> None:
    for node in load_network(network_file).nodes:
        for pdo in node.pdos:
            base = {PdoDirection.TRANSMIT: 0x180, PdoDirection.RECEIVE: 0x200}[pdo.direction]
            assert pdo.cob_id(node.node_id) == base + 0x100 * (pdo.number - 1) + node.node_id
            assert sum(item.bits for item in pdo.objects) <= 64


EDS_FILES = sorted(DEFAULT_NETWORK.parent.glob("*.eds"))

MISTAKES = {
    "a role that is not there": ('role = "drive_rr"', 'role = "drive_xx"', "drive_xx"),
    "a role given twice": ('role = "drive_rr"', 'role = "drive_fr"', "drive_fr"),
    "a node id given twice": ("id = 4\n", "id = 3\n", "3"),
    "a node id out of range": ("id = 4\n", "id = 200\n", "200"),
    "a rotation of zero": ("rotation = -1\n", "rotation = 0\n", "rotation"),
    "a unit that is not SI": ('value = 0.002, unit = "s"', 'value = 2, unit = "ms"', "cycle_period"),
    "an EDS file that is not there": ('eds = "drive.eds"', 'eds = "motor.eds"', "motor.eds"),
    "an object that cannot be mapped": (
        'name = "Position value", index = 0x6004',
        'name = "Serial number", index = 0x650B',
        "650B",
    ),
    "a name that is not the object's": ('name = "Position value"', 'name = "Angle"', "Angle"),
    "no TPDO with the torque": (
        '    { name = "Torque actual value", index = 0x6077, subindex = 0 },\n',
        "",
        "6077",
    ),
    "a direction that is not there": ('direction = "receive"', 'direction = "recieve"', "recieve"),
    "a PDO object without index": ('name = "Controlword", index = 0x6040', 'name = "Controlword"', "Controlword"),
    "a PDO that does not come every cycle": ("transmission_type = 1\n", "transmission_type = 2\n", "transmission type"),
    "a cycle of no length": ("value = 0.002", "value = 0.0", "cycle_period"),
    "a bit rate of zero": ("bit_rate = { value = 1e6", "bit_rate = { value = 0", "bit_rate"),
    "an encoder without increments": ("value = 1048576", "value = 0", "counts_per_revolution"),
    "a master with the id of a node": ("node_id = 127", "node_id = 3", "703h"),
    "a SYNC with the identifier of a TPDO": ("sync_cob_id = 0x80", "sync_cob_id = 0x183", "183h"),
    "a heartbeat that 16 bits of milliseconds cannot hold": ("value = 0.25", "value = 70.0", "heartbeat_timeout"),
    "nodes that trip between two heartbeats of the master": ("value = 0.25", "value = 0.05", "every 0.1 s"),
    "a device that is not described": ('device = "steering_encoder"', 'device = "resolver"', "resolver"),
}


@pytest.mark.parametrize(("old", "new", "named"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_the_file_is_named(rewritten_network, old: str, new: str, named: str) -> None:
    with pytest.raises(DataFileError) as caught:
        rewritten_network((old, new))
    assert named in caught.value.what
    assert caught.value.remedy


def test_an_eds_without_its_device_is_refused_and_nothing_is_printed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for path in (DEFAULT_NETWORK, *EDS_FILES):
        text = path.read_text(encoding="utf-8")
        (tmp_path / path.name).write_text(text.replace("[DeviceInfo]", "[Device]"), encoding="utf-8")
    with pytest.raises(DataFileError, match=r"drive\.eds is not an EDS file: .*DeviceInfo"):
        load_network(tmp_path / DEFAULT_NETWORK.name)
    assert caplog.records == []


def test_a_pdo_of_more_than_eight_bytes_is_refused(rewritten_network) -> None:
    with pytest.raises(DataFileError, match="8 bytes"):
        rewritten_network(
            (
                '    { name = "Torque actual value", index = 0x6077, subindex = 0 },\n',
                '    { name = "Torque actual value", index = 0x6077, subindex = 0 },\n'
                '    { name = "Velocity actual value", index = 0x606C, subindex = 0 },\n',
            )
        )


def test_the_default_cycle_takes_sixty_per_cent_of_the_bus_at_worst() -> None:
    assert load_network().worst_bus_load == pytest.approx(0.6, abs=0.03)


def test_a_cycle_that_cannot_fit_on_the_bus_is_refused(rewritten_network) -> None:
    with pytest.raises(DataFileError, match="116% of the bus"):
        rewritten_network(("bit_rate = { value = 1e6", "bit_rate = { value = 5e5"))


@pytest.mark.parametrize("path", EDS_FILES, ids=lambda path: path.stem)
def test_an_eds_file_lists_exactly_the_objects_that_it_describes(path: Path) -> None:
    eds = configparser.RawConfigParser()
    eds.optionxform = str
    eds.read(path)
    described = {int(section, 16) for section in eds.sections() if len(section) == 4}
    listed: list[int] = []
    for section in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        count = int(eds[section]["SupportedObjects"])
        listed += [int(eds[section][str(k)], 16) for k in range(1, count + 1)]
    assert sorted(listed) == sorted(described)
    assert eds["FileInfo"]["FileName"] == path.name


@pytest.mark.parametrize("path", EDS_FILES, ids=lambda path: path.stem)
def test_default_mappings_of_an_eds_name_mappable_objects_in_their_lengths(path: Path) -> None:
    dictionary = canopen.import_od(str(path), node_id=5)
    for index in (*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)):
        if index not in dictionary:
            continue
        for subindex in range(1, dictionary[index][0].default + 1):
            entry = dictionary[index][subindex].default
            variable = dictionary.get_variable(entry >> 16, entry >> 8 & 0xFF)
            assert variable.pdo_mappable
            assert len(variable) == entry & 0xFF


def test_the_identity_in_the_network_file_is_that_of_the_eds(network_file: Path) -> None:
    for node in load_network(network_file).nodes:
        dictionary = node.object_dictionary
        assert node.identity.device_type == dictionary[0x1000].default
        found = [dictionary[0x1018][k].default for k in (1, 2, 3)]
        assert found == [node.identity.vendor_id, node.identity.product_code, node.identity.revision_number]
