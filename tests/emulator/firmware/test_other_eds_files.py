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


def quick_stop(folder: Path) -> None:
    """As much of a drive's life as it takes to need its option codes."""
    nodes = devices(folder, [])
    nodes.receive(0x000, b"\x01\x01")
    nodes.receive(0x601, bytes.fromhex("2f6060000a000000"))
    for controlword in (0x06, 0x07, 0x0F, 0x02):
        nodes.receive(0x201, struct.pack("<Hh", controlword, 0))
        nodes.advance(nodes.time + 0.002)
