"""What the emulated vehicle needs of a physics engine, whichever it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from emulator.as_built import AsBuilt
from emulator.engine.camera import Camera
from emulator.rigid_bodies import RigidBody

STAND_CLEARANCE = 0.05
"""Height of the wheels above the floor on the jack-stand [m]."""


class Engine(Protocol):
    """A vehicle of eight joints, steering fl, rl, fr, rr, then rolling fl, rl, fr, rr, on a floor or on a jack-stand.

    A vehicle is placed before its first step. An engine that integrates by semi-implicit Euler has the rates of the
    middle of a step, and the angles of its end; both are asked for by what they are.

    Attributes:
        step_size: [s].
        coulomb: (8,) largest torque of the dry friction in each joint, as built [Nm].
    """

    step_size: float
    coulomb: list[float]

    def build(self, built: AsBuilt) -> None:
        """Build the vehicle so the next time that it is placed."""

    def place(self, *, on_stand: bool, angles: Sequence[float]) -> None:
        """Put the vehicle at rest at the origin, on dry ground or on the jack-stand, where the chassis is held.

        Args:
            on_stand: wheels in the air.
            angles: (8,) of the joints [rad].
        """

    def set_motion(
        self, *, heading: float, twist: tuple[float, float, float], angles: Sequence[float], rates: Sequence[float]
    ) -> None:
        """Let the vehicle, where it was placed, move as if it had done so over the last step; at the origin.

        The chassis keeps height and tilt; on the jack-stand it is held, and only the joints move.

        Args:
            heading: of the chassis in the world [rad].
            twist: (x', y', gamma') in its own frame, of half a step ago [m/s, m/s, rad/s].
            angles: (8,) of the joints now [rad].
            rates: (8,) of the joints, of half a step ago [rad/s]; those of twist and rolling wheels agree.
        """

    def step(self, torques: Sequence[float]) -> None:
        """One step under the joint torques (8,) [Nm]."""

    def set_friction(self, torques: Sequence[float]) -> None:
        """Largest torque of the dry friction in each joint from now on (8,) [Nm]."""

    def set_ground(self, wheel: int, friction: float | None) -> None:
        """Give a wheel (fl, rl, fr, rr: 0 to 3) ground of another friction coefficient [-]; None is that of before."""

    def push(self, force: tuple[float, float, float]) -> None:
        """A force on the chassis in its own frame, at its centre of mass, for the next step [N]."""

    def angles(self) -> list[float]:
        """(8,) joint angles [rad]."""

    def rates(self) -> list[float]:
        """(8,) joint rates now [rad/s]."""

    def mean_rates(self) -> list[float]:
        """(8,) joint rates over the last step, that is half a step ago [rad/s]."""

    def steering_angle(self, side: int) -> float:
        """Steering angle of the front wheel of a side (0 left, 1 right) [rad]."""

    def wheel_angle(self, wheel: int) -> float:
        """Rolling angle of a wheel [rad], unbounded."""

    def wheel_rate(self, wheel: int) -> float:
        """Rolling rate of a wheel now [rad/s]."""

    def base_pose(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Position [m] of the centre and orientation quaternion (x, y, z, w) of the chassis in the world."""

    def base_velocity(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Linear [m/s] and angular [rad/s] velocity of the chassis' centre in the world, over the last step."""

    def twist(self) -> tuple[float, float, float]:
        """(x', y', gamma') of the chassis in its own frame [m/s, m/s, rad/s], of half a step ago."""

    def floor_forces(self) -> list[tuple[float, float]]:
        """Normal and friction force of the floor on each wheel, fl, rl, fr, rr (4,) [N, N]."""

    def bodies(self) -> Mapping[str, RigidBody]:
        """Chassis, knuckles and wheels as the engine holds them: mass, centre of mass in the world now, inertias."""

    def steering_stops(self) -> list[tuple[float, float]]:
        """Smallest and largest steering angle of each unit, fl, rl, fr, rr (4,) [rad]."""

    def close(self) -> None:
        """Release the physics world."""


class MakeEngine(Protocol):
    """What makes an engine with a vehicle in it, on the floor."""

    def __call__(self, built: AsBuilt, *, step_size: float, gui: bool) -> Engine:
        """An engine of a step [s], with a window or without.

        Raises:
            UserError: a window is asked for where there is no display.
        """


class Painter(Protocol):
    """Draws pictures of a vehicle, without a display.

    It has a world of its own, where it puts a vehicle that looks like the one to be drawn: what is drawn cannot change
    what happens.
    """

    def paint(
        self, position: Sequence[float], orientation: Sequence[float], angles: Sequence[float], camera: Camera
    ) -> NDArray[np.uint8]:
        """A picture (height, width, 3): red, green, blue.

        Args:
            position: of the chassis' centre in the world [m].
            orientation: its quaternion (x, y, z, w).
            angles: (8,) of the joints [rad].
            camera: that sees it.
        """

    def close(self) -> None:
        """Release that world."""


class MakePainter(Protocol):
    """What makes a painter of a vehicle."""

    def __call__(self, built: AsBuilt, *, width: int, height: int) -> Painter:
        """A painter of pictures of a size [pixels].

        Raises:
            UserError: there is nothing to draw with.
        """
