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
from emulator.firmware.storage import Memory
from hil.bus.clock import SimulatedClock
from hil.bus.lockstep import LockstepHub
from hil.bus.wire import BusLoad
from hil.faults import FaultInjector
from hil.faults.devices import Slippery
from hil.faults.hardware import TappedVehicle
from hil.network import DEFAULT_NETWORK, load_network


class LockstepBench:
    """A vehicle, its CANopen nodes, and a bus whose SYNC moves their time.

    Args:
        vehicle: the hardware that the nodes sit on; the caller closes it.
        network: network file, for the nodes and for bit rate and cycle period of the bus.
        ground: under its wheels, to be made slippery; None where it stands on none.
        seed: of the randomness of faults.
        delays: frames wait for arbitration and take their bit times.
        memory: where the nodes store parameters (1010h); without one they outlive resets only.

    Attributes:
        bus: the master's endpoint.
        clock: simulated time of the bench.
        vehicle: the hardware given.
        faults: what can go wrong between the bus and the nodes.
        devices: the nodes, for tests that look behind the connector.

    Raises:
        DataFileError: the network file is missing or malformed.
    """

    def __init__(
        self,
        vehicle: VehicleHardware,
        network: Path = DEFAULT_NETWORK,
        *,
        ground: Slippery | None = None,
        seed: int = 0,
        delays: bool = False,
        memory: Memory | None = None,
    ) -> None:
        self.vehicle = vehicle
        described = load_network(network)
        self._hub = LockstepHub(described.cycle_period, described.bit_rate, described.sync_cob_id, delays=delays)
        self.bus: can.BusABC = self._hub.open()
        self.clock: SimulatedClock = self._hub.clock
        description = read_network_description(network)

        def nodes(tapped: TappedVehicle, send: Callable[[int, bytes], None]) -> DeviceNetwork:
            return DeviceNetwork(tapped, description, send, memory)

        def make(send: Callable[[int, bytes], None]) -> FaultInjector:
            self.faults = FaultInjector(nodes, TappedVehicle(vehicle), send, described, ground, seed)
            return self.faults

        self._hub.attach(make)
        self.devices = self.faults.devices

    def open_bus(self) -> can.BusABC:
        """A further endpoint of the bus, for a listener or a second master."""
        return self._hub.open()

    def listen(self, hear: Callable[[can.Message], None]) -> None:
        """Call `hear` with a copy of every frame, as it passes."""
        self._hub.listen(hear)

    def attend(self, call: Callable[[], None]) -> None:
        """Call `call` before every move of time: the nodes may be looked at then, and changed."""
        self._hub.attend(call)

    @property
    def load(self) -> BusLoad:
        """How busy the bus was."""
        return self._hub.load

    def close(self) -> None:
        """Take the master's endpoint off the bus."""
        self.bus.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
