"""A small but complete vehicle controller, the thing under test: it drives straight at a speed, and is safe.

Every cycle it takes a wish (`drive`), reads the wheels, sends torques. It stops the vehicle when the wish is not
renewed, and when a drive, a node or the bus fails.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

import can

from hil.bus.clock import Clock
from hil.master import Master, Sample
from hil.network import Network
from ident.errors import BusError

WHEEL_RADIUS = 0.10
"""[m]."""
TORQUE_LIMIT = 1.27
"""Rated torque of a motor [Nm]."""
SPEED_LIMIT = 1.0
"""[m/s]."""
ACCELERATION = 0.5
"""Of the wished speed [m/s^2]."""
WISH_TIMEOUT = 0.3
"""A wish that is not renewed for so long is forgotten [s]: the person, or the program, that wished is gone."""
GAIN, INTEGRAL_GAIN = 12.0, 20.0
"""Of the speed loop of all wheels together [Nm s/m], [Nm/m]."""


class Mode(StrEnum):
    """What the controller does."""

    OFF = "off"
    READY = "ready"
    STOPPED = "stopped for safety"


class VehicleController:
    """Drives all four wheels at one speed.

    Args:
        bus: of the vehicle.
        clock: time of that bus.
        network: the network file.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, network: Network) -> None:
        self._make_master: Callable[[], Master] = lambda: Master(bus, clock, network)
        self._period = network.cycle_period
        self._clock = clock
        self._bus = bus
        self._master = self._make_master()
        self.mode = Mode.OFF
        self.reason = ""
        self.speed = 0.0
        self._forget_motion()

    def start(self) -> None:
        """Bring the vehicle up, drives enabled; also after a stop for safety, when its cause is removed."""
        self._master = self._make_master()
        self._forget_motion()
        self._master.boot()
        self._master.enable()
        self.mode, self.reason = Mode.READY, ""

    def drive(self, speed: float) -> None:
        """Wish a speed [m/s]; to be renewed within 0.3 s."""
        self._wish = min(max(speed, -SPEED_LIMIT), SPEED_LIMIT)
        self._wished_at = self._clock.now()

    def step(self) -> None:
        """One cycle; never raises for what the vehicle does."""
        if self.mode is not Mode.READY:
            # Nothing is commanded any more; listening lets time pass.
            self._bus.recv(self._period)
            return
        try:
            self._regulate(self._master.exchange((self._torque,) * 4))
        except BusError as error:
            self._stop(str(error))

    def close(self) -> None:
        """Take the vehicle down in order."""
        if self.mode is Mode.READY:
            self._master.shut_down()
        self.mode = Mode.OFF

    def _stop(self, reason: str) -> None:
        self.mode, self.reason = Mode.STOPPED, reason
        self._master.emergency_stop()

    def _forget_motion(self) -> None:
        self._wish = self._setpoint = self._integral = self._torque = 0.0
        self._wished_at = float("-inf")
        self._last: Sample | None = None

    def _regulate(self, sample: Sample) -> None:
        if self._last is not None and sample.time > self._last.time:
            turned = sum(sample.wheel_angles) - sum(self._last.wheel_angles)
            self.speed = turned / 4 * WHEEL_RADIUS / (sample.time - self._last.time)
        self._last = sample
        wish = self._wish if self._clock.now() - self._wished_at < WISH_TIMEOUT else 0.0
        step = ACCELERATION * self._period
        self._setpoint += min(max(wish - self._setpoint, -step), step)
        error = self._setpoint - self.speed
        torque = GAIN * error + self._integral
        self._torque = min(max(torque, -TORQUE_LIMIT), TORQUE_LIMIT)
        if self._torque == torque:
            self._integral += INTEGRAL_GAIN * error * self._period
