"""Whatever comes from the bus, no node fails, memory stays bounded, and all of them answer afterwards."""

from __future__ import annotations

import gc
import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

SERVICES = (0x000, 0x080, 0x100, 0x180, 0x200, 0x300, 0x400, 0x500, 0x580, 0x600, 0x700, 0x7E0)
SDO_COMMANDS = (0x00, 0x01, 0x10, 0x20, 0x21, 0x23, 0x2B, 0x2F, 0x40, 0x60, 0x70, 0x80, 0x81, 0xA0, 0xA1, 0xA2, 0xA3)
SDO_COMMANDS += (0xA4, 0xC0, 0xC1, 0xC2, 0xC6, 0xE0)
LSS_COMMANDS = (0x04, 0x04, 0x11, 0x11, 0x13, 0x17, *range(0x40, 0x44), *range(0x46, 0x4D), 0x51, *range(0x5A, 0x5F))
IDENTITIES = (bytes(6), b"\x00\xff\x7f\x00\x00\x00", b"\x00\x26\x20\x80\x00\x00", b"\xff\xff\xff\x1f\x00\x01")
OBJECTS = (0x1003, 0x1005, 0x1006, 0x1008, 0x100C, 0x100D, 0x1010, 0x1011, 0x1014, 0x1015, 0x1016, 0x1017, 0x1019)
OBJECTS += (0x1021, 0x1029, 0x1400, 0x1401, 0x1600, 0x1800, 0x1801, 0x1A00, 0x1A01, 0x2000, 0x6007, 0x6040, 0x6060)
OBJECTS += (0x6071, 0x607A, 0x60FF, 0x6001, 0x6003, 0x6200)
VALUES = (
    b"save",
    b"load",
    bytes(4),
    b"\xff\xff\xff\xff",
    b"\x80\x00\x00\x40",
    b"\x10\x00\x40\x60",
    b"\x10\x00\x41\x60",
)
VALUES += (b"\x80\x00\x00\x00", b"\x81\x01\x00\x00", b"\x01\x00\x00\x00", b"\xe8\x03\x7f\x00", b"\x0f\x00\x00\x00")


@pytest.fixture(scope="module")
def shared_wire(wire_type):
    return wire_type()


def sensible(rng: random.Random) -> tuple[int, bytes]:
    """A frame that means something to a node."""
    kind = rng.random()
    if kind < 0.02:
        return 0x000, bytes((rng.choice((0x01, 0x01, 0x02, 0x80, 0x81, 0x82)), rng.choice((0, 1, 5))))
    if kind < 0.12:
        return 0x080, rng.choice((b"", b"", b"", b"\x01"))
    if kind < 0.3:
        return 0x200 + rng.randint(1, 6), struct.pack("<Hh", rng.choice((0x06, 0x07, 0x0F, 0x80, 0x02)), 100)
    if kind < 0.35:
        return 0x700 + rng.choice((1, 5, 0x7F)), b"\x05"
    if kind < 0.38:
        return 0x7E5, bytes((rng.choice(LSS_COMMANDS), rng.choice((0, 0, 1, 5, 77, 0xFF)))) + rng.choice(IDENTITIES)
    head = struct.pack("<BHB", rng.choice(SDO_COMMANDS), rng.choice(OBJECTS), rng.choice((0, 0, 1, 2, 5, 6)))
    return 0x600 + rng.randint(1, 6), head + rng.choice(VALUES)


