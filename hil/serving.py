"""Serves an emulated vehicle to masters in other processes, in real time or in lockstep with their SYNC."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import can

from emulator.firmware.description import read_network_description
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.network import DeviceNetwork
from hil.buses.frame_kinds import device_frame
from hil.clock import Clock
from hil.faults import FaultInjector
from hil.faults.devices import Slippery
from hil.faults.hardware import TappedVehicle
from hil.network import DEFAULT_NETWORK, load_network
from hil.realtime import steady_memory

_IDLE = 0.001
"""Longest time without looking at the clock [s]: one step of the physics engine."""

_MASTER_PAUSE = 0.2
"""Time without a SYNC [s] after which a lockstep server lets time pass by the clock again."""


@dataclass
class ServingReport:
    """What happened so far.

    Attributes:
        frames: frames taken from the bus.
        syncs: SYNCs among them.
        overruns: times that the simulation was more than a cycle behind the clock.
        worst_lag: largest such lag [s].
    """

    frames: int = 0
    syncs: int = 0
    overruns: int = 0
    worst_lag: float = 0.0


class VehicleServer:
    """Emulated nodes on any python-can bus.

    In real time, simulated time follows the clock. In lockstep it follows the clock until the first SYNC, so
    that boot-up and SDO time-outs elapse, and each SYNC then moves it by one cycle period, as fast as the master
    likes; when a master pauses, the clock takes over until its next SYNC.

    Args:
        vehicle: the hardware; the caller closes it.
        bus: the bus to serve.
        clock: wall time.
        network: network file.
        lockstep: SYNC moves time.
        ground: under its wheels, to be made slippery.
        seed: of the randomness of faults.

    Attributes:
        faults: what can go wrong between the bus and the nodes.
        report: what happened so far.
    """

    def __init__(
        self,
        vehicle: VehicleHardware,
        bus: can.BusABC,
        clock: Clock,
        network: Path = DEFAULT_NETWORK,
        lockstep: bool = False,
        ground: Slippery | None = None,
        seed: int = 0,
    ) -> None:
        described = load_network(network)
        self._bus = bus
        self._clock = clock
        self._lockstep = lockstep
        self._period = described.cycle_period
        self._sync_cob_id = described.sync_cob_id
        description = read_network_description(network)

        def nodes(tapped: TappedVehicle, send: Callable[[int, bytes], None]) -> DeviceNetwork:
            return DeviceNetwork(tapped, description, send)

        self.faults = FaultInjector(nodes, TappedVehicle(vehicle), self._send, described, ground, seed)
        self._devices = self.faults
        self._behind = clock.now() - self._devices.time
        self._stepping = False
        self._last_sync = 0.0
        self.report = ServingReport()

    def serve(self, stop: Callable[[], bool]) -> ServingReport:
        """Serve until `stop()`, which is asked at least every millisecond of idleness."""
        with steady_memory():
            while not stop():
                message = self._bus.recv(_IDLE)
                if message is None:
                    self._follow_clock()
                elif message.is_remote_frame and not message.is_extended_id:
                    self._follow_clock()
                    self._devices.receive_remote(message.arbitration_id)
                elif not (message.is_extended_id or message.is_error_frame):
                    self._take(message.arbitration_id, bytes(message.data))
        return self.report

    def _take(self, can_id: int, data: bytes) -> None:
        self.report.frames += 1
        is_sync = can_id == self._sync_cob_id
        self.report.syncs += is_sync
        if is_sync and self._lockstep:
            self._step()
        else:
            self._follow_clock()
        self._devices.receive(can_id, data)

    def _step(self) -> None:
        if self._stepping:
            self._devices.advance(round(self._devices.time + self._period, 9))
        self._stepping = True
        self._last_sync = self._clock.now()

    def _follow_clock(self) -> None:
        now = self._clock.now()
        if self._stepping:
            if now - self._last_sync < _MASTER_PAUSE:
                return
            # The master pauses: the clock counts on from the instant that the SYNCs have reached.
            self._stepping = False
            self._behind = now - self._devices.time
        self._advance_to(now - self._behind)

    def _advance_to(self, instant: float) -> None:
        lag = instant - self._devices.time
        if lag > self._period:
            self.report.overruns += 1
            self.report.worst_lag = max(self.report.worst_lag, lag)
        self._devices.advance(round(instant, 9))

    def _send(self, can_id: int, data: bytes) -> None:
        self._bus.send(device_frame(can_id, data))
