"""EDS, DCF and DBC files: other tools read them, and they say what is on the bus."""

from __future__ import annotations

import configparser
import shutil
import warnings
from pathlib import Path

import canopen
import cantools
import pytest
from dcf.device import Device
from dcf.lint import lint
from dcf.parse import parse_file
from durand.object_dictionary import Variable

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.descriptions import configured_values, write_dbc, write_dcf, write_device_files
from hil.master import Master
from hil.network import DEFAULT_NETWORK, Network, PdoDirection, Role, load_network

DATA = DEFAULT_NETWORK.parent
COMPACT = DATA / "compact.toml"


@pytest.fixture(params=["prototype", "compact", "another SYNC"])
def described(request: pytest.FixtureRequest, tmp_path: Path) -> Network:
    if request.param != "another SYNC":
        return load_network(DEFAULT_NETWORK if request.param == "prototype" else COMPACT)
    for name in ("drive.eds", "encoder.eds"):
        shutil.copy(DATA / name, tmp_path)
    text = DEFAULT_NETWORK.read_text(encoding="utf-8")
    (path := tmp_path / "network.toml").write_text(text.replace("sync_cob_id = 0x80", "sync_cob_id = 0xA0"))
    return load_network(path)


def reader(path: Path) -> configparser.ConfigParser:
    """The plainest of all readers: CiA 306 files are INI files."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[method-assign,assignment]
    parser.read(path, encoding="utf-8")
    return parser


@pytest.mark.parametrize("name", ["drive.eds", "encoder.eds"])
def test_other_readers_load_the_eds(name: str) -> None:
    """What CANchkEDS looks for: lists complete, sections complete, sub-indices counted, limits around the default."""
    path = DATA / name
    parsed, plain = canopen.import_od(str(path), 3), reader(path)
    listed = [
        int(plain[section][str(k)], 16)
        for section in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
        for k in range(1, int(plain[section]["SupportedObjects"]) + 1)
    ]
    objects = {int(section, 16) for section in plain.sections() if len(section) == 4}
    assert sorted(listed) == sorted(objects)
    assert {item.index for item in parsed.values() if item.index >= 0x20} == objects
    for section in plain.sections():
        if len(section) == 4 and "SubNumber" in plain[section]:
            subs = [other for other in plain.sections() if other.startswith(section + "sub")]
            assert int(plain[section]["SubNumber"], 0) == len(subs), section
            highest = max(int(sub[7:], 16) for sub in subs)
            zero = int(plain[section + "sub0"]["DefaultValue"], 0)
            mapping = section[:2] in ("16", "1A") or section == "1003"
            assert zero == highest or mapping, section
        elif section[:1] in "126" and "DataType" in plain[section]:
            assert plain[section]["AccessType"] in ("ro", "rw", "wo", "const", "rww", "rwr"), section


def lely_accepts(path: Path, environment: dict[str, int]) -> Device:
    """What `dcfchk` of the Lely CANopen tools does; its complaints are warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parsed = parse_file(str(path))
        assert lint(parsed)
        return Device(parsed, environment)


@pytest.mark.parametrize("name", ["drive.eds", "encoder.eds"])
def test_the_checker_of_lely_finds_nothing_in_the_eds(name: str) -> None:
    device = lely_accepts(DATA / name, {"NODEID": 4})
    assert device.tpdo[1].cob_id & 0x7FF == 0x184


def test_the_checker_of_lely_finds_nothing_in_the_dcf(described: Network, tmp_path: Path) -> None:
    for node in described.nodes:
        (path := tmp_path / "node.dcf").write_text(write_dcf(node, described))
        device = lely_accepts(path, {})
        for pdo in node.pdos:
            found = (device.rpdo if pdo.direction is PdoDirection.RECEIVE else device.tpdo)[pdo.number]
            assert found.cob_id & 0xBFFFFFFF == pdo.cob_id(node.node_id)
            assert found.transmission_type == pdo.transmission_type
            assert [entry.index for entry in found.mapping.values()] == [item.index for item in pdo.objects]


@pytest.mark.parametrize("name", ["drive.eds", "encoder.eds"])
def test_defaults_lie_within_the_limits(name: str) -> None:
    for _, _, variable in Dictionary(DATA / name, 5).entries():
        assert isinstance(variable, Variable)
        if isinstance(variable.value, int):
            assert variable.minimum <= variable.value <= variable.maximum