def mutated(rng: random.Random, can_id: int, data: bytes) -> tuple[int, bytes]:
    """The same with a bit flipped, cut off, made longer, or under another identifier."""
    kind = rng.randrange(4)
    if kind == 0 and data:
        flipped = bytearray(data)
        flipped[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return can_id, bytes(flipped)
    if kind == 1:
        return can_id, data[: rng.randint(0, len(data))]
    if kind == 2:
        return can_id, (data + rng.randbytes(8))[:8]
    return (can_id ^ 1 << rng.randrange(11)) & 0x7FF, data


def noise(rng: random.Random) -> tuple[int, bytes]:
    return rng.choice(SERVICES) + rng.randint(0, 7), rng.randbytes(rng.randint(0, 8))


def any_frame(rng: random.Random) -> tuple[int, bytes]:
    kind = rng.random()
    if kind < 0.4:
        return sensible(rng)
    return mutated(rng, *sensible(rng)) if kind < 0.7 else noise(rng)


def torment(wire, rng: random.Random, frames: int) -> None:
    for number in range(frames):
        if number % 97 == 0:
            wire.devices.receive_remote(rng.choice((0x181, 0x281, 0x701, 0x705, 0x601)))
        wire.devices.receive(*any_frame(rng))
        if number % 50 == 0:
            wire.devices.advance(round(wire.devices.time + 0.001 * rng.randint(1, 20), 9))
            wire.sent.clear()


def objects_alive() -> int:
    gc.collect()
    return len(gc.get_objects())


def give_back_its_node_id(wire, node_id: int, product: int) -> None:
    """LSS may have made every device another node; it is still found by its identity."""
    wire.send(0x7E5, b"\x04" + bytes(7))
    for command, number in enumerate((0x7FFF0001, product, 0x00010000, 0x20260000 + node_id), 0x40):
        wire.send(0x7E5, struct.pack("<BI3x", command, number))
    for command in (0x11, 0x17):
        frames = wire.send(0x7E5, bytes((command, node_id)) + bytes(6))
        assert (0x7E4, bytes((command,)) + bytes(7)) in frames
    wire.send(0x7E5, b"\x04" + bytes(7))
    wire.devices.power_off(node_id)
    wire.devices.power_on(node_id)


def everything_works(wire) -> None:
    """After new supply, and without what may have been stored, every node boots, answers, and the drives run."""
    for node_id, product in ((1, 0x402), (2, 0x402), (3, 0x402), (4, 0x402), (5, 0x406), (6, 0x406)):
        give_back_its_node_id(wire, node_id, product)
    for node_id in range(1, 7):
        wire.nmt(0x80)
        wire.send(0x600 + node_id, b"\x80" + bytes(7))
        wire.write(node_id, 0x1011, 1, b"load")
        wire.devices.power_off(node_id)
        wire.frames()
        wire.devices.power_on(node_id)
        assert (0x700 + node_id, b"\x00") in wire.frames()
        assert wire.read(node_id, 0x1000) in (0x00020192, 0x00010196)
    for node_id in range(1, 5):
        wire.enable(node_id)


def test_twenty_thousand_frames_break_no_node(wire) -> None:
    torment(wire, random.Random(20261121), 20_000)
    everything_works(wire)


@pytest.mark.slow
def test_a_million_frames_break_no_node_and_fill_no_memory(wire) -> None:
    rng = random.Random(1)
    torment(wire, rng, 100_000)
    before = objects_alive()
    torment(wire, rng, 900_000)
    assert objects_alive() < before + 20_000
    everything_works(wire)


@pytest.mark.parametrize("seed", range(5))
def test_a_transfer_goes_on_while_noise_goes_past_it(wire, seed: int) -> None:
    """Nothing but its own SDO channel and NMT commands touches a transfer."""
    rng = random.Random(seed)
    text = bytes(97 + k % 26 for k in range(200))
    wire.send(0x605, bytes.fromhex("2000200000000000"))
    toggle = 0
    for start in range(0, len(text), 7):
        segment = text[start : start + 7]
        for _ in range(50):
            can_id, data = any_frame(rng)
            if can_id not in (0x000, 0x605):
                wire.devices.receive(can_id, data)
        last = start + 7 >= len(text)
        answers = wire.send(0x605, bytes((toggle | 7 - len(segment) << 1 | last,)) + segment.ljust(7, b"\x00"))
        assert (0x585, bytes((0x20 | toggle,)) + bytes(7)) in answers
        toggle ^= 0x10
    assert bytes(wire.devices.nodes[5].object_dictionary.read(0x2000, 0)) == text


@settings(max_examples=150, deadline=None)
@given(st.lists(st.binary(min_size=8, max_size=8), max_size=30))
def test_a_disturbed_transfer_ends_in_an_abort_or_with_what_was_sent(shared_wire, frames: list[bytes]) -> None:
    """Any frames in the channel of a download: the text is the one from before, or made of the bytes that came."""
    wire = shared_wire
    wire.nmt(0x81, 5)
    wire.write(5, 0x2000, 0, b"rest")
    wire.send(0x605, bytes.fromhex("2000200000000000"))
    for frame in frames:
        answers = [data for can_id, data in wire.send(0x605, frame) if can_id == 0x585]
        assert all(len(answer) == 8 for answer in answers)
    stored = bytes(wire.devices.nodes[5].object_dictionary.read(0x2000, 0))
    assert len(stored) <= 256
    assert stored == b"rest" or all(byte in b"".join(frames) for byte in stored)
    wire.send(0x605, bytes.fromhex("8000200000000000"))
    assert wire.read(5, 0x1000) == 0x00010196


def test_pdos_that_answer_each_other_in_a_ring_leave_time_to_breathe(wire) -> None:
    """Two nodes whose TPDO is the SYNC: a storm on a real bus too, but one that takes time and no memory."""
    wire.nmt(0x01)
    for node_id, cob_id in ((5, 0x080), (6, 0x080)):
        wire.write(node_id, 0x1800, 1, struct.pack("<I", 1 << 31 | 0x40000180 + node_id))
        wire.write(node_id, 0x1800, 2, b"\x01")
        wire.write(node_id, 0x1A00, 0, b"\x00")
        wire.write(node_id, 0x1005, 0, struct.pack("<I", 0x080))
        wire.write(node_id, 0x1A00, 1, struct.pack("<I", 0x10010008))
        wire.write(node_id, 0x1A00, 0, b"\x01")
        wire.write(node_id, 0x1019, 0, b"\x0a")
        assert wire.write(node_id, 0x1800, 1, struct.pack("<I", 0x40000000 | cob_id)) == 0
    wire.send(0x080, b"\x01")
    frames = wire.wait(0.1)
    assert 0 < len(frames) < 3 * 0.1 / 135e-6
    everything_works(wire)


def test_a_reset_ends_a_block_download_that_the_client_has_forgotten(wire) -> None:
    before = wire.read(1, 0x6087)
    wire.send(0x601, bytes.fromhex("c6876000 04000000"))
    wire.nmt(0x82, 1)
    assert wire.read(1, 0x6087) == before
