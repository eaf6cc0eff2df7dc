"""An FMU with a bus terminal behind a bus of ours, in lockstep: what a campaign needs of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import can

from hil.bus.clock import Clock
from hil.bus.lockstep import LockstepHub
from hil.cosimulation.instance import FmuError
from hil.lsbus.devices import LsBusDevices
from hil.lsbus.instance import BusFmuInstance
from hil.network import load_network
from ident.vehicle.geometry import WHEELS

_PREFIX: Final = "fmu-bus:"

_FREE: Final = 1e-9
"""Friction of the contacts on the jack-stand [-]: a micronewton."""


def is_on_bus(text: str) -> bool:
    """Whether `--plant` names an FMU that brings its devices along."""
    return text.startswith(_PREFIX)


def bus_plant_path(text: str) -> Path:
    """The FMU that `fmu-bus:FILE` names.

    Raises:
        FmuError: the text is not of that form.
    """
    if not is_on_bus(text):
        raise FmuError(f"{text!r} is no plant on a bus.", "Write fmu-bus:FILE, with an FMU of `quasiomni fmu --bus`.")
    return Path(text.removeprefix(_PREFIX))


class BusFmuOperator:
    """Hands on the vehicle inside the FMU: its tunable parameters and inputs."""

    def __init__(self, instance: BusFmuInstance) -> None:
        self._instance = instance
        self._friction = instance.port([f"friction_limit_{wheel}" for wheel in WHEELS])
        self._floor = instance.read(self._friction)
        self._payload = instance.port(["payload"])

    def lift(self) -> None:
        """On the jack-stand: nothing under the wheels has grip."""
        self._instance.write(self._friction, [_FREE] * len(WHEELS))

    def lower(self) -> None:
        """On the floor."""
        self._instance.write(self._friction, self._floor)

    def load(self, mass: float) -> None:
        """A load over the centre [kg]."""
        self._instance.write(self._payload, [mass])

    def unload(self) -> None:
        """Without it."""
        self.load(0.0)


@dataclass(frozen=True)
class BusFmuBench:
    """Bus, clock and hands."""

    bus: can.BusABC
    clock: Clock
    operator: BusFmuOperator


@contextmanager
def bus_fmu_bench(fmu: Path, seed: int, network: Path) -> Iterator[BusFmuBench]:
    """The FMU behind an in-process bus whose SYNC moves its time.

    Args:
        fmu: with a bus terminal, of a whole vehicle.
        seed: of the noise of its readings.
        network: network file; says bit rate, cycle period and SYNC.

    Raises:
        FmuError: it cannot be run, has no bus terminal, or no vehicle in it.
        DataFileError: the network file is missing or malformed.
    """
    described = load_network(network)
    hub = LockstepHub(described.cycle_period, described.bit_rate, described.sync_cob_id)
    with BusFmuInstance(fmu, {}, seed=seed) as instance:
        operator = BusFmuOperator(instance)
        bus = hub.open()
        hub.attach(lambda send: LsBusDevices(instance, send))
        try:
            yield BusFmuBench(bus, hub.clock, operator)
        finally:
            bus.shutdown()
