"""The controller of a step: feed-forward torques plus one cascade a coordinate, in plain floats for speed.

A loop's coordinate moves along its column h of H_k: its rate is h·β̇ / h·h and its generalized torque τ becomes
motor torques h τ / (i_G h·h), the minimum-norm distribution. Steering angles and rates come from the steering
encoders: the wheels would resolve them better, but only as long as they roll.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ident.campaign.loops import STEERING_RATE_CYCLES, LoopDesign
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.errors import CampaignError

STANDSTILL_GAIN = 12.0
"""Factor on the integral gain while the reference stands still: the coordinate sticks, so the integrator only has to
cross the band of Coulomb friction: that of steering takes 1.5 s at 0.3 mrad."""

LEAK_TIME = 0.1
"""Time in which an integrator gives up its torque at standstill [s], once its coordinate is inside the dead band
(friction then holds it, far from the edge at which a disturbance would move it on) or has passed its target."""

REST = 1e-9
"""Reference speed that counts as standstill."""


@dataclass(frozen=True)
class LoopLimits:
    """Bounds of one loop.

    Attributes:
        following_error: largest position error before the campaign is stopped [rad or m].
        integral: largest torque of the integrator.
        dead_band: position error at standstill that the integrator leaves alone [rad or m], so that stiction
            does not make it hunt.
        holding_band: the same for a coordinate that stands still throughout the step. Wider: friction holds a
            steering angle, and torque spent on its last tenth of a degree only presses the wheels against the floor.
    """

    following_error: float
    integral: float
    dead_band: float
    holding_band: float


class _Loop:
    """State of one cascade."""

    def __init__(self, name: str, reference: Reference, design: LoopDesign, limits: LoopLimits, gear: float) -> None:
        track = reference.tracks[name]
        norm = np.sum(track.wheels**2, axis=1, keepdims=True)
        self.name = name
        self.side = STEERING_LOOPS.index(name) if name in STEERING_LOOPS else None
        self.position: list[float] = track.position.tolist()
        self.velocity: list[float] = track.velocity.tolist()
        self.measure: list[list[float]] = (track.wheels / norm).tolist()
        self.distribute: list[list[float]] = (track.wheels / (norm * gear)).tolist()
        self.gains = (design.position_gain, design.velocity_gain, design.integral_gain * reference.sample_time)
        self.limits = limits
        moves = bool(np.any(np.abs(track.velocity) > REST))
        self.dead_band = limits.dead_band if moves else limits.holding_band
        self.leak = math.exp(-reference.sample_time / LEAK_TIME)
        self.travel = 0.0
        self.integral = 0.0
        self.past: list[float] = []

    def torque(self, index: int, steps: Sequence[float], steering: Sequence[float], cycle: float) -> float:
        """Generalized torque from wheel angle increments `steps` (4,) and steering angles (2,)."""
        position, rate = self._measured(index, steps, steering, cycle)
        wanted = self.velocity[index]
        error = self.position[index] - position
        if abs(error) > self.limits.following_error:
            raise FollowingError(self.name, index, error, self.limits.following_error)
        position_gain, velocity_gain, integral_gain = self.gains
        velocity_error = wanted + position_gain * error - rate
        if abs(wanted) > REST:
            self._integrate(integral_gain * velocity_error)
        else:
            inside = abs(error) < self.dead_band
            if inside or error * self.integral < 0:
                self.integral *= self.leak
            if not inside:
                self._integrate(STANDSTILL_GAIN * integral_gain * velocity_error)
        return velocity_gain * velocity_error + self.integral

    def _integrate(self, torque: float) -> None:
        bound = self.limits.integral
        self.integral = min(max(self.integral + torque, -bound), bound)

    def _measured(
        self, index: int, steps: Sequence[float], steering: Sequence[float], cycle: float
    ) -> tuple[float, float]:
        if self.side is None:
            m = self.measure[index]
            moved = m[0] * steps[0] + m[1] * steps[1] + m[2] * steps[2] + m[3] * steps[3]
            self.travel += moved
            return self.travel, moved / cycle
        angle = steering[self.side]
        past = self.past
        past.append(angle)
        if len(past) <= STEERING_RATE_CYCLES:
            return angle, (angle - past[0]) / (STEERING_RATE_CYCLES * cycle)
        return angle, (angle - past.pop(0)) / (STEERING_RATE_CYCLES * cycle)


class FollowingError(CampaignError):
    """A coordinate is too far from its reference."""

    def __init__(self, coordinate: str, sample: int, error: float, limit: float) -> None:
        super().__init__(
            f"{coordinate} is {error:+.3f} off its reference at sample {sample} (limit {limit:.3f}).",
            "Look for a blocked or slipping wheel, a wrong direction of rotation or gear ratio in the network "
            "file, or prior parameters far from the truth in the vehicle file.",
        )
        self.coordinate = coordinate


class Controller:
    """Drives one reference; call `torques` once a cycle with fresh measurements."""

    def __init__(
        self,
        reference: Reference,
        designs: Mapping[str, LoopDesign],
        limits: Mapping[str, LoopLimits],
        *,
        gear_ratio: float,
        peak_torque: float,
    ) -> None:
        self._loops = [_Loop(name, reference, designs[name], limits[name], gear_ratio) for name in reference.tracks]
        self._feed_forward = reference.feed_forward.tolist()
        self._cycle = reference.sample_time
        self._peak = peak_torque
        self._previous: Sequence[float] | None = None

    def torques(self, index: int, wheel_angles: Sequence[float], steering: Sequence[float]) -> list[float]:
        """Motor torques (4,) [Nm] for sample `index` of the reference, from β (4,) and α (2,) [rad].

        Raises:
            FollowingError: a coordinate is further from its reference than its limit.
        """
        last = self._previous or wheel_angles
        self._previous = wheel_angles
        w0, w1, w2, w3 = wheel_angles
        steps = (w0 - last[0], w1 - last[1], w2 - last[2], w3 - last[3])
        u0, u1, u2, u3 = self._feed_forward[index]
        for loop in self._loops:
            torque = loop.torque(index, steps, steering, self._cycle)
            d = loop.distribute[index]
            u0 += d[0] * torque
            u1 += d[1] * torque
            u2 += d[2] * torque
            u3 += d[3] * torque
        peak = self._peak
        return [min(max(u, -peak), peak) for u in (u0, u1, u2, u3)]
