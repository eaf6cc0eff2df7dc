"""Servo axes from textbook physics, integrated step by step: they know nothing of the candidates of a diagnosis.

Friction is a bristle that stretches and slides (LuGre) or holds and slides, elasticity a second mass on a spring, the
drive follows its reference as a position controller makes it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from ident.records.axis_record import AxisKind, AxisRecord, AxisSignals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Machine:
    """A carriage under a position controller, integrated at ten times the rate of its record.

    Attributes:
        mass, viscous, coulomb, offset: of the model [kg, N s/m, N, N].
        asymmetry: of the viscous friction [N s/m].
        delay: of the drive [s].
        bristle: stiffness of LuGre's bristles [N/m], 0 for dry friction that holds or slides.
        breakaway: friction at rest beyond Coulomb's [N], gone at `stribeck` [m/s]; with bristles only.
        compliance: of a spring with `share` of the mass behind it [m/N].
        follower: friction that follows the speed of another carriage, which moves by itself [N s/m, N].
        read: part of a sample interval, of the effort being held, after which the position is read.
        spring: between carriage and frame [N/m].
        law: force that resists beside all this [N], of time, position and velocity.
        strokes, speeds: in a period, an even number of them, and those that they are driven at [m/s].
        travel: within which it is driven from point to point, in as many strokes as there is time for [m]; 0: in
            strokes of one duration, wherever they lead.
        noise, encoder: rms of the noise of the measured effort [N] and of the positions [m].
    """

    mass: float = 20.0
    viscous: float = 60.0
    coulomb: float = 8.0
    offset: float = -1.0
    asymmetry: float = 0.0
    delay: float = 0.0
    bristle: float = 0.0
    breakaway: float = 0.0
    stribeck: float = 0.02
    compliance: float = 0.0
    share: float = 0.6
    follower: tuple[float, float] = (0.0, 0.0)
    read: float = 0.5
    spring: float = 0.0
    law: Callable[[float, float, float], float] | None = None
    noise: float = 0.2
    encoder: float = 2e-7
    rate: float = 1000.0
    substeps: int = 4
    duration: float = 5.0
    repeats: int = 4
    strokes: int = 8
    speeds: tuple[float, ...] = (0.05, 0.1, 0.15, 0.2)
    travel: float = 0.0

    def drive(self, seed: int) -> AxisRecord:
        """A record of `repeats` periods of a random motion."""
        generator = np.random.default_rng(seed)
        reference = self._reference(generator)
        other = np.roll(self._reference(generator), round(self.duration * self.rate / 16))
        position, effort = self._integrated(reference, np.gradient(other, 1 / self.rate))
        effort = effort + self.noise * generator.normal(size=len(effort))
        position = position + self.encoder * generator.normal(size=len(effort))
        period = np.repeat(np.arange(self.repeats), len(effort) // self.repeats).astype(np.int64)
        axes = [AxisSignals("", AxisKind.LINEAR, position, effort)]
        if any(self.follower):
            own = generator.normal(size=len(effort)) * self.noise
            inertia = 5.0 * np.gradient(np.gradient(other, 1 / self.rate), 1 / self.rate)
            axes = [
                AxisSignals("1", AxisKind.LINEAR, position, effort),
                AxisSignals(
                    "2", AxisKind.LINEAR, other + self.encoder * generator.normal(size=len(other)), inertia + own
                ),
            ]
        return AxisRecord(tuple(axes), 1 / self.rate, np.arange(len(effort)) / self.rate, period, f"seed {seed}")

    def _reference(self, generator: np.random.Generator) -> Array:
        """Alternating strokes of various speeds, smoothed accelerations, that end where they began."""
        samples = round(self.duration * self.rate)
        if self.travel:
            return self._from_point_to_point(samples, generator)
        strokes = generator.choice(self.speeds, self.strokes) * np.tile([1.0, -1.0], self.strokes // 2)
        velocity = np.resize(np.repeat(strokes, samples // self.strokes), samples)
        velocity = velocity - velocity.mean()
        window = signal.windows.hann(round(0.15 * self.rate))
        wrapped = np.concatenate([velocity, velocity, velocity])
        smooth = signal.convolve(wrapped, window / window.sum(), mode="same")[len(velocity) : 2 * len(velocity)]
        return np.tile(np.cumsum(smooth - smooth.mean()) / self.rate, self.repeats)

    def _from_point_to_point(self, samples: int, generator: np.random.Generator) -> Array:
        """The same between random points of the travel."""
        velocity, here = np.zeros(0), 0.0
        while len(velocity) < samples:
            there = float(generator.uniform(0.0, self.travel))
            speed = float(generator.choice(self.speeds))
            stroke = np.full(round(abs(there - here) / speed * self.rate), math.copysign(speed, there - here))
            here += float(stroke.sum()) / self.rate
            velocity = np.append(velocity, stroke)
        window = signal.windows.hann(round(0.15 * self.rate))
        smooth = signal.convolve(velocity, window / window.sum())[:samples]
        return np.tile(np.cumsum(smooth) / self.rate, self.repeats)

    def _integrated(self, reference: Array, other: Array) -> tuple[Array, Array]:
        step = 1 / self.rate / self.substeps
        velocity_reference = np.gradient(reference, 1 / self.rate)
        feed = self.mass * np.gradient(velocity_reference, 1 / self.rate) + self.viscous * velocity_reference
        feed += self.coulomb * np.tanh(velocity_reference / 0.005)
        stiffness, damping = self.mass * 60.0**2, self.mass * 2 * 60.0
        x, v, z, load, load_rate = float(reference[0]), 0.0, 0.0, float(reference[0]), 0.0
        behind = self.mass * self.share if self.compliance else 0.0
        positions, efforts = np.zeros(len(reference)), np.zeros(len(reference))
        whole, part = divmod(self.delay / step, 1.0)
        late = deque([0.0] * (int(whole) + 1))
        moved, read = self.mass - behind, int(self.read * self.substeps)
        held, following = self.coulomb / moved * step, any(self.follower)
        # Numbers of Python: numpy's take a multiple of the time in a loop.
        series = zip(reference.tolist(), velocity_reference.tolist(), feed.tolist(), other.tolist(), strict=True)
        for index, (command, rate, ahead, another) in enumerate(series):
            wanted = ahead + stiffness * (command - x) + damping * (rate - v)
            efforts[index] = wanted
            for sub in range(self.substeps):
                if sub == read:
                    positions[index] = x
                late.append(wanted)
                arrived = part * late.popleft() + (1 - part) * late[0]
                force = arrived - self.viscous * v - self.asymmetry * abs(v) - self.offset - self.spring * x
                if self.law is not None:
                    force -= self.law((index + sub / self.substeps) / self.rate, x, v)
                if following:
                    force -= self.follower[0] * another + self.follower[1] * _sign(v + another)
                if self.compliance:
                    spring = (x - load) / self.compliance + 30.0 * (v - load_rate)
                    force -= spring
                    load_rate += spring / behind * step
                    load += load_rate * step
                before = v
                if self.bristle:
                    level = self.coulomb + self.breakaway * math.exp(-((v / self.stribeck) ** 2))
                    bend = v - self.bristle * abs(v) / level * z
                    z += bend * step
                    v += (force - self.bristle * z - 50.0 * bend) / moved * step
                else:
                    v += force / moved * step
                    v -= _sign(v) * min(held, abs(v))
                x += (before + v) / 2 * step
        return positions, efforts


def _sign(value: float) -> float:
    return (value > 0) - (value < 0)
