"""Storing and restoring parameters: 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from emulator.firmware.storage import FolderMemory
from ident.errors import DataFileError

SAVE, LOAD = b"save", b"load"


def heartbeat(wire) -> int:
    return wire.read(1, 0x1017)


def change(wire) -> None:
    """One communication parameter, one of the device profile, one of the maker."""
    wire.write(1, 0x1017, 0, struct.pack("<H", 123))
    wire.write(1, 0x6087, 0, struct.pack("<I", 4321))


def values(wire) -> tuple[int, int]:
    return heartbeat(wire), wire.read(1, 0x6087)


@pytest.fixture
def defaults(wire) -> tuple[int, int]:
    return values(wire)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
def test_they_say_that_they_act_on_command(wire, index: int) -> None:
    assert [wire.read(1, index, k) for k in (1, 2, 3)] == [1, 1, 1]


@pytest.mark.parametrize(("index", "right"), [(0x1010, SAVE), (0x1011, LOAD)])
@pytest.mark.parametrize("signature", [b"evas", b"wron", bytes(4), SAVE, LOAD])
def test_a_wrong_signature_is_refused(wire, index: int, right: bytes, signature: bytes) -> None:
    assert wire.write(1, index, 1, signature) == (0 if signature == right else 0x08000020)


def test_what_was_saved_is_there_after_a_reset(wire) -> None:
    change(wire)
    assert wire.write(1, 0x1010, 1, SAVE) == 0
    wire.nmt(0x81, 1)
    assert values(wire) == (123, 4321)


GROUPS = {1: (True, True), 2: (True, False), 3: (False, True)}


@pytest.mark.parametrize(("group", "kept"), GROUPS.items())
def test_groups_are_saved_and_restored_by_themselves(wire, defaults, group: int, kept: tuple[bool, bool]) -> None:
    change(wire)
    wire.write(1, 0x1010, group, SAVE)
    wire.nmt(0x81, 1)
    assert values(wire) == tuple(
        new if saved else old for new, old, saved in zip((123, 4321), defaults, kept, strict=True)
    )
    change(wire)
    wire.write(1, 0x1010, 1, SAVE)
    wire.write(1, 0x1011, group, LOAD)
    assert values(wire) == (123, 4321), "defaults are valid from the next reset on"
    wire.nmt(0x81, 1)
    assert values(wire) == tuple(
        old if restored else new for new, old, restored in zip((123, 4321), defaults, kept, strict=True)
    )


def test_a_communication_reset_brings_the_stored_communication_parameters(wire) -> None:
    change(wire)
    wire.write(1, 0x1010, 1, SAVE)
    wire.write(1, 0x1017, 0, struct.pack("<H", 7))
    wire.write(1, 0x6087, 0, struct.pack("<I", 8))
    wire.nmt(0x82, 1)
    assert values(wire) == (123, 8)


def test_commands_and_set_points_are_not_parameters(wire) -> None:
    wire.write(1, 0x6071, 0, struct.pack("<h", 55))
    wire.write(1, 0x6040, 0, struct.pack("<H", 6))
    wire.write(1, 0x1010, 1, SAVE)
    wire.nmt(0x81, 1)
    assert (wire.read(1, 0x6071), wire.read(1, 0x6040)) == (0, 0)


def test_a_running_node_does_not_store(wire) -> None:
    wire.nmt(0x01, 1)
    assert wire.write(1, 0x1010, 1, SAVE) == 0x08000022
    assert wire.write(1, 0x1011, 1, LOAD) == 0x08000022


def test_nodes_store_for_themselves(wire) -> None:
    change(wire)
    wire.write(1, 0x1010, 1, SAVE)
    wire.nmt(0x81)
    assert wire.read(2, 0x1017) == 0


def test_a_mapping_that_was_saved_is_used_after_a_restart(wire, tmp_path: Path) -> None:
    """With a folder as memory, a new process finds what the last one stored."""
    first, second = (type(wire)(FolderMemory(tmp_path)) for _ in range(2))
    first.write(1, 0x1800, 1, struct.pack("<I", 0x80000181))
    first.write(1, 0x1800, 2, b"\x01")
    first.write(1, 0x1A00, 0, b"\x00")
    first.write(1, 0x1A00, 1, struct.pack("<I", 0x60410010))
    first.write(1, 0x1A00, 0, b"\x01")
    first.write(1, 0x1800, 1, struct.pack("<I", 0x181))
    first.write(1, 0x2000, 0, b"left")
    first.write(1, 0x1010, 1, SAVE)
    second = type(wire)(FolderMemory(tmp_path))
    second.nmt(0x01, 1)
    ((can_id, data),) = second.send(0x080)
    assert (can_id, len(data)) == (0x181, 2)
    assert second.read(1, 0x2000) == int.from_bytes(b"left", "little")


def test_nothing_is_written_before_something_is_saved(wire, tmp_path: Path) -> None:
    folder = tmp_path / "memory"
    type(wire)(FolderMemory(folder)).write(1, 0x1017, 0, struct.pack("<H", 9))
    assert not folder.exists()


def test_the_memory_of_another_device_is_refused(wire, tmp_path: Path) -> None:
    change(first := type(wire)(FolderMemory(tmp_path)))
    first.write(1, 0x1010, 1, SAVE)
    document = json.loads((tmp_path / "node_1.json").read_text())
    (tmp_path / "node_5.json").write_text(json.dumps(document))
    with pytest.raises(DataFileError, match="node 5"):
        type(wire)(FolderMemory(tmp_path))


@pytest.mark.parametrize("text", ["", "[]", '{"device": 1}', '{"device": "x", "values": {"12": 1}}'])
def test_a_spoilt_memory_is_named(wire, tmp_path: Path, text: str) -> None:
    (tmp_path / "node_1.json").write_text(text)
    with pytest.raises(DataFileError, match=r"node_1\.json"):
        type(wire)(FolderMemory(tmp_path))


def test_a_memory_that_cannot_be_written_is_told_to_the_client(wire, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    broken = type(wire)(FolderMemory(tmp_path / "file" / "folder"))
    assert broken.write(1, 0x1010, 1, SAVE) == 0x08000020


def test_a_memory_that_is_spoilt_while_it_runs_is_told_to_the_client(wire, tmp_path: Path) -> None:
    running = type(wire)(FolderMemory(tmp_path))
    (tmp_path / "node_1.json").write_text("{")
    assert running.write(1, 0x1010, 1, SAVE) == 0x08000020
