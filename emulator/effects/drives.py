"""Flaws of a drive: what acts at the motor shaft is not the torque that the drive reports."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Protocol


@dataclass(frozen=True)
class Ripple:
    """Cogging of a motor: amplitude sin(order times motor angle + phase), current or none.

    Attributes:
        amplitude: at the motor shaft [Nm].
        order: periods a revolution of the motor.
        phase: at motor angle zero [rad].
    """

    amplitude: float
    order: float
    phase: float


@dataclass(frozen=True)
class DriveFlaws:
    """Of one drive; signs as in records, positive rolls the vehicle forward.

    Attributes:
        gain: relative error of the torque constant [-].
        bias: torque beyond the reported one while the power stage is on [Nm].
        ripples: cogging.
        delay: time by which torque acts later than it is reported [s].
        lag: time constant with which it follows after that [s].
        compliance: of the gear, at the wheel [rad/Nm]; zero is rigid.
        gap: whole play of the gear, at the wheel [rad].
    """

    gain: float = 0.0
    bias: float = 0.0
    ripples: tuple[Ripple, ...] = ()
    delay: float = 0.0
    lag: float = 0.0
    compliance: float = 0.0
    gap: float = 0.0

    @property
    def flexible(self) -> bool:
        """Whether motor and wheel can move against each other."""
        return self.compliance > 0 or self.gap > 0


class TorqueSource(Protocol):
    """What the mechanics see of a drive."""

    @property
    def enabled(self) -> bool:
        """Whether the power stage is on."""

    @property
    def wheel_torque(self) -> float:
        """Torque that the drive takes itself to give, at the wheel [Nm]."""


@dataclass
class DelayLine:
    """A quantity as it was some time ago, linear between the engine steps; zero before the first.

    Attributes:
        delay: [s].
        step: between two entries [s].
    """

    delay: float
    step: float
    _past: deque[float] = field(init=False)

    def __post_init__(self) -> None:
        whole = math.floor(self.delay / self.step + 1e-9)
        self._share = self.delay / self.step - whole
        self._past = deque([0.0] * (whole + 2), maxlen=whole + 2)

    def push(self, value: float) -> None:
        """The quantity at the present step."""
        self._past.append(value)

    def fill(self, value: float) -> None:
        """As if it had been this value for ever."""
        self._past.extend([value] * len(self._past))

    def value(self) -> float:
        """The quantity a delay before the present step."""
        return (1 - self._share) * self._past[1] + self._share * self._past[0]


class MotorTorque:
    """Torque that really acts at the motor of one drive, as seen from the wheel.

    Args:
        flaws: of the drive.
        stage: its power stage.
        gear_ratio: motor turns per turn of the wheel.
        step: of the engine [s].
    """

    def __init__(self, flaws: DriveFlaws, stage: TorqueSource, gear_ratio: float, step: float) -> None:
        self._flaws = flaws
        self._stage = stage
        self._gear = gear_ratio
        self._line = DelayLine(flaws.delay, step) if flaws.delay else None
        self._gained = -math.expm1(-step / flaws.lag) if flaws.lag else 1.0
        self._following = 0.0

    def settle(self) -> None:
        """The stage has asked for its present torque for longer than any delay."""
        self._following = self._stage.wheel_torque
        if self._line is not None:
            self._line.fill(self._following)

    def __call__(self, angle: float) -> float:
        """Torque at the wheel [Nm]; call once a step.

        Args:
            angle: of the motor, divided by the gear ratio [rad].
        """
        torque = self._stage.wheel_torque
        if self._line is not None:
            self._line.push(torque)
            torque = self._line.value()
        if self._flaws.lag:
            self._following += self._gained * (torque - self._following)
            torque = self._following
        torque *= 1.0 + self._flaws.gain
        if self._stage.enabled:
            torque += self._gear * self._flaws.bias
        for ripple in self._flaws.ripples:
            torque += self._gear * ripple.amplitude * math.sin(ripple.order * self._gear * angle + ripple.phase)
        return torque
