from __future__ import annotations

import struct
from pathlib import Path

import pytest

from emulator.firmware.description import read_network_description
from emulator.firmware.flywheels import Flywheels
from emulator.firmware.network import DeviceNetwork
from emulator.firmware.storage import Memory

NETWORK_FILE = Path(__file__).parents[3] / "hil" / "data" / "network.toml"


class Wire:
    """The devices with nothing but frames and time between them and the test."""

    def __init__(self, memory: Memory | None = None, vehicle: Flywheels | None = None) -> None:
        self.vehicle = Flywheels() if vehicle is None else vehicle
        self.sent: list[tuple[int, bytes]] = []
        self.devices = DeviceNetwork(
            self.vehicle,
            read_network_description(NETWORK_FILE),
            lambda can_id, data: self.sent.append((can_id, data)),
            memory,
        )

    def frames(self) -> list[tuple[int, bytes]]:
        """What has been sent since the last time."""
        frames, self.sent[:] = list(self.sent), []
        return frames

    def send(self, can_id: int, data: bytes = b"") -> list[tuple[int, bytes]]:
        """Put a frame on the bus; what the devices answered."""
        self.frames()
        self.devices.receive(can_id, data)
        return self.frames()

    def remote(self, can_id: int) -> list[tuple[int, bytes]]:
        """Put a remote frame on the bus; what the devices answered."""
        self.frames()
        self.devices.receive_remote(can_id)
        return self.frames()

    def wait(self, duration: float) -> list[tuple[int, bytes]]:
        """Let time pass; what the devices sent meanwhile."""
        self.frames()
        self.devices.advance(round(self.devices.time + duration, 9))
        return self.frames()

    def nmt(self, command: int, node_id: int = 0) -> list[tuple[int, bytes]]:
        return self.send(0x000, bytes((command, node_id)))

    def write(self, node_id: int, index: int, subindex: int, data: bytes) -> int:
        """Expedited SDO download; 0 or the abort code."""
        command = 0x23 | (4 - len(data)) << 2
        frame = struct.pack("<BHB", command, index, subindex) + data.ljust(4, b"\x00")
        answers = [data for can_id, data in self.send(0x600 + node_id, frame) if can_id == 0x580 + node_id]
        assert len(answers) == 1
        assert struct.unpack_from("<HB", answers[0], 1) == (index, subindex)
        return 0 if answers[0][0] == 0x60 else struct.unpack_from("<I", answers[0], 4)[0]

    def read(self, node_id: int, index: int, subindex: int = 0, signed: bool = False) -> int:
        """Expedited SDO upload."""
        frame = struct.pack("<BHB4x", 0x40, index, subindex)
        answers = [data for can_id, data in self.send(0x600 + node_id, frame) if can_id == 0x580 + node_id]
        assert len(answers) == 1
        assert answers[0][0] & 0xF3 == 0x43, f"aborted: {answers[0].hex()}"
        size = 4 - (answers[0][0] >> 2 & 3)
        return int.from_bytes(answers[0][4 : 4 + size], "little", signed=signed)

    def abort_code_of_read(self, node_id: int, index: int, subindex: int = 0) -> int:
        answers = self.send(0x600 + node_id, struct.pack("<BHB4x", 0x40, index, subindex))
        assert answers[0][1][0] == 0x80
        return struct.unpack_from("<I", answers[0][1], 4)[0]

    def make_synchronous(self, node_id: int) -> None:
        """First RPDO and TPDO with every SYNC."""
        for index in (0x1400, 0x1800):
            assert self.write(node_id, index, 2, b"\x01") == 0

    def command(self, node_id: int, controlword: int, torque_permille: int = 0) -> list[tuple[int, bytes]]:
        """RPDO1 with the default mapping, then a SYNC; what was sent with it."""
        self.send(0x200 + node_id, struct.pack("<Hh", controlword, torque_permille))
        return self.send(0x080)

    def enable(self, node_id: int) -> None:
        """Start the node, select torque mode and walk to operation enabled."""
        self.make_synchronous(node_id)
        self.nmt(0x01, node_id)
        assert self.write(node_id, 0x6060, 0, b"\x0a") == 0
        for controlword in (0x06, 0x07, 0x0F):
            self.command(node_id, controlword)
        assert self.read(node_id, 0x6041) & 0x6F == 0x27


@pytest.fixture(scope="session")
def wire_type() -> type[Wire]:
    return Wire


@pytest.fixture
def wire() -> Wire:
    return Wire()
