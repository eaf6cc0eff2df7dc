"""All randomness of the emulator, from one seed.

Every source has its own stream, spawned from the seed, so that switching one source off or resizing it does
not shift another. Values belong to engine steps, not to reads: reading a sensor twice at one time gives the
same number, and who reads what, when, changes nothing.
"""

from __future__ import annotations

import math
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from emulator.prototype import Prototype

BLOCK: Final = 64
"""Engine steps drawn at once: numpy's calls cost a microsecond a step then, and no single step more than 0.15 ms. With
1024 one step in a thousand took 1 to 2 ms, and every 512th cycle in real time was late."""


class WhiteNoise:
    """Independent normal numbers: rows of `width` values, one row a step."""

    def __init__(self, generator: np.random.Generator, scales: NDArray[np.float64]) -> None:
        self._generator = generator
        self._scales = scales

    def draw(self, steps: int) -> NDArray[np.float64]:
        """The next `steps` rows, (steps, width)."""
        return self._generator.standard_normal((steps, len(self._scales))) * self._scales


class OrnsteinUhlenbeck:
    """Stationary, exponentially correlated noise, exact at the step whatever its size.

    x[k+1] = rho x[k] + rms sqrt(1 - rho^2) n[k], rho = exp(-step/correlation_time); x[0] is drawn from the
    stationary distribution.
    """

    def __init__(
        self,
        generator: np.random.Generator,
        scales: NDArray[np.float64],
        *,
        step: float,
        correlation_time: float,
    ) -> None:
        self._rho = math.exp(-step / correlation_time)
        self._white = WhiteNoise(generator, scales)
        self._last = self._white.draw(1)[0].tolist()

    def draw(self, steps: int) -> NDArray[np.float64]:
        """The next `steps` rows, (steps, width)."""
        drive = self._white.draw(steps) * math.sqrt(1 - self._rho**2)
        rho = self._rho
        # `scipy.signal` has a filter for this, which takes as long to load as all the rest of the emulator.
        columns = [
            list(accumulate(column, lambda last, new: rho * last + new, initial=last))[1:]
            for column, last in zip(drive.T.tolist(), self._last, strict=True)
        ]
        self._last = [column[-1] for column in columns]
        return np.array(columns).T


class Disturbances:
    """The random numbers of the present engine step.

    Attributes:
        torque_reading: (4,) error of the torque readings at the motor shafts [Nm], fl, rl, fr, rr.
        motor_dither: (4,) ahead of the rounding of the motor encoders [increments].
        steering_dither: (2,) the same of the steering encoders, left, right.
        load: (8,) fluctuating torque on the joints [Nm]: steering fl, rl, fr, rr, rolling fl, rl, fr, rr. The
            steering load of a side splits half and half onto its two units, which turn against each other.
    """

    torque_reading: list[float]
    motor_dither: list[float]
    steering_dither: list[float]
    load: list[float]

    def __init__(self, prototype: Prototype, *, seed: int, scale: float, step: float) -> None:
        noise, truth = prototype.noise, prototype.truth
        sensor, motor, steering, load = (
            np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(4)
        )
        coulomb = np.array([truth["d_cl"], truth["d_cr"], *[truth["d_cw"]] * 4])
        dither = noise.encoder_dither * scale
        self._torque = WhiteNoise(sensor, np.full(4, noise.torque_sensor * prototype.drive.rated_torque * scale))
        self._motor = WhiteNoise(motor, np.full(4, dither))
        self._steering = WhiteNoise(steering, np.full(2, dither))
        self._load = OrnsteinUhlenbeck(
            load,
            coulomb * noise.load_fluctuation * scale,
            step=step,
            correlation_time=noise.load_correlation_time,
        )
        self._refill()

    def advance(self) -> None:
        """Go on to the next engine step."""
        # Who is stopped meanwhile, as by Ctrl-C, brings the drives to rest from here.
        if self._row + 1 == BLOCK:
            self._refill()
        else:
            self._row += 1
            self._select()

    def _refill(self) -> None:
        self._torque_rows = self._torque.draw(BLOCK).tolist()
        self._motor_rows = self._motor.draw(BLOCK).tolist()
        self._steering_rows = self._steering.draw(BLOCK).tolist()
        self._load_rows = _onto_joints(self._load.draw(BLOCK)).tolist()
        self._row = 0
        self._select()

    def _select(self) -> None:
        row = self._row
        self.torque_reading = self._torque_rows[row]
        self.motor_dither = self._motor_rows[row]
        self.steering_dither = self._steering_rows[row]
        self.load = self._load_rows[row]


def _onto_joints(loads: NDArray[np.float64]) -> NDArray[np.float64]:
    """Loads of left, right, fl, rl, fr, rr (n, 6) as torques of the eight joints (n, 8)."""
    halves = loads[:, [0, 0, 1, 1]] * np.array([0.5, -0.5, 0.5, -0.5])
    return np.hstack([halves, loads[:, 2:]])
