"""The emulated vehicle: what the firmware and the bench see of the physics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Final, Self

from emulator.drive import Drive
from emulator.effects import Wanted, inject
from emulator.effects.assembly import Mechanics
from emulator.effects.bodies import load_payload
from emulator.encoder import Encoder
from emulator.engine.choice import ENGINES
from emulator.engine.protocol import MakeEngine
from emulator.noise import Disturbances
from emulator.prototype import Prototype
from ident.extras import default_engine
from ident.vehicle.parameters import Parameters

SETTLING_TIME: Final = 0.5
"""Time that the vehicle gets to come to rest on the floor [s]; it does not count as simulated time."""

_STEP_TOLERANCE: Final = 1e-6
"""Fraction of a step by which a duration may miss a whole number of steps through rounding."""


@dataclass(frozen=True)
class GroundTruth:
    """What only a simulation knows. For tests and the picture on the screen, never on the bus.

    Attributes:
        time: [s].
        pose: x, y, gamma of the chassis in the world [m, m, rad].
        twist: (x', y', gamma')_ch in the chassis frame [m/s, m/s, rad/s], of half an engine step ago.
        steering_angles: alpha left, right [rad].
        wheel_angles: beta fl, rl, fr, rr [rad].
        steering_rates, wheel_rates: of half an engine step ago [rad/s].
        coupling_error: front plus rear steering angle of each side, zero for an ideal coupling [rad].
    """

    time: float
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    steering_angles: tuple[float, float]
    wheel_angles: tuple[float, float, float, float]
    steering_rates: tuple[float, float]
    wheel_rates: tuple[float, float, float, float]
    coupling_error: tuple[float, float]


def viscous_of(truth: Parameters) -> list[float]:
    """Viscous friction of the eight joints (8,) [Nm s/rad]: a side's is shared by its two units."""
    return [truth[symbol] / 2 for symbol in ("d_vl", "d_vl", "d_vr", "d_vr")] + [truth["d_vw"]] * 4


class EmulatedVehicle:
    """Physics, drives and sensors behind the connector.

    Args:
        prototype: what to emulate.
        seed: of all randomness; equal seeds and calls give bit-identical results.
        gui: show the vehicle in a window.
        noise_scale: factor on every random source; 0 switches noise off.
        engine_step: [s].
        make_engine: what makes the physics engine; None: PyBullet where it is installed, otherwise MuJoCo.
        effects: that it has beyond its prototype file.

    Attributes:
        drives: of the wheels fl, rl, fr, rr.
        encoders: of the steering, left and right.
        engine: the physics below, for benchmarks, tests and pictures.
        built: what it is, effects included.

    Raises:
        UserError: a window is asked for where there is no display, or the vehicle cannot have these effects.
    """

    drives: tuple[Drive, Drive, Drive, Drive]
    encoders: tuple[Encoder, Encoder]

    def __init__(
        self,
        prototype: Prototype,
        *,
        seed: int,
        gui: bool = False,
        noise_scale: float = 1.0,
        engine_step: float = 1e-3,
        make_engine: MakeEngine | None = None,
        effects: Sequence[Wanted] = (),
    ) -> None:
        injection = inject(prototype, effects, engine_step)
        self.built = injection.built
        prototype = injection.built.prototype
        make_engine = make_engine or ENGINES[default_engine()]
        self.engine = make_engine(injection.built, step_size=engine_step, gui=gui)
        self._mechanics = Mechanics(injection, self.engine)
        self._noise = Disturbances(prototype, seed=seed, scale=noise_scale, step=engine_step)
        ratio = prototype.geometry.gear_ratio
        fl, rl, fr, rr = (
            Drive(prototype.drive, prototype.power_stage, wheel, ratio, self._mechanics.shafts, self._noise)
            for wheel in range(4)
        )
        self.drives = (fl, rl, fr, rr)
        left, right = (Encoder(prototype.encoder, side, self._mechanics.steering, self._noise) for side in range(2))
        self.encoders = (left, right)
        self._mechanics.connect(self.drives)
        self._viscous = viscous_of(prototype.truth)
        self._steps = 0
        self._owed = 0.0
        self._settle()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self.engine.step_size

    def advance(self, duration: float) -> None:
        """Let `duration` [s] pass in whole engine steps; a remainder is carried to the next call."""
        step = self.engine.step_size
        self._owed += duration
        steps = math.floor(self._owed / step + _STEP_TOLERANCE)
        self._owed -= steps * step
        for _ in range(steps):
            self._step()
            self._steps += 1

    def lift(self) -> None:
        """Put the vehicle on the jack-stand: chassis held, wheels free in the air, everything at rest.

        Angles and the state of the drives stay.
        """
        self.engine.place(on_stand=True, angles=self.engine.angles())
        self._mechanics.settle()

    def lower(self) -> None:
        """Take the vehicle off the jack-stand: on the floor at the origin, settled and at rest.

        Angles and the state of the drives stay.
        """
        self.engine.place(on_stand=False, angles=self.engine.angles())
        self._settle()

    def stand_as(self, steering: tuple[float, float], wheels: Sequence[float], *, lifted: bool) -> None:
        """Put the vehicle at rest at the origin, its encoders at these angles; tyres that settle may add to them.

        Args:
            steering: left, right [rad].
            wheels: (4,) fl, rl, fr, rr [rad].
            lifted: on the jack-stand.
        """
        angles = self._mechanics.angles_read_as(steering, wheels, [0.0] * 8)
        self.engine.place(on_stand=lifted, angles=angles)
        if lifted:
            self._mechanics.settle()
        else:
            self._settle()

    def load(self, mass: float) -> None:
        """Put a load [kg] on the chassis, over its centre, instead of any load before; at rest at the origin.

        Angles and the state of the drives stay.
        """
        self.engine.build(replace(self.built, prototype=load_payload(self.built.prototype, mass, 0.0)))
        self.lower()

    def wet(self, wheel: int, coefficient: float) -> None:
        """Let a wheel (fl, rl, fr, rr: 0 to 3) roll on ground with another coefficient of friction [-].

        Placing the vehicle anew (jack-stand, floor) gives it dry ground again.
        """
        self.engine.set_ground(wheel, coefficient)

    def dry(self, wheel: int) -> None:
        """Give a wheel the ground back that it had before."""
        self.engine.set_ground(wheel, None)

    def ground_truth(self) -> GroundTruth:
        """The true state now."""
        (x, y, _), (_, _, qz, qw) = self.engine.base_pose()
        heading = 2 * math.atan2(qz, qw)
        angles, rates = self.engine.angles(), self.engine.mean_rates()
        return GroundTruth(
            time=self.time,
            pose=(x, y, heading),
            twist=self.engine.twist(),
            steering_angles=(angles[0], angles[2]),
            wheel_angles=(angles[4], angles[5], angles[6], angles[7]),
            steering_rates=(rates[0], rates[2]),
            wheel_rates=(rates[4], rates[5], rates[6], rates[7]),
            coupling_error=(angles[0] + angles[1], angles[2] + angles[3]),
        )

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

    def _settle(self) -> None:
        idle = [0.0] * 8
        for _ in range(round(SETTLING_TIME / self.engine.step_size)):
            self.engine.step(idle)
        self._mechanics.settle()

    def _step(self) -> None:
        # Leapfrog: the forces of time t act over the step that starts at t: the torque that the drive reports
        # at t, and viscous friction by the rate at t.
        load, rates = self._noise.load, self.engine.rates()
        torques = [extra - d * rate for extra, d, rate in zip(load, self._viscous, rates, strict=True)]
        self._mechanics.act(self.time, rates, torques)
        self.engine.step(torques)
        self._mechanics.after_step()
        for drive in self.drives:
            drive.advance()
        self._noise.advance()
