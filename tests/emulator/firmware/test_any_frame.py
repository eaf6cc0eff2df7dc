"""Whatever comes from the bus, no node fails, and all of them answer afterwards."""

from __future__ import annotations

import random
import struct

SERVICES = (0x080, 0x180, 0x200, 0x300, 0x580, 0x600, 0x700)
SDO_COMMANDS = (0x21, 0x23, 0x2B, 0x2F, 0x40, 0x60, 0x70, 0x80, 0xA0, 0xA1, 0xA2, 0xA4, 0xC1, 0xC2, 0xC6)
OBJECTS = (0x1003, 0x1008, 0x1016, 0x1017, 0x1400, 0x1600, 0x1800, 0x1801, 0x1A00, 0x6040, 0x6060, 0x6001, 0x6200)


def random_frame(rng: random.Random) -> tuple[int, bytes]:
    """Half noise, half SDO that nearly makes sense, now and then an NMT command."""
    kind = rng.random()
    if kind < 0.03:
        return 0x000, bytes((rng.choice((0x01, 0x01, 0x02, 0x80, 0x81, 0x82)), rng.choice((0, 1, 5))))
    if kind < 0.5:
        head = struct.pack("<BHB", rng.choice(SDO_COMMANDS), rng.choice(OBJECTS), rng.choice((0, 1, 2, 5)))
        return 0x600 + rng.randint(1, 6), head + bytes(rng.choice((0, 1, 2, 0x7F, 0x80, 0xFF)) for _ in range(4))
    data = rng.randbytes(rng.randint(0, 8))
    return rng.choice(SERVICES) + rng.randint(0, 7), data


def test_noise_on_the_bus_breaks_no_node(wire) -> None:
    rng = random.Random(20261121)
    for number in range(30_000):
        wire.devices.receive(*random_frame(rng))
        if number % 50 == 0:
            wire.wait(0.001 * rng.randint(1, 20))
    wire.nmt(0x81)
    for node_id in range(1, 7):
        assert wire.read(node_id, 0x1000) in (0x00020192, 0x00010196)
    wire.enable(1)


def test_a_reset_ends_a_block_download_that_the_client_has_forgotten(wire) -> None:
    wire.send(0x601, bytes.fromhex("c6876000 04000000"))
    wire.nmt(0x82, 1)
    assert wire.read(1, 0x6087) == 10000
