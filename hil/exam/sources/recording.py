"""Drives and encoders of the independent vehicle: what acts, what is reported, and what either has for flaws."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.exam.sources.independent import CYCLE, NOWHERE, STEP, WHEELS, Plant

Array = NDArray[np.float64]
Follow = Callable[[int, Array, Array], Array]
"""Sample, angles of the motors at the wheels (R, 4), reported angles of the front units (R, 2) -> torques (R, 4)."""

PARTS = round(CYCLE / STEP)
"""Steps of the vehicle in a cycle of its drives."""

SLOW, REST = 0.1, 0.1
"""Rms of a torque on the wheels that no drive reports [Nm], and the time over which it changes [s]."""

TORQUE_NOISE, MOTOR_NOISE, STEERING_NOISE = 2e-3, 2e-6, 1e-5
"""Rms, of torques [Nm] and of the angles of motors and front units [rad]."""


@dataclass(frozen=True)
class Cogging:
    """A torque of a motor over its angle, amplitude sin(order angle + phase) [Nm], which no drive reports."""

    wheel: int
    amplitude: float
    order: float
    phase: float


@dataclass(frozen=True)
class Flaws:
    """What drives and encoders do beside what they say.

    Attributes:
        gain: torque that acts over the one reported, minus one, of every drive.
        bias: torque that acts beside it [Nm].
        cogging: of any motors.
        late: torque acts later than it is reported, by drive [s].
        slow: time constant with which it follows after that, by drive [s].
        offset: reported minus true steering angle, by side [rad].
        stale: steering angle is reported so late, by side [s].
    """

    gain: tuple[float, ...] = NOWHERE
    bias: tuple[float, ...] = NOWHERE
    cogging: tuple[Cogging, ...] = ()
    late: tuple[float, ...] = NOWHERE
    slow: tuple[float, ...] = NOWHERE
    offset: tuple[float, float] = (0.0, 0.0)
    stale: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Signals:
    """What is reported in every cycle: torques (N, R, 4) [Nm], motors (N, R, 4) and front units (N, R, 2) [rad]."""

    torques: Array
    motors: Array
    steering: Array


def run(
    plant: Plant,
    flaws: Flaws,
    follow: Follow,
    samples: int,
    generator: np.random.Generator,
    noise: float = 1.0,
) -> Signals:
    """Drive R vehicles side by side.

    Args:
        plant: at rest.
        flaws: of its drives and encoders.
        follow: who drives it.
        samples: cycles.
        generator: of everything random.
        noise: factor on all of it.
    """
    runs = len(plant.alpha)
    torques, motors, steering = (np.zeros((samples, runs, width)) for width in (4, 4, 2))
    drives, encoders = _Drives(flaws, runs, plant.geometry.gear_ratio), _Encoders(flaws, plant.alpha)
    memory, slow = np.exp(-CYCLE / REST), np.zeros((runs, 4))
    disturbance, reported = np.zeros((runs, 9)), [np.zeros((runs, 4))]
    for sample in range(samples):
        motors[sample], _ = plant.read()
        steering[sample] = encoders.reported()
        torques[sample] = reported[max(sample - plant.truth.late, 0)]
        target = follow(sample, motors[sample], steering[sample])
        slow = memory * slow + np.sqrt(1 - memory**2) * generator.normal(size=slow.shape)
        disturbance[:, WHEELS] = noise * SLOW * slow
        for part in range(PARTS):
            ramp = reported[-1] + (target - reported[-1]) * (part + 0.5) / PARTS
            acting = drives.acting(ramp, plant.read()[0])
            plant.advance(acting, disturbance, (sample + (part + 0.5) / PARTS) * CYCLE)
            encoders.take(plant.alpha)
        reported.append(target)
    for series, size in ((torques, TORQUE_NOISE), (motors, MOTOR_NOISE), (steering, STEERING_NOISE)):
        series += noise * size * generator.normal(size=series.shape)
    return Signals(torques, motors, steering)


class _Drives:
    """Torques that act, from those that are reported."""

    def __init__(self, flaws: Flaws, runs: int, gear: float) -> None:
        self._flaws, self._gear = flaws, gear
        self._gain, self._bias = 1 + np.array(flaws.gain), np.array(flaws.bias)
        self._late = _Late(flaws.late, np.zeros((runs, 4)))
        self._filtered = np.zeros((runs, 4))
        self._gained = np.array([1 - np.exp(-STEP / time) if time else 1.0 for time in flaws.slow])

    def acting(self, reported: Array, motors: Array) -> Array:
        """(R, 4), in the middle of a step of the vehicle."""
        self._filtered += self._gained * (self._late.of(reported) - self._filtered)
        acting = self._gain * self._filtered + self._bias
        for each in self._flaws.cogging:
            angle = each.order * self._gear * motors[:, each.wheel] + each.phase
            acting[:, each.wheel] += each.amplitude * np.sin(angle)
        return np.asarray(acting)


class _Encoders:
    """Steering angles that are reported, from those that are."""

    def __init__(self, flaws: Flaws, alpha: Array) -> None:
        self._offset, self._late = np.array(flaws.offset), _Late(flaws.stale, alpha)
        self._now = self._late.of(alpha)

    def take(self, alpha: Array) -> None:
        """The vehicle has made a step."""
        self._now = self._late.of(alpha)

    def reported(self) -> Array:
        """(R, 2) [rad]."""
        return np.asarray(self._now + self._offset)


class _Late:
    """A series in steps of the vehicle, each column by a time of its own [s]; linear between steps."""

    def __init__(self, times: Sequence[float], start: Array) -> None:
        self._steps = np.array(times) / STEP
        length = int(np.ceil(self._steps.max())) + 2
        self._past: deque[Array] = deque([start.copy() for _ in range(length)], maxlen=length)

    def of(self, now: Array) -> Array:
        self._past.append(now.copy())
        if not self._steps.any():
            return now
        past = np.stack(self._past)[::-1]
        whole = np.floor(self._steps).astype(int)
        part, column = self._steps - whole, np.arange(len(whole))
        return np.asarray((1 - part) * past[whole, :, column].T + part * past[whole + 1, :, column].T)
