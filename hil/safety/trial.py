"""The trial: drive straight at speed, let the master die, and watch the drives by SDO until nothing moves."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

from hil.bus.clock import Clock
from hil.master import Master
from hil.master.codec import Counter
from hil.network import Network, Node
from hil.network.cia import ErrorCode, Index, Service
from ident.errors import UserError

_HEARTBEAT_LOST: Final = struct.pack("<H", ErrorCode.HEARTBEAT)
"""As an emergency message carries it."""

_SAMPLE_PERIOD: Final = 0.01
_HOLDING_TIME: Final = 0.5
"""Time at speed before the master dies [s]."""
_SPEEDING_TIME: Final = 20.0
"""Longest time that the vehicle may need to come up to speed [s]."""
_SPEED_BAND: Final = 0.4
"""Speed error at which the motors give their rated torque [m/s]."""
_INTEGRATION_TIME: Final = 0.5
_SMOOTHING_TIME: Final = 0.1
"""Time constant of the speed that the torque answers to [s]."""
_SPEED_TOLERANCE: Final = 0.1
"""Error that counts as at speed, as a fraction of the band [-]."""
_RESTING_TIME: Final = 0.3
"""Time without motion after which the vehicle is at rest [s]."""
_RESOLUTION: Final = 1e-5
"""Way in a sample period that is no motion [m]; 1 mm/s."""
_WATCHING_TIME: Final = 30.0
"""Longest time for which a rolling vehicle is watched [s]."""

_WORDS: Final[Mapping[str, int]] = {
    "abort": Index.ABORT_CONNECTION_OPTION,
    "quick_stop": Index.QUICK_STOP_OPTION,
    "fault_reaction": Index.FAULT_REACTION_OPTION,
}


class TrialError(UserError):
    """The trial cannot be carried out."""


@dataclass(frozen=True)
class StopSettings:
    """How fast to go, and what the drives are set to do without their master.

    Attributes:
        speed: of the vehicle when the master dies [m/s].
        abort: 6007h.
        quick_stop: 605Ah.
        fault_reaction: 605Eh.
        deceleration: of the vehicle on the quick stop ramp, written to 6085h of each drive [m/s^2].
    """

    speed: float
    abort: int = 1
    quick_stop: int = 2
    fault_reaction: int = 2
    deceleration: float = 2.0


@dataclass(frozen=True)
class StopRecord:
    """What was on the bus from shortly before the death of the master until rest; times in s, N samples.

    Attributes:
        time: (N,) of the samples.
        travelled: (N, 4) way of the wheels fl, rl, fr, rr along the floor, from 6064h [m].
        statuswords: (N, 4) 6041h.
        truth: (N,) way of the chassis as only a simulation knows it [m], or None.
        death: the master's last SYNC.
        last_heartbeat: of the master.
        reaction: first emergency message 8130h of a drive; None where none came.
        error_codes: 603Fh of the drives at the end.
    """

    time: NDArray[np.float64]
    travelled: NDArray[np.float64]
    statuswords: NDArray[np.int64]
    truth: NDArray[np.float64] | None
    death: float
    last_heartbeat: float
    reaction: float | None
    error_codes: tuple[int, ...]


class DeathOfMaster:
    """Carries out one trial on a vehicle whose wheels point straight ahead.

    Args:
        bus: any python-can bus with the vehicle on it.
        clock: time of the bus.
        network: network file.
        wheel_radius: [m].
        truth: way of the chassis since some start [m], where the vehicle is simulated.
    """

    def __init__(
        self,
        bus: can.BusABC,
        clock: Clock,
        network: Network,
        wheel_radius: float,
        truth: Callable[[], float] | None = None,
    ) -> None:
        self._clock = clock
        self._network = network
        self._radius = wheel_radius
        self._truth = truth
        self._master = Master(bus, clock, network, self._tap)
        self._counters = [Counter(node) for node in network.drives]
        self._emergencies = {Service.EMERGENCY + node.node_id for node in network.drives}
        self._last_heartbeat = 0.0
        self._reaction: float | None = None

    def run(self, settings: StopSettings) -> StopRecord:
        """Drive, die, watch.

        Raises:
            BusError: a node is missing or refuses its configuration.
            TrialError: the speed is not reached.
        """
        self._master.boot()
        for node in self._network.drives:
            self._configure(node, settings)
        self._master.enable()
        self._speed_up(settings.speed)
        death = self._clock.now()
        return self._watch(death)

    def _configure(self, node: Node, settings: StopSettings) -> None:
        access = self._master.object_access(node)
        for name, index in _WORDS.items():
            access.write(index, 0, getattr(settings, name))
        access.write(
            Index.QUICK_STOP_DECELERATION, 0, round(settings.deceleration / (self._radius * abs(node.angle_unit)))
        )

    def _speed_up(self, speed: float) -> None:
        rated = min(node.quantity("rated_torque") for node in self._network.drives)
        integral = held = torque = present = 0.0
        last = self._master.exchange((torque,) * 4)
        for _ in range(round(_SPEEDING_TIME / self._network.cycle_period)):
            sample = self._master.exchange((torque,) * 4)
            # A master that was short of time leaves cycles out, and late SYNCs make single differences useless.
            elapsed = sample.time - last.time
            turned = (sum(sample.wheel_angles) - sum(last.wheel_angles)) / len(sample.wheel_angles)
            present += (turned * self._radius - present * elapsed) / _SMOOTHING_TIME
            last = sample
            error = (speed - present) / _SPEED_BAND
            if abs(error) < 1.0:
                integral += error * elapsed / _INTEGRATION_TIME
            torque = rated * min(max(error + integral, -1.0), 1.0)
            held = held + elapsed if abs(error) < _SPEED_TOLERANCE else 0.0
            if held > _HOLDING_TIME:
                return
        raise TrialError(f"The vehicle does not come to {speed:g} m/s.", "Choose a lower speed.")

    def _watch(self, death: float) -> StopRecord:
        samples: list[tuple[float, list[float], list[int], float]] = []
        now = still_since = death
        while now - death < _WATCHING_TIME and now - still_since < _RESTING_TIME:
            now = self._clock.now()
            samples.append(
                (now, self._ways(), self._read(Index.STATUSWORD), self._truth() if self._truth is not None else 0.0)
            )
            if len(samples) < 2 or _moved(samples[-2][1], samples[-1][1]):
                still_since = now
            self._clock.wait_until(round(now + _SAMPLE_PERIOD, 9))
        times, ways, words, truth = zip(*samples, strict=True)
        return StopRecord(
            np.array(times),
            np.array(ways),
            np.array(words),
            np.array(truth) if self._truth is not None else None,
            death,
            self._last_heartbeat,
            self._reaction,
            tuple(self._read(Index.ERROR_CODE)),
        )

    def _read(self, index: int) -> list[int]:
        return [self._master.object_access(node).read(index) for node in self._network.drives]

    def _ways(self) -> list[float]:
        counts = self._read(Index.POSITION_ACTUAL)
        return [counter.angle(count) * self._radius for counter, count in zip(self._counters, counts, strict=True)]

    def _tap(self, message: can.Message) -> None:
        can_id = message.arbitration_id
        if can_id == Service.HEARTBEAT + self._network.master_id:
            self._last_heartbeat = message.timestamp
        elif self._reaction is None and can_id in self._emergencies and message.data[:2] == _HEARTBEAT_LOST:
            self._reaction = message.timestamp


def _moved(before: list[float], after: list[float]) -> bool:
    return any(abs(b - a) > _RESOLUTION for a, b in zip(before, after, strict=True))
