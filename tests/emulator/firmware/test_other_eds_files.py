"""EDS files of other makers: what CiA 301 makes optional may be missing; what a device needs is named."""

from __future__ import annotations

import re
import shutil
import struct
from pathlib import Path

import pytest

from emulator.firmware.description import read_network_description
from emulator.firmware.flywheels import Flywheels
from emulator.firmware.network import DeviceNetwork
from ident.errors import DataFileError

DATA = Path(__file__).parents[3] / "hil" / "data"
OPTIONAL = (0x1003, 0x1005, 0x1006, 0x100C, 0x100D, 0x1010, 0x1011, 0x1014, 0x1015, 0x1016, 0x1017, 0x1019)
OPTIONAL += (0x1021, 0x1022, 0x1029, 0x1200, 0x2000)


def without(eds: Path, indices: tuple[int, ...]) -> None:
    """Take objects out of an EDS file."""
    names = "|".join(f"{index:04X}" for index in indices)
    text = eds.read_text(encoding="utf-8")
    text = re.sub(rf"^\[(?:{names})(?:sub[0-9A-F]+)?\]\n(?:.+\n)*\n?", "", text, flags=re.MULTILINE)
    eds.write_text(re.sub(rf"^\d+=0x(?:{names})\n", "", text, flags=re.MULTILINE), encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("network.toml", "drive.eds", "encoder.eds"):
        shutil.copy(DATA / name, tmp_path)
    return tmp_path


def devices(folder: Path, sent: list[tuple[int, bytes]]) -> DeviceNetwork:
    return DeviceNetwork(
        Flywheels(),
        read_network_description(folder / "network.toml"),
        lambda can_id, data: sent.append((can_id, data)),
    )


def test_nodes_without_the_optional_objects_work(folder: Path) -> None:
    for name in ("drive.eds", "encoder.eds"):
        without(folder / name, OPTIONAL)
    sent: list[tuple[int, bytes]] = []
    nodes = devices(folder, sent)
    for node_id in (1, 5):
        nodes.receive(0x600 + node_id, bytes.fromhex("4017100000000000"))
        assert sent.pop() == (0x580 + node_id, bytes.fromhex("8017100000000206"))
        nodes.receive(0x600 + node_id, bytes.fromhex("2f00180201000000"))
        assert sent.pop()[1][0] == 0x60
    nodes.receive(0x000, b"\x01\x00")
    sent.clear()
    nodes.receive(0x080, b"")
    assert {can_id for can_id, _ in sent} == {0x181, 0x185}
    sent.clear()
    nodes.receive(0x201, b"\x06")
    assert (0x081, struct.pack("<HBH3x", 0x8210, 0x11, 1)) in sent
    sent.clear()
    nodes.receive_remote(0x705)
    assert sent == [(0x705, b"\x05")]
    nodes.receive(0x000, b"\x81\x00")
    nodes.advance(5.0)


@pytest.mark.parametrize(("name", "index"), [("drive.eds", 0x605A), ("drive.eds", 0x6085), ("encoder.eds", 0x6002)])
def test_an_object_that_the_device_needs_is_named(folder: Path, name: str, index: int) -> None:
    without(folder / name, (index,))
    with pytest.raises(DataFileError, match=f"{name}.*{index:04X}h"):
        quick_stop(folder)


def retype(eds: Path, index: int, data_type: int, mappable: bool = False) -> None:
    """Give an object another data type."""
    head, section, rest = re.split(
        rf"(^\[{index:04X}\]\n(?:.+\n)*)", eds.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    section = re.sub(r"DataType=.*", f"DataType=0x{data_type:04X}", section)
    section = re.sub(r"PDOMapping=.*", f"PDOMapping={int(mappable)}", section)
    eds.write_text(head + section + rest, encoding="utf-8")


TYPES = {"REAL32": (0x08, 32, struct.pack("<f", 1.5)), "UNSIGNED64": (0x1B, 64, struct.pack("<Q", 2**63 + 1))}


@pytest.mark.parametrize(("data_type", "bits", "value"), TYPES.values(), ids=TYPES)
def test_wider_types_are_written_and_mapped(folder: Path, data_type: int, bits: int, value: bytes) -> None:
    retype(folder / "encoder.eds", 0x2000, data_type, mappable=True)
    sent: list[tuple[int, bytes]] = []
    nodes = devices(folder, sent)
    nodes.receive(0x605, struct.pack("<BHBI", 0x21, 0x2000, 0, len(value)))
    padded = value + bytes(14 - len(value))
    nodes.receive(0x605, bytes((0x00 | (7 - min(7, len(value))) << 1 | (len(value) <= 7),)) + padded[:7])
    if len(value) > 7:
        nodes.receive(0x605, bytes((0x10 | (14 - len(value)) << 1 | 1,)) + padded[7:])
    for index, subindex, size, number in (
        (0x1800, 1, 4, 0xC0000185),
        (0x1800, 2, 1, 1),
        (0x1A00, 0, 1, 0),
        (0x1A00, 1, 4, 0x20000000 | bits),
        (0x1A00, 0, 1, 1),
        (0x1800, 1, 4, 0x40000185),
    ):
        nodes.receive(0x605, struct.pack("<BHBI", 0x23 | (4 - size) << 2, index, subindex, number))
        assert sent[-1][1][0] == 0x60, sent[-1][1].hex()
    nodes.receive(0x000, b"\x01\x05")
    sent.clear()
    nodes.receive(0x080, b"")
    assert sent == [(0x185, value)]


def test_a_bit_is_not_mapped(folder: Path) -> None:
    """Frames of these nodes are made of whole bytes (granularity 8 in the EDS)."""
    retype(folder / "encoder.eds", 0x2000, 0x01, mappable=True)
    sent: list[tuple[int, bytes]] = []
    nodes = devices(folder, sent)
    for frame in ("23001801850100c0", "2f001a0000000000", "23001a0101000020"):
        nodes.receive(0x605, bytes.fromhex(frame))
    assert sent[-1][1] == bytes.fromhex("80001a0141000406")


def test_a_limit_that_the_type_does_not_reach_is_named(folder: Path) -> None:
    path = folder / "encoder.eds"
    path.write_text(path.read_text(encoding="utf-8").replace("[1019]\n", "[1019]\nHighLimit=999\n"), encoding="utf-8")
    with pytest.raises(DataFileError, match=r"encoder\.eds.*1019h"):
        devices(folder, [])


def test_an_unknown_data_type_is_named(folder: Path) -> None:
    retype(folder / "encoder.eds", 0x2000, 0x0C)
    with pytest.raises(DataFileError, match=r"encoder\.eds.*2000h.*000Ch"):
        devices(folder, [])


def quick_stop(folder: Path) -> None:
    """As much of a drive's life as it takes to need its option codes."""
    nodes = devices(folder, [])
    nodes.receive(0x000, b"\x01\x01")
    nodes.receive(0x601, bytes.fromhex("2f6060000a000000"))
    for controlword in (0x06, 0x07, 0x0F, 0x02):
        nodes.receive(0x201, struct.pack("<Hh", controlword, 0))
        nodes.advance(nodes.time + 0.002)
