"""Services of the nodes as a master sees them on a bus: remote frames, stored parameters, numbered SYNCs."""

from __future__ import annotations

import struct
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from emulator.firmware.storage import FolderMemory
from hil.bench.lockstep import LockstepBench
from hil.network import load_network


def frame(can_id: int, data: bytes = b"", remote: bool = False) -> can.Message:
    return can.Message(arbitration_id=can_id, data=data, is_remote_frame=remote, is_extended_id=False)


def answer(bus: can.BusABC, can_id: int, timeout: float = 1.0) -> bytes | None:
    while (message := bus.recv(timeout)) is not None:
        if message.arbitration_id == can_id:
            return bytes(message.data)
    return None


def download(bus: can.BusABC, node_id: int, index: int, subindex: int, data: bytes) -> None:
    command = 0x23 | (4 - len(data)) << 2
    bus.send(frame(0x600 + node_id, struct.pack("<BHB", command, index, subindex) + data.ljust(4, b"\x00")))
    got = answer(bus, 0x580 + node_id)
    assert got is not None
    assert got[0] == 0x60, got.hex()


@pytest.mark.parametrize("delays", [False, True], ids=["at once", "with bit times"])
def test_a_node_is_guarded_by_remote_frames(delays: bool) -> None:
    with LockstepBench(Flywheels(), delays=delays) as bench:
        answer(bench.bus, 0x706)
        for toggle in (0, 0x80, 0):
            bench.bus.send(frame(0x705, remote=True))
            assert answer(bench.bus, 0x705) == bytes((0x7F | toggle,))


@pytest.mark.parametrize("delays", [False, True], ids=["at once", "with bit times"])
def test_a_tpdo_comes_on_request(delays: bool) -> None:
    with LockstepBench(Flywheels(), delays=delays) as bench:
        download(bench.bus, 5, 0x1800, 1, struct.pack("<I", 0x185))
        bench.bus.send(frame(0x000, b"\x01\x05"))
        answer(bench.bus, 0x185)
        bench.bus.send(frame(0x185, remote=True))
        got = answer(bench.bus, 0x185)
        assert got is not None
        assert int.from_bytes(got, "little") == bench.vehicle.encoders[0].position()


def test_a_remote_frame_with_a_long_identifier_is_for_nobody() -> None:
    with LockstepBench(Flywheels()) as bench:
        answer(bench.bus, 0x706)
        bench.bus.send(can.Message(arbitration_id=0x705, is_remote_frame=True, is_extended_id=True))
        assert bench.bus.recv(0.1) is None


def test_parameters_survive_the_bench(tmp_path: Path) -> None:
    with LockstepBench(Flywheels(), memory=FolderMemory(tmp_path)) as bench:
        download(bench.bus, 3, 0x1017, 0, struct.pack("<H", 40))
        download(bench.bus, 3, 0x1010, 1, b"save")
    with LockstepBench(Flywheels(), memory=FolderMemory(tmp_path)) as bench:
        start = bench.clock.now()
        beats = [answer(bench.bus, 0x703) for _ in range(6)]
        assert beats == [b"\x00"] + [b"\x7f"] * 5
        assert bench.clock.now() - start == pytest.approx(0.2, abs=0.005)


def test_numbered_syncs_move_time_as_others_do() -> None:
    network = load_network()
    with LockstepBench(Flywheels()) as bench:
        download(bench.bus, 5, 0x1019, 0, b"\x0a")
        download(bench.bus, 5, 0x1800, 2, b"\x01")
        bench.bus.send(frame(0x000, b"\x01\x05"))
        stamps = []
        for number in (1, 2, 3):
            bench.bus.send(frame(network.sync_cob_id, bytes((number,))))
            stamps.append(bench.clock.now())
            assert answer(bench.bus, 0x185, 0.0005) is not None
        assert stamps[2] - stamps[1] == pytest.approx(network.cycle_period)
