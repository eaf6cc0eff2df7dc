from __future__ import annotations

import struct
from collections.abc import Iterator

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench


class Sight:
    """A bench of flywheels, every frame on its bus, and a few words to talk to the nodes."""

    def __init__(self, bench: LockstepBench) -> None:
        self.bench = bench
        self.frames: list[can.Message] = []
        bench.listen(self.frames.append)

    def send(self, can_id: int, data: bytes = b"") -> None:
        self.bench.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def wait(self, duration: float) -> None:
        self.bench.clock.wait_until(round(self.bench.clock.now() + duration, 9))

    def seen(self, can_id: int) -> list[bytes]:
        """Data of the frames with an identifier since the last look, and forget them all."""
        found = [bytes(frame.data) for frame in self.frames if frame.arbitration_id == can_id]
        self.frames.clear()
        return found

    def write(self, node_id: int, index: int, subindex: int, value: int, size: int) -> None:
        command = 0x23 | (4 - size) << 2
        data = struct.pack("<BHB", command, index, subindex) + value.to_bytes(4, "little")
        self.send(0x600 + node_id, data)

    def read(self, node_id: int, index: int, subindex: int = 0) -> int:
        self.frames.clear()
        self.send(0x600 + node_id, struct.pack("<BHB4x", 0x40, index, subindex))
        answer = self.seen(0x580 + node_id)[0]
        return int.from_bytes(answer[4:], "little")


@pytest.fixture
def sight() -> Iterator[Sight]:
    with LockstepBench(Flywheels(), seed=5) as bench:
        yield Sight(bench)
