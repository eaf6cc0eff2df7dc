"""A scenario beside a master in another process: what passes on the served bus is watched while it is served."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import Final

import can

from emulator.vehicle import EmulatedVehicle, GroundTruth
from hil.bench.serving import VehicleServer
from hil.bus.frame_kinds import STANDARD_MASK
from hil.master.drive_states import decode_state
from hil.network import Network, Role
from hil.network.cia import DriveState, Index
from hil.pytest_plugin.world import object_value
from hil.scenario.running import ScenarioReport, all_enabled, inject_faults
from hil.scenario.scenario import Begin, Scenario
from hil.scenario.watching import Outcome, Watch

_LOOK: Final = 0.001
"""Simulated time between two looks [s]."""


class ServedWorld:
    """What can be seen of a vehicle that is served on a bus.

    Args:
        vehicle: the emulated vehicle.
        network: its network file.

    Attributes:
        frames: every data frame so far, in the order in which the server took and sent them.
        server: what serves; set once it is there.
    """

    def __init__(self, vehicle: EmulatedVehicle, network: Network) -> None:
        self._vehicle = vehicle
        self.network = network
        self.frames: list[can.Message] = []
        self.server: VehicleServer | None = None

    @property
    def now(self) -> float:
        """Simulated time [s]."""
        return 0.0 if self.server is None else self.server.faults.time

    def hear(self, can_id: int, data: bytes) -> None:
        """A frame passes; identifiers with flags are those of other kinds of frames."""
        if can_id <= STANDARD_MASK:
            self.frames.append(can.Message(self.now, can_id, is_extended_id=False, data=data))

    def frames_until(self, instant: float) -> int:
        """Number of frames that came before `instant` [s]; stamps are those of the instants in which they were sent."""
        return bisect_left(self.frames, instant, key=lambda frame: frame.timestamp)

    def drive_state(self, role: Role) -> DriveState | None:
        """State of a drive."""
        return decode_state(self.object_value(role, Index.STATUSWORD))

    def object_value(self, role: Role, index: int, subindex: int = 0) -> int:
        """Value of an integer object of a node."""
        assert self.server is not None, "nothing is looked at before it is served"
        return object_value(self.server.faults.devices, self.network, role, index, subindex)

    def truth(self) -> GroundTruth:
        """The true state of motion."""
        return self._vehicle.ground_truth()

    def speed(self) -> float:
        """Speed of the chassis centre over the floor [m/s]."""
        vx, vy, _ = self.truth().twist
        return math.hypot(vx, vy)


class ServedScenario:
    """A scenario that runs while a server serves.

    Args:
        scenario: without set-points.
        world: what is watched.
    """

    def __init__(self, scenario: Scenario, world: ServedWorld) -> None:
        self._scenario = scenario
        self._world = world
        self._watch: Watch | None = None
        self._begin = 0.0
        self._next = 0.0

    def over(self) -> bool:
        """Look, at most once a millisecond; whether the scenario has ended.

        Raises:
            UserError: a fault or an expectation is about something that is not there.
        """
        now = self._world.now
        if now < self._next:
            return False
        self._next = now + _LOOK
        if self._watch is None:
            if self._scenario.begin is Begin.ENABLED and not all_enabled(self._world):
                return False
            self._start(now)
        assert self._watch is not None
        self._watch.look()
        return now - self._begin >= self._scenario.duration

    def report(self) -> ScenarioReport:
        """What came of it; what was not decided has failed."""
        if self._watch is not None:
            return ScenarioReport(self._scenario, self._watch.outcomes(), self._begin)
        never = "the drives were never enabled"
        outcomes = tuple(Outcome(one, False, None, never) for one in self._scenario.expected)
        return ScenarioReport(self._scenario, outcomes, self._world.now)

    def _start(self, now: float) -> None:
        assert self._world.server is not None, "it is served by whoever asks whether it is over"
        self._begin = now
        inject_faults(self._scenario, self._world.server.faults.add)
        self._watch = Watch(self._world, self._scenario.expected, now)