@pytest.mark.parametrize("name", ["drive.eds", "encoder.eds"])
def test_default_mappings_are_mappable(name: str) -> None:
    dictionary = Dictionary(DATA / name, 5)
    for base, mappable in ((0x1600, dictionary.receivable), (0x1A00, dictionary.transmittable)):
        for index in range(base, base + 4):
            if index in dictionary:
                entries = [dictionary.value(index, k) for k in range(1, dictionary.value(index, 0) + 1)]
                assert {(entry >> 16, entry >> 8 & 0xFF) for entry in entries} <= mappable


def test_a_folder_has_the_eds_of_every_device_and_the_dcf_of_every_node(described: Network, tmp_path: Path) -> None:
    paths = write_device_files(described, tmp_path / "new" / "folder")
    assert sorted(path.suffix for path in paths) == [".dcf"] * 6 + [".eds"] * 2
    for node in described.nodes:
        assert (tmp_path / "new" / "folder" / node.eds.name).read_bytes() == node.eds.read_bytes()


def test_a_dcf_holds_what_the_master_writes(described: Network, tmp_path: Path) -> None:
    """Compared with the nodes themselves after the master has configured them."""
    with LockstepBench(Flywheels(), described.path) as bench, Master(bench.bus, bench.clock, described) as master:
        master.boot()
        for node in described.nodes:
            (path := tmp_path / "node.dcf").write_text(write_dcf(node, described))
            parsed = canopen.import_od(str(path))
            assert (parsed.node_id, parsed.bitrate) == (node.node_id, described.bit_rate)
            objects = bench.devices.nodes[node.node_id].object_dictionary
            values = configured_values(node, described)
            for (index, subindex), value in values.items():
                assert objects.value(index, subindex) == value, f"{index:04X}h:{subindex}"
                assert parsed.get_variable(index, subindex).value == value
            set_in_file = {
                (item.index, item.subindex)
                for entry in parsed.values()
                for item in (entry.subindices.values() if hasattr(entry, "subindices") else [entry])
                if item.value is not None
            }
            assert set_in_file == set(values)


def test_a_dbc_names_every_frame_of_a_cycle_and_gives_si_units(described: Network) -> None:
    database = cantools.database.load_string(write_dbc(described), "dbc")
    torques = [0.4, -0.3, 0.2, -0.1]
    with LockstepBench(Flywheels(), described.path) as bench, Master(bench.bus, bench.clock, described) as master:
        listener = bench.open_bus()
        master.boot()
        master.enable()
        for _ in range(50):
            sample = master.exchange(torques)
        seen: dict[str, dict[str, float]] = {}
        while (message := listener.recv(0)) is not None:
            known = database.get_message_by_frame_id(message.arbitration_id)
            seen[known.name] = known.decode(message.data, decode_choices=False)
    for k, role in enumerate((Role.DRIVE_FL, Role.DRIVE_RL, Role.DRIVE_FR, Role.DRIVE_RR)):
        telegrams = {key: value for name in seen if name.startswith(role) for key, value in seen[name].items()}
        assert telegrams["Torque_actual_value"] == pytest.approx(sample.motor_torques[k], abs=1e-9)
        assert telegrams["Position_actual_value"] == pytest.approx(sample.wheel_angles[k], abs=1e-9)
        assert telegrams["Target_torque"] == pytest.approx(torques[k], abs=0.001)
    for k, role in enumerate((Role.ENCODER_LEFT, Role.ENCODER_RIGHT)):
        telegrams = {key: value for name in seen if name.startswith(role) for key, value in seen[name].items()}
        assert telegrams["Position_value"] == pytest.approx(sample.steering_angles[k], abs=1e-9)


def test_the_services_are_in_the_dbc_too(described: Network) -> None:
    database = cantools.database.load_string(write_dbc(described), "dbc")
    node = described.nodes[0]
    decoded = database.decode_message(0x700 + node.node_id, b"\x05")
    assert decoded["NMT_state"] == "operational"
    assert database.decode_message(0x080 + node.node_id, bytes.fromhex("3081110000000000"))["Error_code"] == 0x8130
    assert database.get_message_by_name("SYNC").frame_id == described.sync_cob_id
    assert len({message.frame_id for message in database.messages}) == len(database.messages)
