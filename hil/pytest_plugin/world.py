"""The bench as a test sees it: a vehicle behind a bus, simulated time, and everything that was seen on the way."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import can

from emulator.firmware.network import DeviceNetwork
from emulator.vehicle import EmulatedVehicle, GroundTruth
from hil.bench.lockstep import LockstepBench
from hil.bus.clock import SimulatedClock
from hil.faults import FaultInjector
from hil.faults.injector import Injected
from hil.master.drive_states import decode_state
from hil.network import DRIVES, Network, Node, Role
from hil.network.cia import DriveState, Index, NmtState
from ident.errors import UserError

_SAMPLE_PERIOD: Final = 0.01
_IDLE_STEP: Final = 0.001
_STUCK: Final = 1000
"""Steps of a test's controller that may pass without time passing."""


@dataclass(frozen=True)
class Sample:
    """What only the simulation knows, taken every 10 ms.

    Attributes:
        time: [s].
        speed: of the chassis centre over the floor [m/s].
        states: of the drives fl, rl, fr, rr; None for a pattern that CiA 402 does not know.
        nmt: of all nodes, in the order of the network file; None for one that neither hears nor sends.
    """

    time: float
    speed: float
    states: tuple[DriveState | None, ...]
    nmt: tuple[NmtState | None, ...]


@dataclass(frozen=True)
class Note:
    """Something worth a mark in the timeline: when [s], and what."""

    time: float
    text: str


class Observed(Protocol):
    """What conditions are about: a network in simulated time, and the vehicle behind it."""

    @property
    def frames(self) -> Sequence[can.Message]:
        """Every frame on the bus so far, in the order of the bus."""

    @property
    def network(self) -> Network:
        """The network file."""

    @property
    def now(self) -> float:
        """Simulated time [s]."""

    def frames_until(self, instant: float) -> int:
        """Number of frames whose last bit had passed by `instant` [s]."""

    def drive_state(self, role: Role) -> DriveState | None:
        """State of a drive; None for a pattern that CiA 402 does not know."""

    def object_value(self, role: Role, index: int, subindex: int = 0) -> int:
        """Value of an integer object of a node.

        Raises:
            UserError: it has no such object.
        """

    def truth(self) -> GroundTruth:
        """The true state of motion."""

    def speed(self) -> float:
        """Speed of the chassis centre over the floor [m/s]."""


def object_value(devices: DeviceNetwork, network: Network, role: Role, index: int, subindex: int) -> int:
    """Value of an integer object in the dictionary of an emulated node.

    Raises:
        UserError: it has no such object.
    """
    return devices.nodes[network.node(role).node_id].object_dictionary.value(index, subindex)


