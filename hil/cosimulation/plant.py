"""An FMU as the vehicle behind the connector: its physics, with the drives and encoders of the emulator."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from emulator.drive import Drive
from emulator.encoder import Encoder
from emulator.noise import Disturbances
from emulator.prototype import Prototype
from hil.cosimulation.instance import FmuError, FmuInstance
from ident.vehicle.geometry import WHEELS

_PREFIX: Final = "fmu:"

STEP: Final = 1e-3
"""Communication step [s]: that of the emulator's physics engine."""

EPSILON: Final = 3e-4
"""ε of the FMU's Coulomb friction [rad/s]. How far a held joint creeps is proportional to it, and wheels off straight
ahead slip: d_cw comes out 3.6 % too large at 0.01 rad/s (2 mrad off), d_vw 0.4 % at 0.001 (0.3 mrad)."""

_FREE: Final = 1e-9
"""Friction of the contacts on the jack-stand [-]: a micronewton, where a drive's own friction is some newtons."""

_STEP_TOLERANCE: Final = 1e-6
"""Fraction of a step by which a duration may miss a whole number of steps through rounding."""


def plant_path(text: str) -> Path:
    """The FMU that `fmu:FILE` names.

    Raises:
        FmuError: the text is not of that form.
    """
    if not text.startswith(_PREFIX):
        raise FmuError(f"{text!r} is no plant.", "Write fmu:FILE, with an FMU of `quasiomni fmu`.")
    return Path(text.removeprefix(_PREFIX))


class _Joints:
    """Angles and rates of the FMU's joints, as drives and encoders take them."""

    def __init__(self) -> None:
        self.step_size = STEP
        self.values: Sequence[float] = [0.0] * len(_SENSED)

    def wheel_angle(self, wheel: int) -> float:
        """[rad]."""
        return self.values[wheel]

    def wheel_rate(self, wheel: int) -> float:
        """[rad/s]."""
        return self.values[len(WHEELS) + wheel]

    def steering_angle(self, side: int) -> float:
        """As the encoder of a side (0 left, 1 right) reports it [rad]."""
        return self.values[2 * len(WHEELS) + side]


_SENSED: Final = (
    *(f"beta_{wheel}" for wheel in WHEELS),
    *(f"beta_{wheel}_dot" for wheel in WHEELS),
    "alpha_l",
    "alpha_r",
)


class FmuVehicle:
    """The vehicle of an FMU with torque inputs; hardware of the firmware, as the emulated vehicle is.

    Drives, encoders and the noise of their readings are those of a prototype; the fluctuating load of the emulator is
    not, since the FMU is the model itself.

    Args:
        path: of the FMU.
        prototype: whose drives and encoders it has.
        seed: of the noise.
        start: values of FMU variables that differ from its start values, by name; `epsilon` is EPSILON unless it is
            among them.

    Attributes:
        drives: of the wheels fl, rl, fr, rr.
        encoders: of the steering, left and right.

    Raises:
        FmuError: the FMU cannot be run, or has other inputs.
    """

    drives: tuple[Drive, Drive, Drive, Drive]
    encoders: tuple[Encoder, Encoder]

    def __init__(
        self, path: Path, prototype: Prototype, *, seed: int, start: Mapping[str, float] | None = None
    ) -> None:
        self.instance = FmuInstance(path, {"epsilon": EPSILON, **(start or {})})
        self._noise = Disturbances(prototype, seed=seed, scale=1.0, step=STEP)
        self._joints = _Joints()
        self._ratio = prototype.geometry.gear_ratio
        fl, rl, fr, rr = (
            Drive(prototype.drive, prototype.power_stage, wheel, self._ratio, self._joints, self._noise)
            for wheel in range(4)
        )
        self.drives = (fl, rl, fr, rr)
        left, right = (Encoder(prototype.encoder, side, self._joints, self._noise) for side in range(2))
        self.encoders = (left, right)
        self._torques = self.instance.port([f"torque_{wheel}" for wheel in WHEELS])
        self._friction = self.instance.port([f"friction_limit_{wheel}" for wheel in WHEELS])
        self._floor = self.instance.read(self._friction)
        self._grip = list(self._floor)
        self._lifted = False
        self._payload = self.instance.port(["payload"])
        self._sensed = self.instance.port([self.instance.reported(state) for state in _SENSED])
        self._steps = 0
        self._owed = 0.0

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * STEP

    def advance(self, duration: float) -> None:
        """Let `duration` [s] pass in whole steps; a remainder is carried to the next call."""
        self._owed += duration
        steps = math.floor(self._owed / STEP + _STEP_TOLERANCE)
        self._owed -= steps * STEP
        for _ in range(steps):
            self._step()

    def lift(self) -> None:
        """Wheels free: nothing under them has grip."""
        self._lifted = True
        self._ground()

    def lower(self) -> None:
        """Back on the floor."""
        self._lifted = False
        self._ground()

    def load(self, mass: float) -> None:
        """A load over the centre [kg]; none at zero."""
        self.instance.write(self._payload, [mass])

    def wet(self, wheel: int, coefficient: float) -> None:
        """Let a wheel (fl, rl, fr, rr: 0 to 3) roll on ground with another coefficient of friction [-]."""
        self._grip[wheel] = coefficient
        self._ground()

    def dry(self, wheel: int) -> None:
        """Give a wheel the ground back that it had before."""
        self._grip[wheel] = self._floor[wheel]
        self._ground()

    def _ground(self) -> None:
        self.instance.write(self._friction, [_FREE] * len(WHEELS) if self._lifted else self._grip)

    def close(self) -> None:
        """Free the FMU."""
        self.instance.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _step(self) -> None:
        # Torque moves within the step; the FMU gets its mean, so that it does not lag behind what the drives report.
        before = [drive.wheel_torque for drive in self.drives]
        for drive in self.drives:
            drive.advance()
        torques = [(old + drive.wheel_torque) / 2 for old, drive in zip(before, self.drives, strict=True)]
        self.instance.write(self._torques, [torque / self._ratio for torque in torques])
        self.instance.step(STEP)
        self._joints.values = self.instance.read(self._sensed)
        self._steps += 1
        self._noise.advance()
