"""TPDOs asked for by remote frames (CiA 301, 7.2.2.4): transmission types 252, 253, and any other where allowed."""

from __future__ import annotations

import struct

import pytest

NO_REMOTE = 1 << 30
INVALID = 1 << 31


def configure(wire, transmission_type: int, cob_id: int = 0x181, node_id: int = 1) -> int:
    wire.write(node_id, 0x1800, 1, struct.pack("<I", INVALID | cob_id))
    refusal = wire.write(node_id, 0x1800, 2, bytes((transmission_type,)))
    wire.write(node_id, 0x1800, 1, struct.pack("<I", cob_id))
    return refusal


@pytest.mark.parametrize("transmission_type", [0, 1, 240, 252, 253, 254, 255])
def test_a_remote_frame_is_answered_in_operational_only(wire, transmission_type: int) -> None:
    assert configure(wire, transmission_type) == 0
    assert wire.remote(0x181) == []
    wire.nmt(0x01, 1)
    (answer,) = wire.remote(0x181)
    assert answer[0] == 0x181
    assert len(answer[1]) == 8
    wire.nmt(0x02, 1)
    assert wire.remote(0x181) == []


def test_a_tpdo_whose_cob_id_forbids_it_is_not_sent_on_request(wire) -> None:
    assert configure(wire, 255, NO_REMOTE | 0x181) == 0
    wire.nmt(0x01, 1)
    assert wire.remote(0x181) == []


@pytest.mark.parametrize("transmission_type", [252, 253])
def test_types_for_remote_frames_need_remote_frames(wire, transmission_type: int) -> None:
    assert configure(wire, transmission_type, NO_REMOTE | 0x181) == 0x06090030


def test_type_252_gives_the_values_of_the_last_sync_and_type_253_those_of_now(wire) -> None:
    wire.enable(2)
    shown = {}
    for transmission_type in (252, 253):
        assert configure(wire, transmission_type, 0x182, node_id=2) == 0
        wire.command(2, 0x0F, 500)
        wire.wait(0.01)
        at_sync = wire.read(2, 0x6064, signed=True)
        wire.send(0x080)
        wire.wait(0.05)
        now = wire.read(2, 0x6064, signed=True)
        assert now > at_sync
        ((_, data),) = wire.remote(0x182)
        shown[transmission_type] = (struct.unpack_from("<i", data, 4)[0], at_sync, now)
    assert shown[252][0] == shown[252][1]
    assert shown[253][0] == shown[253][2]


def test_types_for_remote_frames_send_nothing_by_themselves(wire) -> None:
    for transmission_type in (252, 253):
        configure(wire, transmission_type)
        wire.nmt(0x01, 1)
        assert wire.send(0x080) == []
        assert wire.send(0x201, struct.pack("<Hh", 0x06, 0)) == []
        wire.nmt(0x80, 1)


def test_a_remote_frame_to_nobody_is_ignored(wire) -> None:
    wire.nmt(0x01)
    for can_id in (0x000, 0x080, 0x201, 0x601, 0x1FF, 0x7FF):
        assert wire.remote(can_id) == []
