"""Coming to rest by the drive's own means: ramps, current limit, DC-link limit."""

from __future__ import annotations

from typing import Final

from emulator.firmware.drive.axis import TICK, Axis, approach
from emulator.firmware.drive.modes import TARGET_REACHED, Steady
from emulator.firmware.drive.options import StopKind

_VOLTAGE_MARGIN: Final = 0.8
"""Share of the way from chopper threshold to trip level at which braking torque has gone to zero [-]."""


class Stop:
    """Brings the axis to rest and holds it there; `done` when it stands (606Fh for the time of 6070h).

    The slow-down ramp of the torque modes takes the torque to zero at 6087h instead; the shaft then coasts.
    """

    ticks, failed = True, False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._kind = StopKind.QUICK_STOP
        self._by_torque = False
        self._torque = 0.0
        self._rest = Steady()
        self.done = False

    def prepare(self, kind: StopKind, torque_mode: bool) -> None:
        """Choose the way of stopping; `torque_mode` is the mode that it ends."""
        self._kind = kind
        self._by_torque = torque_mode and kind is StopKind.SLOW_DOWN

    def start(self) -> None:
        """From the present speed and torque."""
        self._axis.take_over()
        self._torque = float(self._axis.torque_demand)
        self._rest.reset()
        self.done = False

    def take(self) -> None:
        """Set-points of the master count for nothing now."""

    def tick(self) -> None:
        """One step towards rest."""
        if self._by_torque:
            self._ramp_torque()
        else:
            self._ramp_velocity()

    def status(self) -> int:
        """Bit 10: the stop is over."""
        return TARGET_REACHED if self.done else 0

    def _ramp_torque(self) -> None:
        axis = self._axis
        self._torque = approach(self._torque, 0.0, axis.parameters.torque_slope * TICK)
        axis.control_torque(self._torque)
        self.done = self._torque == 0.0

    def _ramp_velocity(self) -> None:
        axis, parameters = self._axis, self._axis.parameters
        last = axis.velocity_demand
        axis.velocity_demand = approach(last, 0.0, self._deceleration() * TICK)
        slope = 0.0 if self._deceleration() == float("inf") else (axis.velocity_demand - last) / TICK
        axis.control_velocity(slope, share=self._share())
        standing = axis.velocity_demand == 0.0 and abs(axis.velocity()) <= parameters.velocity_threshold
        self.done = self._rest.update(standing, parameters.velocity_threshold_time)

    def _deceleration(self) -> float:
        """[rad/s^2]; infinite where only a limit of current or voltage counts."""
        parameters = self._axis.parameters
        if self._kind is StopKind.SLOW_DOWN:
            return min(parameters.deceleration, parameters.max_deceleration)
        if self._kind is StopKind.QUICK_STOP:
            return parameters.quick_stop_deceleration
        return float("inf")

    def _share(self) -> float:
        """Of the torque limit that may be used: braking must not drive the DC link into its protection."""
        if self._kind is not StopKind.VOLTAGE_LIMIT:
            return 1.0
        threshold, trip = self._axis.hardware.voltage_range
        above = (self._axis.hardware.voltage - threshold) / (_VOLTAGE_MARGIN * (trip - threshold))
        return min(max(1.0 - above, 0.0), 1.0)