class World:
    """A vehicle on a bench, the test's master on its bus, and a record of all that happens.

    Args:
        bench: the bench.
        vehicle: the emulated vehicle on it.
        network: the network file of both.

    Attributes:
        frames: every frame on the bus so far, in the order of the bus.
        samples: truth, every 10 ms.
        notes: marks for the timeline.
    """

    def __init__(self, bench: LockstepBench, vehicle: EmulatedVehicle, network: Network) -> None:
        self._bench = bench
        self.vehicle = vehicle
        self.network = network
        self.frames: list[can.Message] = []
        self.samples: list[Sample] = []
        self.notes: list[Note] = []
        self._step: Callable[[], object] | None = None
        self._next_sample = -math.inf
        self._done: Callable[[], bool] | None = None
        self._reached: float | None = None
        bench.listen(self._hear)

    @property
    def bus(self) -> can.BusABC:
        """The endpoint for the test's master."""
        return self._bench.bus

    @property
    def clock(self) -> SimulatedClock:
        """Simulated time."""
        return self._bench.clock

    @property
    def bench(self) -> LockstepBench:
        """The bench below: load, devices, further endpoints."""
        return self._bench

    @property
    def faults(self) -> FaultInjector:
        """What can go wrong between the bus and the nodes."""
        return self._bench.faults

    @property
    def injected(self) -> list[Injected]:
        """Faults that were injected so far."""
        return self._bench.faults.log

    @property
    def now(self) -> float:
        """Simulated time [s]."""
        return self._bench.clock.now()

    def every_cycle(self, step: Callable[[], object]) -> None:
        """Let `step` be one cycle of what is tested: `run` and expectations call it again and again.

        It has to let simulated time pass, by a SYNC or by waiting for a frame.
        """
        self._step = step

    def run(self, duration: float) -> None:
        """Go on for `duration` [s] of simulated time."""
        self.run_until(lambda: False, duration)

    def run_until(self, done: Callable[[], bool], timeout: float) -> float | None:
        """Go on until `done()`, at most for `timeout` [s] of simulated time.

        It is asked before every step, and every 10 ms within a step that takes long.

        Returns:
            The instant at which `done` held [s], None if it did not in time.

        Raises:
            UserError: the step of `every_cycle` lets no time pass.
        """
        end = round(self.now + timeout, 9)
        self._watch_for(done)
        idle = 0
        try:
            while not self._look() and self.now < end:
                before = self.now
                self._go_on(end)
                idle = idle + 1 if self.now == before else 0
                if idle > _STUCK:
                    raise UserError(
                        "The step given to every_cycle lets no simulated time pass.",
                        "Let it send SYNC, or wait on the bus.",
                    )
        finally:
            self._watch_for(None)
        return self._reached if self._reached is not None and self._reached <= end else None

    def statusword(self, role: Role) -> int:
        """6041h of a drive, from its object dictionary: whatever is mapped into its PDOs."""
        return self.object_value(role, Index.STATUSWORD)

    def object_value(self, role: Role, index: int, subindex: int = 0) -> int:
        """Value of an integer object of a node, from its dictionary: whatever is mapped into its PDOs.

        Raises:
            UserError: it has no such object.
        """
        return object_value(self._bench.devices, self.network, role, index, subindex)

    def drive_state(self, role: Role) -> DriveState | None:
        """State of a drive; None for a pattern that CiA 402 does not know."""
        return decode_state(self.statusword(role))

    def truth(self) -> GroundTruth:
        """The true state of motion."""
        return self.vehicle.ground_truth()

    def frames_until(self, instant: float) -> int:
        """Number of frames whose last bit had passed by `instant` [s]."""
        return bisect_right(self.frames, instant, key=lambda frame: frame.timestamp)

    def speed(self) -> float:
        """Speed of the chassis centre over the floor [m/s]."""
        vx, vy, _ = self.truth().twist
        return math.hypot(vx, vy)

    def note(self, instant: float, text: str) -> None:
        """Mark an instant [s] in the timeline."""
        self.notes.append(Note(instant, text))

    def _go_on(self, end: float) -> None:
        if self._step is not None:
            self._step()
        else:
            self.clock.wait_until(min(round(self.now + _IDLE_STEP, 9), end))
        if self.now >= self._next_sample:
            self._sample()

    def _hear(self, message: can.Message) -> None:
        self.frames.append(message)
        if message.timestamp >= self._next_sample:
            self._sample()

    def _watch_for(self, done: Callable[[], bool] | None) -> None:
        self._done = done
        if done is not None:
            self._reached = None

    def _look(self) -> bool:
        """Whether what is waited for has come, now or before; the first instant counts."""
        if self._reached is None and self._done is not None and self._done():
            self._reached = self.now
        return self._reached is not None

    def _sample(self) -> None:
        self._next_sample = self.now + _SAMPLE_PERIOD
        states = tuple(self.drive_state(role) for role in DRIVES)
        nmt = tuple(self._nmt_state(node) for node in self.network.nodes)
        self.samples.append(Sample(self.now, self.speed(), states, nmt))
        self._look()

    def _nmt_state(self, node: Node) -> NmtState | None:
        """As the node has it, whether it sends heartbeats or not."""
        emulated = self._bench.devices.nodes[node.node_id]
        return NmtState(emulated.nmt.state) if emulated.network.connected else None
