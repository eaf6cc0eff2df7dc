"""The emulated vehicle under torques that were recorded, held to the motion that was recorded with them.

Drives and encoders are ideal here, as what they did is in the record; the load does not fluctuate, as nobody knows how
it did. What it takes to hold the vehicle is then what its bodies, friction and effects lack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import mul, sub
from types import TracebackType
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from emulator.effects import Wanted, inject
from emulator.effects.assembly import Mechanics
from emulator.effects.bodies import load_payload
from emulator.engine.choice import ENGINES
from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype
from emulator.vehicle import viscous_of
from ident.errors import UserError
from ident.extras import default_engine

STANDING_TIME: Final = 0.1
"""Time that tyres get to take the weight before the first sample [s]; their heave dies out within 0.02 s."""


_ASTRAY: Final = 1e9
"""Force that no vehicle has [N]."""


@dataclass
class _Shaft:
    """A power stage that gives what it is told.

    Attributes:
        wheel_torque: at the wheel [Nm].
        enabled: it is on.
    """

    wheel_torque: float = 0.0
    enabled: bool = True


@dataclass(frozen=True)
class Start:
    """What the encoders of a vehicle read, and how it moves.

    Attributes:
        time: since the vehicle began to move [s].
        heading: of the chassis [rad].
        twist: (x', y', gamma') in the chassis frame, of half an engine step ago [m/s, m/s, rad/s].
        steering, wheels: angles as read: left, right; fl, rl, fr, rr [rad].
        steering_rates, wheel_rates: of half an engine step ago [rad/s].
    """

    time: float
    heading: float
    twist: tuple[float, float, float]
    steering: tuple[float, float]
    wheels: tuple[float, float, float, float]
    steering_rates: tuple[float, float]
    wheel_rates: tuple[float, float, float, float]

    @property
    def joint_rates(self) -> list[float]:
        """Of the eight joints (8,); the rear units turn against the front ones [rad/s]."""
        left, right = self.steering_rates
        return [left, -left, right, -right, *self.wheel_rates]


@dataclass(frozen=True)
class Guide:
    """What holds a vehicle to a recorded motion, one force a coordinate, and at which joints it acts.

    A coordinate takes part in each of six joints (steering left, right; wheels fl, rl, fr, rr) by a weight: its rate
    times the weight is the joint's. Its force acts at the joints in these proportions, on wheels by the motors.

    Attributes:
        readings: (N, 6) recorded angles [rad].
        rates: (N, 6) recorded rates [rad/s].
        weights: (N, n, 6) of n coordinates.
        stiffness, damping: (n,) force per displacement and per speed of each.
    """

    readings: Sequence[Sequence[float]]
    rates: Sequence[Sequence[float]]
    weights: Sequence[Sequence[Sequence[float]]]
    stiffness: Sequence[float]
    damping: Sequence[float]


class ReplayedVehicle:
    """A vehicle with effects that is set in motion and driven by torques at its motor shafts.

    Args:
        prototype: what to emulate.
        effects: that it has beyond its prototype file.
        make_engine: what makes the physics engine; None: PyBullet where it is installed, otherwise MuJoCo.
        engine_step: [s].

    Raises:
        UserError: the vehicle cannot have these effects.
    """

    def __init__(
        self,
        prototype: Prototype,
        *,
        effects: Sequence[Wanted] = (),
        make_engine: MakeEngine | None = None,
        engine_step: float = 1e-3,
    ) -> None:
        injection = inject(prototype, effects, engine_step)
        self._built = injection.built
        self._gear_ratio = prototype.geometry.gear_ratio
        self.engine = (make_engine or ENGINES[default_engine()])(injection.built, step_size=engine_step, gui=False)
        self._mechanics = Mechanics(injection, self.engine)
        self._stages = [_Shaft() for _ in range(4)]
        self._mechanics.connect(self._stages)
        self._viscous = viscous_of(injection.built.prototype.truth)

    def stand(self, *, lifted: bool, load: float = 0.0) -> None:
        """On the floor or on the jack-stand, with a load over its centre [kg] or none."""
        built = replace(self._built, prototype=load_payload(self._built.prototype, load, 0.0)) if load else self._built
        self.engine.build(built)
        self.engine.place(on_stand=lifted, angles=[0.0] * 8)
        self._mechanics.settle()

    def follow(self, start: Start, torques: Sequence[Sequence[float]], guide: Guide, steps: int) -> list[list[float]]:
        """Forces (N, n) beyond the recorded torques that hold the vehicle to the recorded motion [Nm or N].

        Args:
            start: the state at the first sample.
            torques: (N, 4) at the motor shafts; between two samples they change linearly [Nm].
            guide: the motion; linear between two samples as well.
            steps: of the engine between two samples.

        Raises:
            UserError: the vehicle cannot be held to that motion.
        """
        self._give(torques[0])
        self._set_going(start)
        path = _Path.of(torques, guide, steps, self._mechanics.rigid)
        forces, time = [], start.time
        for sample, unit in enumerate(path.units[:-1]):
            # The force of a sample is the mean of those that act from it to the next one.
            total = [0.0] * len(guide.stiffness)
            for step in range(sample * steps, (sample + 1) * steps):
                held = self._held(path.angles[step], path.rates[step], unit, guide)
                added = [sum(map(mul, held, column)) for column in zip(*unit, strict=True)]
                self._give(
                    [
                        torque + more / self._gear_ratio
                        for torque, more in zip(path.torques[step], added[2:], strict=True)
                    ]
                )
                self._step(time, added[:2])
                time += self.engine.step_size
                total = [sum_ + force / steps for sum_, force in zip(total, held, strict=True)]
            if not all(abs(force) < _ASTRAY for force in total):
                raise UserError(
                    "The vehicle cannot be held to the recorded motion: what holds it swings up.",
                    "Gears of all drives that give way are too soft for that; leave the elasticity of some out.",
                )
            forces.append(total)
        return [*forces, forces[-1]]

    def close(self) -> None:
        """Release the physics engine."""
        self.engine.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _set_going(self, start: Start) -> None:
        rates, still = start.joint_rates, (0.0, 0.0, 0.0)
        angles = self._mechanics.angles_read_as(start.steering, start.wheels, rates)
        self.engine.set_motion(heading=start.heading, twist=still, angles=angles, rates=[0.0] * 8)
        self._mechanics.settle()
        for _ in range(round(STANDING_TIME / self.engine.step_size)):
            self.engine.step([0.0] * 8)
        self.engine.set_motion(heading=start.heading, twist=start.twist, angles=angles, rates=rates)
        self._mechanics.move_on(start.wheels, rates)

    def _give(self, torques: Sequence[float]) -> None:
        for stage, torque in zip(self._stages, torques, strict=True):
            stage.wheel_torque = self._gear_ratio * torque

    def _held(
        self, angles: Sequence[float], rates: Sequence[float], units: Sequence[Sequence[float]], guide: Guide
    ) -> list[float]:
        """Force of each coordinate (n,) now."""
        off, late = list(map(sub, angles, self._read())), list(map(sub, rates, self._read_rates()))
        return [
            k * sum(map(mul, unit, off)) + d * sum(map(mul, unit, late))
            for unit, k, d in zip(units, guide.stiffness, guide.damping, strict=True)
        ]

    def _step(self, time: float, steering: Sequence[float] = (0.0, 0.0)) -> None:
        # As `EmulatedVehicle` has it: the forces of time t act over the step that starts at t.
        rates = self.engine.rates()
        torques = [-d * rate for d, rate in zip(self._viscous, rates, strict=True)]
        for joint in range(4):
            torques[joint] += _UNIT_SIGNS[joint] * steering[joint // 2] / 2
        self._mechanics.act(time, rates, torques)
        self.engine.step(torques)
        self._mechanics.after_step()

    def _read(self) -> list[float]:
        steering, shafts = self._mechanics.steering, self._mechanics.shafts
        return [*map(steering.steering_angle, range(2)), *map(shafts.wheel_angle, range(4))]

    def _read_rates(self) -> list[float]:
        rates, shafts = self.engine.rates(), self._mechanics.shafts
        return [rates[0], rates[2], *map(shafts.wheel_rate, range(4))]


_UNIT_SIGNS: Final = (1.0, -1.0, 1.0, -1.0)
"""The rear unit of a side turns against the front one."""


@dataclass(frozen=True)
class _Path:
    """A guide and torques at every engine step.

    Attributes:
        angles, rates, torques: by steps, as of the guide; linear between samples.
        units: (N, n, 6) weights over the sum of their squares: a coordinate's part in what the joints do is their
            product with it, by least squares, and torques that do the work of its force are its product with them.
    """

    angles: Sequence[Sequence[float]]
    rates: Sequence[Sequence[float]]
    torques: Sequence[Sequence[float]]
    units: Sequence[Sequence[Sequence[float]]]

    @classmethod
    def of(cls, torques: Sequence[Sequence[float]], guide: Guide, steps: int, rigid: Sequence[bool]) -> Self:
        """From what is known at the samples.

        A motor that turns on its own is too light to be held with the vehicle, unless there is nothing else to hold.
        """
        weights = np.asarray(guide.weights)
        firm = weights * np.array([1.0, 1.0, *rigid])
        weights = np.where(np.any(firm, axis=2, keepdims=True), firm, weights)
        units = weights / np.sum(weights**2, axis=2, keepdims=True)
        angles, rates, given = (_finer(np.asarray(each), steps) for each in (guide.readings, guide.rates, torques))
        return cls(angles.tolist(), rates.tolist(), given.tolist(), units.tolist())


def _finer(values: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Values (N, n) at every engine step, linear between the samples."""
    times = np.arange((len(values) - 1) * steps) / steps
    samples = np.arange(len(values))
    return np.stack([np.interp(times, samples, column) for column in values.T], axis=1)
