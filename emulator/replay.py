"""The emulated vehicle under torques that were recorded: from a state in motion, in the hands of nobody.

Drives and encoders are ideal here, as what they did is in the record; the load does not fluctuate, as nobody knows how
it did. What differs from the record is then bodies, friction and effects.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Final, Self

from emulator.effects import Wanted, inject
from emulator.effects.assembly import Mechanics
from emulator.effects.bodies import load_payload
from emulator.engine.choice import ENGINES
from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype
from emulator.vehicle import viscous_of
from ident.extras import default_engine

STANDING_TIME: Final = 0.1
"""Time that tyres get to take the weight before a run [s]; their heave dies out within 0.02 s."""


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

    def run(self, start: Start, torques: Sequence[Sequence[float]], steps: int) -> list[list[float]]:
        """Encoder readings (N, 6): alpha left, right, beta fl, rl, fr, rr [rad], at the samples of the torques.

        Args:
            start: the state at the first sample.
            torques: (N, 4) at the motor shafts; between two samples they change linearly [Nm].
            steps: of the engine between two samples.
        """
        self._give(torques[0])
        self._set_going(start)
        readings, time = [self._read()], start.time
        for now, then in itertools.pairwise(torques):
            for step in range(steps):
                share = step / steps
                self._give([(1 - share) * one + share * other for one, other in zip(now, then, strict=True)])
                self._step(time)
                time += self.engine.step_size
            readings.append(self._read())
        return readings

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

    def _step(self, time: float) -> None:
        # As `EmulatedVehicle` has it: the forces of time t act over the step that starts at t.
        rates = self.engine.rates()
        torques = [-d * rate for d, rate in zip(self._viscous, rates, strict=True)]
        self._mechanics.act(time, rates, torques)
        self.engine.step(torques)
        self._mechanics.after_step()

    def _read(self) -> list[float]:
        steering, shafts = self._mechanics.steering, self._mechanics.shafts
        return [*map(steering.steering_angle, range(2)), *map(shafts.wheel_angle, range(4))]
