"""A drive alone: its ports for a shaft, its frames beside those of the emulator's firmware on the same motion."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from emulator.drive import Drive
from emulator.firmware.description import NetworkDescription, read_network_description
from emulator.firmware.network import DeviceNetwork
from emulator.noise import Disturbances
from fmu.bus.packaging import build_bus_fmu
from fmu.bus.shaft_plant import shaft_plant
from fmu.compiling import find_compiler
from fmu.platforms import host_platform
from hil.cosimulation.instance import FmuError
from hil.lsbus.devices import LsBusDevices
from hil.lsbus.instance import BusFmuInstance
from hil.lsbus.system import STEP, drive_on_bus
from hil.network import DEFAULT_NETWORK
from ident.errors import DataFileError
from tests.hil.lsbus.stimuli import CYCLE, ENABLE, QUICK_STOP, SYNC, command, to_operation_enabled
from tests.hil.lsbus.twins import Twin, Wait, silent_prototype

NODE = 3


@pytest.fixture(scope="module")
def drive_fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drive") / "drive_fr.fmu"
    system = drive_on_bus(silent_prototype(), DEFAULT_NETWORK, "drive_fr")
    path.write_bytes(build_bus_fmu(shaft_plant("drive_fr"), system, {}, (host_platform(),), find_compiler()))
    return path


class HeldShaft:
    """A shaft whose angle goes on at the speed that was told, as the FMU's does."""

    def __init__(self) -> None:
        self.step_size = STEP
        self.angle = self.speed = 0.0

    def wheel_angle(self, _wheel: int) -> float:
        return self.angle

    def wheel_rate(self, _wheel: int) -> float:
        return self.speed


class OneDrive:
    """Hardware of one drive on that shaft."""

    def __init__(self, shaft: HeldShaft) -> None:
        prototype = silent_prototype()
        data = replace(prototype.drive, directions=(1, 1, 1, 1))
        noise = Disturbances(prototype, seed=1, scale=0.0, step=STEP)
        self._shaft = shaft
        self.drives: Sequence[Drive] = (Drive(data, prototype.power_stage, 0, 1.0, shaft, noise),) * 4
        self.encoders = ()
        self.time = self._owed = 0.0

    def advance(self, duration: float) -> None:
        self._owed += duration
        while self._owed > STEP - 1e-9:
            self._owed -= STEP
            self.drives[0].advance()
            self._shaft.angle += self._shaft.speed * STEP


@pytest.fixture
def alone(drive_fmu: Path) -> Iterator[BusFmuInstance]:
    with BusFmuInstance(drive_fmu, {}) as instance:
        yield instance


def test_it_sends_what_the_emulator_s_drive_sends_while_its_shaft_moves(alone: BusFmuInstance) -> None:
    described = read_network_description(DEFAULT_NETWORK)
    node = NetworkDescription(tuple(one for one in described.nodes if one.node_id == NODE))
    shaft = HeldShaft()
    hardware = OneDrive(shaft)
    ours, theirs = Twin(), Twin()
    ours.devices = LsBusDevices(alone, ours.hear)
    theirs.devices = DeviceNetwork(hardware, node, theirs.hear)
    assert ours.sent == theirs.sent == [(0.0, 0x700 + NODE, b"\x00")]
    ours.sent, theirs.sent = [], []
    port = alone.port(["angle", "speed"])
    for stimulus in to_operation_enabled([NODE]):
        assert ours.take(stimulus) == theirs.take(stimulus)
    for cycle in range(400):
        angle, speed = 3.0 * np.sin(0.02 * cycle), 3.0 * 0.02 / CYCLE * np.cos(0.02 * cycle)
        shaft.angle, shaft.speed = float(angle), float(speed)
        alone.write(port, [shaft.angle, shaft.speed])
        word = ENABLE if cycle < 300 else QUICK_STOP
        for stimulus in (command(NODE, word, round(800 * np.sin(0.05 * cycle))), Wait(CYCLE), SYNC):
            assert ours.take(stimulus) == theirs.take(stimulus), f"cycle {cycle}"
        if cycle < 300:
            # The port has the mean of the last millisecond, the firmware the torque at its end.
            torque = alone.read(alone.port(["torque"]))[0]
            assert torque == pytest.approx(hardware.drives[0].torque, abs=0.05)


def test_torque_and_power_are_those_of_the_shaft(alone: BusFmuInstance) -> None:
    sent: list[tuple[int, bytes]] = []
    devices = LsBusDevices(alone, lambda can_id, data: sent.append((can_id, data)))
    alone.write(alone.port(["speed", "torque_gain"]), [10.0, 0.5])
    for stimulus in to_operation_enabled([NODE]):
        if isinstance(stimulus, Wait):
            devices.advance(devices.time + stimulus.duration)
        else:
            devices.receive(stimulus.can_id, stimulus.data)  # type: ignore[union-attr]
    for _ in range(30):
        devices.receive(command(NODE, ENABLE, 500).can_id, command(NODE, ENABLE, 500).data)
        devices.receive(SYNC.can_id, b"")
        devices.advance(round(devices.time + CYCLE, 9))
    torque, on_shaft, power, turned = alone.read(alone.port(["torque", "shaft_torque", "power", "turned"]))
    assert torque == pytest.approx(0.5 * 1.27, rel=1e-2)
    assert on_shaft == pytest.approx(0.5 * torque)
    assert power == pytest.approx(10.0 * on_shaft)
    assert turned == pytest.approx(10.0 * devices.time)
    reported = struct.unpack("<Hhi", next(data for can_id, data in reversed(sent) if can_id == 0x180 + NODE))
    assert reported[2] == pytest.approx(10.0 * devices.time / (2 * np.pi) * 1048576, rel=0.05)


def test_what_the_drive_sets_nobody_else_sets(alone: BusFmuInstance) -> None:
    with pytest.raises(FmuError, match="set by the drives"):
        alone.write(alone.port(["torque"]), [1.0])


def test_an_encoder_is_no_drive() -> None:
    with pytest.raises(DataFileError, match="drive_fl"):
        drive_on_bus(silent_prototype(), DEFAULT_NETWORK, "encoder_left")
