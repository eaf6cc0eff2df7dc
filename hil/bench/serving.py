"""Serves an emulated vehicle to masters in other processes, in real time or in lockstep with their SYNC."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import can

from emulator.firmware.description import read_network_description
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.network import DeviceNetwork
from emulator.firmware.storage import Memory
from hil.bus.clock import Clock
from hil.bus.frame_kinds import ERROR_FRAME, EXTENDED, REMOTE, STANDARD_MASK, device_frame
from hil.bus.realtime import steady_memory
from hil.bus.traffic import Hear
from hil.bus.unix import UnixHub
from hil.bus.wire import Wire
from hil.bus.wired import Devices, WiredDevices
from hil.faults import FaultInjector
from hil.faults.devices import Slippery
from hil.faults.hardware import TappedVehicle
from hil.network import DEFAULT_NETWORK, load_network

_IDLE = 0.001
"""Longest time without looking at the clock [s]: one step of the physics engine."""

_BEFORE_SYNC = 1e-6
"""How far from the next SYNC the wire is left alone [s]."""

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


class Port(Protocol):
    """Frames as (identifier with the flags of `can_frame`, data): no message is built for each."""

    def take(self, timeout: float) -> tuple[int, bytes] | None:
        """The next frame; None after `timeout` [s]."""

    def send_data(self, can_id: int, data: bytes) -> None:
        """Send a frame."""

    def burst(self) -> AbstractContextManager[None]:
        """Inside, frames may be collected and sent together at the end."""


class _BusPort:
    """Any python-can bus as port."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def take(self, timeout: float) -> tuple[int, bytes] | None:
        message = self._bus.recv(timeout)
        if message is None:
            return None
        flags = EXTENDED * message.is_extended_id | REMOTE * message.is_remote_frame
        return message.arbitration_id | flags | ERROR_FRAME * message.is_error_frame, bytes(message.data)

    def send_data(self, can_id: int, data: bytes) -> None:
        self._bus.send(device_frame(can_id, data))

    def burst(self) -> AbstractContextManager[None]:
        return contextlib.nullcontext()


class _HeardPort:
    """A port that somebody listens at: whatever passes, in the order in which it does.

    Args:
        port: what passes it.
        hear: called with identifier, with flags, and data of each frame.
    """

    def __init__(self, port: Port, hear: Hear) -> None:
        self._port = port
        self._hear = hear
        self.burst = port.burst

    def take(self, timeout: float) -> tuple[int, bytes] | None:
        frame = self._port.take(timeout)
        if frame is not None:
            self._hear(*frame)
        return frame

    def send_data(self, can_id: int, data: bytes) -> None:
        self._hear(can_id, data)
        self._port.send_data(can_id, data)


class VehicleServer:
    """Emulated nodes on any python-can bus.

    In real time, simulated time follows the clock. In lockstep it follows the clock until the first SYNC, so
    that boot-up and SDO time-outs elapse, a cycle period at once at most, and each SYNC then moves it by one cycle
    period, as fast as the master likes; when a master pauses, the clock takes over until its next SYNC.

    Args:
        vehicle: the hardware; the caller closes it.
        bus: the bus to serve.
        clock: wall time.
        network: network file.
        lockstep: SYNC moves time.
        ground: under its wheels, to be made slippery.
        seed: of the randomness of faults.
        delays: frames wait for arbitration and take their bit times, in simulated time.
        memory: where the nodes store parameters (1010h); without one they outlive resets only.
        hear: called with every frame as it passes, of both sides.

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
        delays: bool = False,
        memory: Memory | None = None,
        hear: Hear | None = None,
    ) -> None:
        described = load_network(network)
        port: Port = bus if isinstance(bus, UnixHub) else _BusPort(bus)
        self._port: Port = port if hear is None else _HeardPort(port, hear)
        self._clock = clock
        self._lockstep = lockstep
        self._period = described.cycle_period
        self._sync_cob_id = described.sync_cob_id
        description = read_network_description(network)

        def nodes(tapped: TappedVehicle, send: Callable[[int, bytes], None]) -> DeviceNetwork:
            return DeviceNetwork(tapped, description, send, memory)

        def make(send: Callable[[int, bytes], None]) -> FaultInjector:
            self.faults = FaultInjector(nodes, TappedVehicle(vehicle), send, described, ground, seed)
            return self.faults

        self._wired: WiredDevices | None = None
        self._devices: Devices
        if delays:
            wire = Wire(described.bit_rate)
            self._devices = self._wired = WiredDevices(make, wire, self._send_at, vehicle.time)
        else:
            self._devices = make(self._port.send_data)
        self._grid = self._devices.time
        self._behind = 0.0
        self._served = False
        self._stepping = False
        self._last_sync = 0.0
        self.report = ServingReport()

    def serve(self, stop: Callable[[], bool]) -> ServingReport:
        """Serve until `stop()`, which is asked at least every millisecond of idleness."""
        with steady_memory():
            if not self._served:
                # Simulated time begins here: putting memory in order has taken real time.
                self._served, self._behind = True, self._clock.now() - self._devices.time
            while not stop():
                frame = self._port.take(self._patience())
                if frame is None:
                    self._follow_clock()
                elif frame[0] <= STANDARD_MASK:
                    self._take(*frame)
                elif frame[0] & ~REMOTE <= STANDARD_MASK:
                    self._follow_clock()
                    self._devices.receive_remote(frame[0] & STANDARD_MASK)
        return self.report

    def _patience(self) -> float:
        """How long there is nothing to do but to wait for a frame [s]."""
        if self._wired is None or self._stepping:
            return _IDLE
        return min(max(self._wired.next_event() + self._behind - self._clock.now(), 0.0), _IDLE)

    def _take(self, can_id: int, data: bytes) -> None:
        self.report.frames += 1
        if can_id != self._sync_cob_id:
            self._follow_clock()
            self._devices.receive(can_id, data)
        else:
            self.report.syncs += 1
            with self._port.burst():
                self._take_sync(can_id, data)
        if self._wired is not None and self._stepping:
            # Nothing else moves time before the next SYNC, and the master waits for what is on the wire.
            self._wired.settle(self._grid + self._period - _BEFORE_SYNC)

    def _take_sync(self, can_id: int, data: bytes) -> None:
        self._move()
        self._devices.receive(can_id, data)

    def _move(self) -> None:
        """Let the vehicle move up to a SYNC."""
        if self._lockstep:
            self._step()
        else:
            self._follow_clock()

    def _step(self) -> None:
        if self._stepping:
            self._grid = round(self._grid + self._period, 9)
            self._devices.advance(max(self._grid, self._devices.time))
        else:
            self._grid = self._devices.time
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
        if self._lockstep:
            # Nothing here keeps to the clock: a machine that is too slow for it answers, and leaves the rest out.
            self._behind = max(self._behind, now - self._devices.time - self._period)
        self._advance_to(now - self._behind)

    def _advance_to(self, instant: float) -> None:
        lag = instant - self._devices.time
        if lag > self._period:
            self.report.overruns += 1
            self.report.worst_lag = max(self.report.worst_lag, lag)
        self._devices.advance(round(instant, 9))

    def _send_at(self, can_id: int, data: bytes, _instant: float) -> None:
        self._port.send_data(can_id, data)
