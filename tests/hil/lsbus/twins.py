"""The C devices of an FMU and the emulator's firmware side by side, on plants of the same equations, without noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from emulator.firmware.description import read_network_description
from emulator.firmware.network import DeviceNetwork
from emulator.prototype import NoiseData, Prototype, load_prototype
from hil.cosimulation.plant import FmuVehicle
from hil.lsbus.devices import LsBusDevices
from hil.lsbus.instance import BusFmuInstance
from hil.network import DEFAULT_NETWORK

Frame = tuple[float, int, bytes]
"""Instant [s], identifier, data."""


def silent_prototype() -> Prototype:
    """The prototype without noise."""
    prototype = load_prototype()
    return replace(prototype, noise=NoiseData(0.0, 0.0, 0.0, prototype.noise.load_correlation_time))


class Devices(Protocol):
    @property
    def time(self) -> float: ...

    def receive(self, can_id: int, data: bytes, /) -> None: ...

    def receive_remote(self, can_id: int) -> None: ...

    def advance(self, to_time: float) -> None: ...


@dataclass(frozen=True)
class Data:
    """A data frame of the master."""

    can_id: int
    data: bytes = b""


@dataclass(frozen=True)
class Remote:
    """A remote frame of the master."""

    can_id: int


@dataclass(frozen=True)
class Wait:
    """Time that passes [s]."""

    duration: float


Stimulus = Data | Remote | Wait


@dataclass
class Twin:
    """Devices, and what they have sent since somebody looked."""

    devices: Devices | None = None
    sent: list[Frame] = field(default_factory=list)

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return 0.0 if self.devices is None else round(self.devices.time, 9)

    def hear(self, can_id: int, data: bytes) -> None:
        self.sent.append((self.time, can_id, bytes(data)))

    def take(self, stimulus: Stimulus) -> list[Frame]:
        assert self.devices is not None
        match stimulus:
            case Data(can_id, data):
                self.devices.receive(can_id, data)
            case Remote(can_id):
                self.devices.receive_remote(can_id)
            case Wait(duration):
                self.devices.advance(round(self.devices.time + duration, 9))
        answers, self.sent = self.sent, []
        return answers


@dataclass(frozen=True)
class Twins:
    """The FMU, the emulator's firmware, and what their plants are."""

    in_fmu: Twin
    emulated: Twin
    instance: BusFmuInstance
    vehicle: FmuVehicle

    def agree(self, stimuli: Sequence[Stimulus]) -> list[Frame]:
        """Give both the same stimuli; both answer with the same frames at the same instants, which are returned."""
        told: list[Frame] = []
        for number, stimulus in enumerate(stimuli):
            ours, theirs = self.in_fmu.take(stimulus), self.emulated.take(stimulus)
            assert ours == theirs, f"stimulus {number}: {stimulus}\nC:      {ours}\nPython: {theirs}"
            told += ours
        return told


@contextmanager
def open_twins(bus_fmu: Path, platform: Path) -> Iterator[Twins]:
    """Both, freshly booted; their boot-up messages agree."""
    with ExitStack() as stack:
        instance = stack.enter_context(BusFmuInstance(bus_fmu, {}))
        vehicle = stack.enter_context(FmuVehicle(platform, silent_prototype(), seed=1))
        in_fmu, emulated = Twin(), _emulated(vehicle)
        in_fmu.devices = LsBusDevices(instance, in_fmu.hear)
        twins = Twins(in_fmu, emulated, instance, vehicle)
        boot_up = [(0.0, 0x700 + node_id, b"\x00") for node_id in range(1, 7)]
        assert in_fmu.sent == emulated.sent == boot_up
        in_fmu.sent, emulated.sent = [], []
        yield twins


@contextmanager
def emulated_twin(platform: Path) -> Iterator[Twin]:
    """The emulator's firmware alone, freshly booted; nothing of it has been looked at."""
    with FmuVehicle(platform, silent_prototype(), seed=1) as vehicle:
        yield _emulated(vehicle)


def _emulated(vehicle: FmuVehicle) -> Twin:
    twin = Twin()
    twin.devices = DeviceNetwork(vehicle, read_network_description(DEFAULT_NETWORK), twin.hear)
    return twin
