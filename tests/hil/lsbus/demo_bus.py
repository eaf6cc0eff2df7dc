"""The bus simulation among the example FMUs of FMI-LS-BUS, built from its sources, between an FMU and a master."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fmpy import read_model_description, simulation

from fmu.compiling import HEADERS
from hil.lsbus.instance import BusFmuInstance
from hil.lsbus.operations import CanFrame, baud_rate, frames, transmit
from tests.hil.lsbus.twins import Data, Remote, Stimulus, Wait

LAYERED_HEADERS = Path(__file__).parent / "headers"
TERMINALS = ("Node1", "Node2")
MEMBERS = ("Rx_Data", "Rx_Clock", "Tx_Data", "Tx_Clock")
CHANGED = 2
"""fmi3IntervalChanged."""

Heard = tuple[float, CanFrame]
"""Instant [s], and a frame."""


def build_demo_bus(examples: Path, folder: Path, compiler: str) -> Path:
    """The example FMU `DemoCanBusSimulation` as a folder: sources and description as they are, and a library of them.

    Its C calls a string function by the name that it has on Windows alone.
    """
    sources = examples / "can-bus-simulation"
    shutil.copytree(sources / "src", folder / "sources")
    shutil.copy(sources / "description" / "modelDescription.xml", folder)
    root = ElementTree.parse(sources / "description" / "buildDescription.xml").getroot()
    units = [str(entry.get("name")) for entry in root.iter("SourceFile")]
    library = folder / "binaries" / "x86_64-linux" / "DemoCanBusSimulation.so"
    library.parent.mkdir(parents=True)
    call = [compiler, "-std=gnu11", "-O1", "-w", "-shared", "-fPIC", "-I", HEADERS, "-I", LAYERED_HEADERS]
    names = ["-DFMI3_OVERRIDE_FUNCTION_PREFIX", "-D_strdup=strdup"]
    subprocess.run([*call, *names, "-o", library, *units], cwd=folder / "sources", check=True)
    return folder


class DemoBus:
    """An instance of it, in event mode except within `advance`."""

    def __init__(self, folder: Path) -> None:
        description = read_model_description(str(folder), validate=False)
        self._references = {row.name: row.valueReference for row in description.modelVariables}
        self._instance: Any = simulation.instantiate_fmu(str(folder), description, "CoSimulation", event_mode_used=True)
        self._instance.enterInitializationMode()
        self._instance.exitInitializationMode()
        self.time = 0.0
        self.next_tick = float("inf")

    def give(self, terminal: str, data: bytes) -> None:
        """Operations of a node."""
        _, rx_clock, *_ = places = self._places(terminal)
        self._instance.setClock([rx_clock], [True])
        self._instance.setBinary([places[0]], [data])
        self._update()

    def take(self) -> dict[str, bytes]:
        """Both clocks tick: what each node gets."""
        places = [self._places(terminal) for terminal in TERMINALS]
        self._instance.setClock([place[3] for place in places], [True, True])
        self.next_tick = float("inf")
        data = [self._instance.getBinary([place[2]])[0] or b"" for place in places]
        self._update()
        return dict(zip(TERMINALS, data, strict=True))

    def advance(self, instant: float) -> None:
        self._instance.enterStepMode()
        self._instance.doStep(self.time, instant - self.time)
        self.time = instant
        self._instance.enterEventMode()

    def close(self) -> None:
        self._instance.terminate()
        self._instance.freeInstance()

    def _places(self, terminal: str) -> tuple[int, ...]:
        return tuple(self._references[f"{terminal}.{member}"] for member in MEMBERS)

    def _update(self) -> None:
        self._instance.updateDiscreteStates()
        clock = (ctypes.c_uint32 * 1)(self._places("Node1")[3])
        interval, qualifier = (ctypes.c_double * 1)(), (ctypes.c_int * 1)()
        self._instance.getIntervalDecimal(clock, interval, qualifier)
        if qualifier[0] == CHANGED:
            self.next_tick = round(self.time + interval[0], 9)


@dataclass
class Traffic:
    """What went over a bus.

    Attributes:
        given: frames that the devices took, and when.
        sent: frames that they gave to the bus, and when.
        heard: frames that reached the master, and when.
    """

    given: list[Heard] = field(default_factory=list)
    sent: list[Heard] = field(default_factory=list)
    heard: list[Heard] = field(default_factory=list)


class Coupling:
    """Devices at the first terminal of the demo bus, a master at the second: an importer's loop in event mode."""

    def __init__(self, bus: DemoBus, devices: BusFmuInstance) -> None:
        self.bus, self.devices, self.traffic = bus, devices, Traffic()
        # The demo bus never sends again where a frame arrives before both nodes have told it their bit rate.
        self._from_devices(before=lambda data: self.bus.give("Node2", _configuration_of(data)))
        self._settle()

    @property
    def time(self) -> float:
        return self.bus.time

    def send(self, frame: CanFrame) -> None:
        """Of the master."""
        self.bus.give("Node2", transmit(frame))
        self._settle()

    def advance(self, instant: float) -> None:
        """Both go from tick to tick."""
        while self.time < instant:
            until = min(self.bus.next_tick, self.devices.next_tick, instant)
            self.bus.advance(until)
            self.devices.advance(until)
            self._settle()

    def play(self, stimuli: Sequence[Stimulus]) -> Traffic:
        for stimulus in stimuli:
            match stimulus:
                case Data(can_id, data):
                    self.send(CanFrame(can_id, data))
                case Remote(can_id):
                    self.send(CanFrame(can_id, remote=True))
                case Wait(duration):
                    self.advance(round(self.time + duration, 9))
        return self.traffic

    def _settle(self) -> None:
        """Whatever is due now."""
        while min(self.bus.next_tick, self.devices.next_tick) <= self.time:
            if self.bus.next_tick <= self.time:
                self._from_bus()
            else:
                self._from_devices()

    def _from_bus(self) -> None:
        data = self.bus.take()
        self.traffic.given += [(self.time, frame) for frame in frames(data["Node1"])]
        self.traffic.heard += [(self.time, frame) for frame in frames(data["Node2"])]
        self.devices.give(data["Node1"])

    def _from_devices(self, before: Callable[[bytes], None] = lambda _: None) -> None:
        data = self.devices.take()
        self.traffic.sent += [(self.time, frame) for frame in frames(data)]
        before(data)
        self.bus.give("Node1", data)


def _configuration_of(data: bytes) -> bytes:
    """The bytes of a node's operations before its first frame: the master configures the same."""
    length = len(data)
    for frame in frames(data):
        length = min(length, data.index(transmit(frame)))
    assert baud_rate(data[:length]) is not None
    return data[:length]


@contextmanager
def coupled(folder: Path, devices: Path) -> Iterator[Coupling]:
    """Devices of an FMU on the demo bus, freshly started."""
    bus = DemoBus(folder)
    try:
        with BusFmuInstance(devices, {}) as instance:
            yield Coupling(bus, instance)
    finally:
        bus.close()
