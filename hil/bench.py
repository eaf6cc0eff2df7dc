"""The bench: an emulated vehicle behind a CAN bus, in lockstep inside this process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import can

from emulator.firmware.description import read_network_description
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.network import DeviceNetwork
from hil.buses.lockstep import LockstepHub
from hil.clock import SimulatedClock
from hil.network import DEFAULT_NETWORK, load_network


class LockstepBench:
    """A vehicle, its CANopen nodes, and a bus whose SYNC moves their time.

    Args:
        vehicle: the hardware that the nodes sit on; the caller closes it.
        network: network file, for the nodes and for bit rate and cycle period of the bus.

    Attributes:
        bus: the master's endpoint.
        clock: simulated time of the bench.
        vehicle: the hardware given.
        devices: the nodes on it, for tests that break something.

    Raises:
        DataFileError: the network file is missing or malformed.
    """

    def __init__(self, vehicle: VehicleHardware, network: Path = DEFAULT_NETWORK) -> None:
        self.vehicle = vehicle
        described = load_network(network)
        self._hub = LockstepHub(described.cycle_period, described.bit_rate, described.sync_cob_id)
        self.bus: can.BusABC = self._hub.open()
        self.clock: SimulatedClock = self._hub.clock
        description = read_network_description(network)

        def make(send: Callable[[int, bytes], None]) -> DeviceNetwork:
            self.devices = DeviceNetwork(vehicle, description, send)
            return self.devices

        self._hub.attach(make)

    def open_bus(self) -> can.BusABC:
        """A further endpoint of the bus, for a listener or a second master."""
        return self._hub.open()

    def close(self) -> None:
        """Take the master's endpoint off the bus."""
        self.bus.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
