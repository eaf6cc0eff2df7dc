"""Error register, history and EMCY messages (CiA 301, 7.2.7)."""

from __future__ import annotations

import struct

import pytest

SHORT = b"\x06"
RIGHT = struct.pack("<Hh", 0x06, 0)


def messages(frames: list[tuple[int, bytes]], can_id: int = 0x081) -> list[tuple[int, int, int]]:
    return [struct.unpack_from("<HBH", data) for sent_id, data in frames if sent_id == can_id]


def test_an_error_is_sent_once_while_it_lasts_and_again_when_it_comes_back(wire) -> None:
    wire.nmt(0x01, 1)
    assert messages(wire.send(0x201, SHORT)) == [(0x8210, 0x11, 1)]
    assert messages(wire.send(0x201, SHORT)) == []
    assert messages(wire.send(0x201, RIGHT)) == [(0, 0, 0)]
    assert messages(wire.send(0x201, RIGHT)) == []
    assert messages(wire.send(0x201, SHORT)) == [(0x8210, 0x11, 1)]


def test_an_error_lasts_until_its_last_source_is_gone(wire) -> None:
    wire.write(1, 0x1401, 1, struct.pack("<I", 0x301))
    wire.nmt(0x01, 1)
    assert messages(wire.send(0x201, SHORT)) == [(0x8210, 0x11, 1)]
    assert messages(wire.send(0x301, b"")) == [(0x8210, 0x11, 2)]
    assert messages(wire.send(0x201, RIGHT)) == []
    assert wire.read(1, 0x1001) == 0x11
    assert (0, 0, 0) in messages(wire.send(0x301, RIGHT[: len(RIGHT) // 2]))
    assert wire.read(1, 0x1001) == 0


def test_the_history_has_the_newest_error_first_and_holds_eight(wire) -> None:
    wire.nmt(0x01, 1)
    codes = []
    for k in range(5):
        for data, code in ((SHORT, 0x8210), (RIGHT + b"\x00", 0x8220)):
            wire.send(0x201, data)
            wire.send(0x201, RIGHT)
            codes.insert(0, code)
        assert wire.read(1, 0x1003, 0) == min(2 * k + 2, 8)
    assert [wire.read(1, 0x1003, k) & 0xFFFF for k in range(1, 9)] == codes[:8]


def test_the_history_has_what_the_message_said(wire) -> None:
    wire.nmt(0x01, 1)
    for data in (SHORT, RIGHT + b"\x00"):
        ((code, _, information),) = messages(wire.send(0x201, data))
        assert wire.read(1, 0x1003, 1) == code | information << 16


def test_an_entry_that_is_not_there_has_no_data(wire) -> None:
    assert wire.abort_code_of_read(1, 0x1003, 1) == 0x08000024


def test_writing_zero_clears_the_history(wire) -> None:
    wire.nmt(0x01, 1)
    wire.send(0x201, SHORT)
    assert wire.write(1, 0x1003, 0, b"\x01") == 0x06090030
    assert wire.write(1, 0x1003, 0, b"\x00") == 0
    assert wire.read(1, 0x1003) == 0
    assert wire.abort_code_of_read(1, 0x1003, 1) == 0x08000024


def test_within_the_inhibit_time_messages_wait(wire) -> None:
    wire.write(1, 0x1015, 0, struct.pack("<H", 500))
    wire.nmt(0x01, 1)
    assert len(messages(wire.send(0x201, SHORT))) == 1
    assert messages(wire.send(0x201, RIGHT)) == []
    assert messages(wire.send(0x201, SHORT)) == []
    assert [code for code, *_ in messages(wire.wait(0.0501))] == [0]
    assert [code for code, *_ in messages(wire.wait(0.0501))] == [0x8210]
    assert messages(wire.wait(1.0)) == []


def test_1014h_moves_and_silences_the_messages(wire) -> None:
    wire.nmt(0x01, 1)
    assert wire.write(1, 0x1014, 0, struct.pack("<I", 0x0A1)) == 0x06090030, "an existing one keeps its identifier"
    assert wire.write(1, 0x1014, 0, struct.pack("<I", 1 << 31 | 0x081)) == 0
    assert messages(wire.send(0x201, SHORT)) == []
    assert wire.read(1, 0x1001) == 0x11
    assert wire.write(1, 0x1014, 0, struct.pack("<I", 0x0A1)) == 0
    assert messages(wire.send(0x201, RIGHT), 0x0A1) == [(0, 0, 0)]


@pytest.mark.parametrize("cob_id", [0x000, 0x07F, 0x101, 0x5FF, 0x67F, 0x6FF, 0x77F, 1 << 29 | 0x081, 1 << 30 | 0x081])
def test_restricted_identifiers_are_refused(wire, cob_id: int) -> None:
    assert wire.write(1, 0x1014, 0, struct.pack("<I", cob_id)) == 0x06090030


def test_a_stopped_node_sends_none(wire) -> None:
    wire.write(1, 0x1016, 1, struct.pack("<I", 0x7F0000 | 100))
    wire.send(0x77F, b"\x05")
    wire.nmt(0x02, 1)
    assert messages(wire.wait(0.5)) == []


def test_a_reset_of_the_node_ends_all_errors(wire) -> None:
    wire.nmt(0x01, 1)
    wire.send(0x201, SHORT)
    wire.nmt(0x81, 1)
    assert (wire.read(1, 0x1001), wire.read(1, 0x1003)) == (0, 0)


def test_a_reset_of_the_communication_ends_its_errors_and_they_are_told_when_they_come_again(wire) -> None:
    for _ in range(2):
        wire.write(5, 0x1016, 1, struct.pack("<I", 0x7F0000 | 100))
        wire.send(0x77F, b"\x05")
        assert messages(wire.wait(0.2), 0x085) == [(0x8130, 0x11, 0x7F)]
        wire.nmt(0x82, 5)
        assert wire.read(5, 0x1001) == 0
    assert wire.read(5, 0x1003) == 2


def test_an_rpdo_that_stays_away_is_missed_and_welcomed_back(wire) -> None:
    wire.write(2, 0x1400, 5, struct.pack("<H", 20))
    wire.nmt(0x01, 2)
    assert messages(wire.wait(1.0), 0x082) == [], "it is watched from the first one on"
    for _ in range(5):
        wire.send(0x202, RIGHT)
        assert messages(wire.wait(0.019), 0x082) == []
    assert (0x8250, 0x11, 1) in messages(wire.wait(0.002), 0x082)
    assert wire.read(2, 0x1001) & 0x10
    wire.send(0x202, RIGHT)
    wire.send(0x202, struct.pack("<Hh", 0x80, 0))
    assert not wire.read(2, 0x1001) & 0x10
