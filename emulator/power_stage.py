"""Power stage of a wheel drive: its DC link with brake chopper, and the protection that switches it off."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

PEAK_SHARE: Final = 0.95
"""Share of the peak torque from which on the peak-time of the power stage counts [-]."""

_STALL_SPEED: Final = 1.0
"""Speed of the motor shaft below which it counts as standing [rad/s]; 10 rpm."""

THERMAL_LIMIT: Final = 1.05
"""Thermal load at which the drive trips [-]; 1 is what rated current settles at."""


class Trip(Enum):
    """What the protection of a drive responds to; the firmware decides what follows."""

    OVER_CURRENT = auto()
    OVER_TEMPERATURE = auto()
    OVER_VOLTAGE = auto()
    BLOCKED = auto()
    ENCODER = auto()


@dataclass(frozen=True)
class PowerStageData:
    """Data sheet of a power stage.

    Attributes:
        supply_voltage: of the rectified supply, which cannot take energy back [V].
        link_capacitance: of the DC link [F].
        chopper_voltage: DC-link voltage above which the chopper burns energy in the brake resistor [V].
        chopper_power: what it can burn [W].
        over_voltage: DC-link voltage at which the drive trips [V].
        phase_resistance: of the motor [Ohm].
        peak_time: for which the power stage carries its peak current [s].
        overload_time: after which the I2t protection trips at peak current, from cold [s].
        stall_time: for which more than rated torque at standstill is tolerated [s].
    """

    supply_voltage: float
    link_capacitance: float
    chopper_voltage: float
    chopper_power: float
    over_voltage: float
    phase_resistance: float
    peak_time: float
    overload_time: float
    stall_time: float


class PowerStage:
    """DC link and protection, advanced by the steps of the engine.

    Energy E = C U^2 / 2 of the DC link changes by the power that the motor takes, torque times speed plus copper
    losses 3 R i^2. A passive supply holds it up but takes nothing back; the chopper takes what is above its
    threshold, as far as its power goes. Thermal load h follows tau dh/dt = (i / rated)^2 - h, with tau such
    that peak current trips after `overload_time` from cold.

    Args:
        data: data sheet.
        rated_torque, peak_torque: of the motor [Nm]; torque is proportional to current.
        rated_current: rms [A].
        step: of the engine [s].

    Attributes:
        thermal_load: h [-].
        trip: what the protection has responded to, None while all is well.
    """

    def __init__(
        self, data: PowerStageData, rated_torque: float, peak_torque: float, rated_current: float, step: float
    ) -> None:
        self._step = step
        self._capacitance = data.link_capacitance
        self._supply_energy = self._energy_at(data.supply_voltage)
        self._chopper_energy = self._energy_at(data.chopper_voltage)
        self._trip_energy = self._energy_at(data.over_voltage)
        self._chopped = data.chopper_power * step
        self._rated_torque = rated_torque
        ratio = peak_torque / rated_torque
        self._peak_torque = PEAK_SHARE * peak_torque
        self._copper = 3.0 * data.phase_resistance * (rated_current / rated_torque) ** 2
        self._heating = -math.expm1(-step / thermal_time_constant(data.overload_time, ratio))
        self._limits = (data.peak_time, data.stall_time)
        self._at_peak = self._stalled = 0.0
        self._energy = self._supply_energy
        self._tripped: Callable[[Trip], None] | None = None
        self.voltage_range = (data.chopper_voltage, data.over_voltage)
        self.thermal_load = 0.0
        self.trip: Trip | None = None

    @property
    def voltage(self) -> float:
        """Of the DC link [V]."""
        return math.sqrt(2.0 * self._energy / self._capacitance)

    def watch(self, tripped: Callable[[Trip], None]) -> None:
        """Call `tripped` when the protection responds."""
        self._tripped = tripped

    def clear(self) -> None:
        """Forget a trip; heat and charge stay."""
        self.trip = None
        self._at_peak = self._stalled = 0.0

    def report(self, trip: Trip) -> None:
        """Respond to something, unless the protection has responded already.

        After an over-temperature the motor still brakes: what happens on the way is responded to as well.
        """
        if self.trip is None or (self.trip is Trip.OVER_TEMPERATURE and trip is not self.trip):
            self.trip = trip
            if self._tripped is not None:
                self._tripped(trip)

    def rest(self) -> None:
        """One step of the engine without current: the motor cools down."""
        self.thermal_load -= self._heating * self.thermal_load

    def advance(self, torque: float, speed: float) -> Trip | None:
        """One step of the engine under a motor torque [Nm] at a shaft speed [rad/s]; the trip that it leads to."""
        squared = torque * torque
        # Over-current, overload and standstill all need more than rated torque.
        load = squared / (self._rated_torque * self._rated_torque)
        self.thermal_load += self._heating * (load - self.thermal_load)
        energy = self._energy - self._step * (torque * speed + self._copper * squared)
        if energy <= self._supply_energy:
            self._energy = self._supply_energy
        else:
            excess = energy - self._chopper_energy
            self._energy = energy - min(excess, self._chopped) if excess > 0.0 else energy
        if load <= 1.0:
            self._at_peak = self._stalled = 0.0
            return self._voltage_trip()
        # The over-temperature stays while the motor brakes, and must not hide what comes on top of it.
        return self._voltage_trip() or self._overload_trip(abs(torque), abs(speed))

    def _overload_trip(self, torque: float, speed: float) -> Trip | None:
        peak_time, stall_time = self._limits
        self._at_peak = self._at_peak + self._step if torque >= self._peak_torque else 0.0
        self._stalled = self._stalled + self._step if speed < _STALL_SPEED else 0.0
        if self._at_peak > peak_time:
            return Trip.OVER_CURRENT
        if self._stalled > stall_time:
            return Trip.BLOCKED
        return Trip.OVER_TEMPERATURE if self.thermal_load > THERMAL_LIMIT else None

    def _voltage_trip(self) -> Trip | None:
        return Trip.OVER_VOLTAGE if self._energy > self._trip_energy else None

    def _energy_at(self, voltage: float) -> float:
        return 0.5 * self._capacitance * voltage**2


def thermal_time_constant(overload_time: float, ratio: float) -> float:
    """tau of the thermal load [s]; a motor whose peak torque is about the rated one never gets too hot."""
    share = THERMAL_LIMIT / ratio**2
    return -overload_time / math.log1p(-share) if share < 1.0 else overload_time
