"""The vehicle in PyBullet, with an explicit client."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import pybullet

from emulator.as_built import AsBuilt
from emulator.engine.layout import JOINTS, in_world, joint_coulomb, planar_twist, turned_to
from emulator.engine.protocol import STAND_CLEARANCE
from emulator.engine.pybullet.urdf import generate_urdf
from emulator.engine.pybullet.window import open_window
from emulator.engine.pybullet.world import (
    DEFAULT_SOLVER as DEFAULT_SOLVER,
)
from emulator.engine.pybullet.world import (
    SolverSettings as SolverSettings,
)
from emulator.engine.pybullet.world import (
    couple,
    load_vehicle,
    prepare_world,
    set_surfaces,
)
from emulator.rigid_bodies import RigidBody
from ident.vehicle.geometry import WHEELS
from ident.vehicle.quantities import GRAVITY

_FRONT_OF_SIDE: Final = (0, 2)
_ROLLING: Final = 4
_FLOOR: Final = 0
_OUT_OF_REACH: Final = 1.0
"""Height at which no wheel touches the floor [m]."""
_MASS: Final = 0
_LATERAL_FRICTION: Final = 1
_INERTIA: Final = 2
"""Where `getDynamicsInfo` has them."""
_LOWER_LIMIT: Final = 8
_LINK_NAME: Final = 12
"""Where `getJointInfo` has them."""
_LINK_OF_CONTACT: Final = 3
_NORMAL_FORCE: Final = 9
_ONE_FRICTION: Final = 10
_OTHER_FRICTION: Final = 12
"""Where `getContactPoints` has them."""


class PyBulletEngine:
    """An `emulator.engine.protocol.Engine`.

    PyBullet integrates by semi-implicit Euler: a step's velocities are those of the middle of the step, its positions
    those of the end. Coulomb friction is a velocity motor with target zero, true dry friction.

    Args:
        built: the vehicle.
        step_size: [s].
        gui: show it in a window.
        settings: of the constraint solver.

    Attributes:
        client: PyBullet's id of this physics world.
        body: PyBullet's id of the vehicle in it.
        joints: PyBullet's indices of the eight joints.

    Raises:
        UserError: a window is asked for where there is no display.
    """

    client: int
    body: int
    joints: list[int]

    def __init__(
        self, built: AsBuilt, *, step_size: float, gui: bool, settings: SolverSettings = DEFAULT_SOLVER
    ) -> None:
        self.step_size = step_size
        self._settings = settings
        self.build(built)
        self.coulomb = joint_coulomb(built.prototype.truth)
        self.client = open_window() if gui else pybullet.connect(pybullet.DIRECT)
        self.place(on_stand=False, angles=[0.0] * 8)

    def build(self, built: AsBuilt) -> None:
        """Build the vehicle so the next time that it is placed."""
        self._built = built
        self._prototype = built.prototype
        self._urdf = generate_urdf(built)

    def place(self, *, on_stand: bool, angles: Sequence[float]) -> None:
        """Put the vehicle at rest at the origin, on the floor or on the jack-stand.

        On the stand the chassis is a fixed base, not a soft constraint: it takes any reaction.

        Args:
            on_stand: chassis held, wheels in the air.
            angles: (8,) joint angles [rad].
        """
        prepare_world(self.client, self._built, self.step_size, self._settings)
        self._on_stand = on_stand
        self._dry: dict[int, float] = {}
        lift = STAND_CLEARANCE if on_stand else -self._deflection()
        self.body = load_vehicle(self.client, self._urdf, self._prototype.body.centre_height + lift, fixed=on_stand)
        by_name = self._joint_indices()
        self.joints = [by_name[name] for name in JOINTS]
        set_surfaces(self.client, self.body, self.joints[_ROLLING:], self._built)
        for side, front in enumerate((0, 2)):
            if self._built.couplings[side] is None:
                couple(self.client, self.body, self.joints[front], self.joints[front + 1], self._settings)
        for joint, angle in zip(self.joints, angles, strict=True):
            pybullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=self.client)
        self.set_friction(self.coulomb)
        self._states = self._previous = self._read()

    def set_motion(
        self, *, heading: float, twist: tuple[float, float, float], angles: Sequence[float], rates: Sequence[float]
    ) -> None:
        """Let the vehicle move as if it had done so over the last step; `Engine.set_motion` says how."""
        client = self.client
        if not self._on_stand:
            (_, _, height), orientation = self.base_pose()
            turned = turned_to(heading, orientation)
            arm = pybullet.rotateVector(turned, self._arm() or (0.0, 0.0, 0.0))
            linear, angular = in_world(twist, heading)
            # PyBullet has place and speed of the centre of mass.
            place = [c - a for c, a in zip((0.0, 0.0, height), arm, strict=True)]
            speed = [v - c for v, c in zip(linear, _cross(angular, arm), strict=True)]
            # Contact points are kept as long as they are near: of a wheel that is turned by hand, old ones would stay.
            away = [place[0], place[1], place[2] + _OUT_OF_REACH]
            pybullet.resetBasePositionAndOrientation(self.body, away, turned, physicsClientId=client)
            pybullet.performCollisionDetection(client)
            pybullet.resetBasePositionAndOrientation(self.body, place, turned, physicsClientId=client)
            pybullet.resetBaseVelocity(self.body, speed, angular, physicsClientId=client)
        for joint, angle, rate in zip(self.joints, angles, rates, strict=True):
            pybullet.resetJointState(self.body, joint, angle, rate, physicsClientId=client)
        self._states = self._previous = self._read()

    def step(self, torques: Sequence[float]) -> None:
        """One engine step under the joint torques (8,) [Nm]."""
        client = self.client
        pybullet.setJointMotorControlArray(
            self.body, self.joints, pybullet.TORQUE_CONTROL, forces=torques, physicsClientId=client
        )
        pybullet.stepSimulation(client)
        self._previous = self._states
        self._states = pybullet.getJointStates(self.body, self.joints, client)

    def set_friction(self, torques: Sequence[float]) -> None:
        """Largest torque of the dry friction in each joint from now on (8,) [Nm]."""
        pybullet.setJointMotorControlArray(
            self.body,
            self.joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[0.0] * 8,
            forces=torques,
            physicsClientId=self.client,
        )

    def set_ground(self, wheel: int, friction: float | None) -> None:
        """Give a wheel (fl, rl, fr, rr: 0 to 3) ground of another friction coefficient [-]; None is that of before."""
        link = self.joints[_ROLLING + wheel]
        self._dry.setdefault(wheel, self._surface(self.body, link))
        # The engine multiplies the coefficients of the two surfaces.
        grip = self._dry[wheel] if friction is None else friction / self._surface(_FLOOR, -1)
        pybullet.changeDynamics(self.body, link, lateralFriction=grip, physicsClientId=self.client)

    def push(self, force: tuple[float, float, float]) -> None:
        """A force on the chassis in its own frame, at its centre of mass, for the next step [N]."""
        pybullet.applyExternalForce(
            self.body, -1, force, (0.0, 0.0, 0.0), pybullet.LINK_FRAME, physicsClientId=self.client
        )

    def angles(self) -> list[float]:
        """(8,) joint angles [rad]."""
        return [state[0] for state in self._states]

    def mean_rates(self) -> list[float]:
        """(8,) joint rates over the last step, that is half a step ago [rad/s]."""
        return [state[1] for state in self._states]

    def rates(self) -> list[float]:
        """(8,) joint rates now [rad/s], extrapolated to second order from the last two steps."""
        return [1.5 * now[1] - 0.5 * before[1] for now, before in zip(self._states, self._previous, strict=True)]

    def steering_angle(self, side: int) -> float:
        """Steering angle of the front wheel of a side (0 left, 1 right) [rad]."""
        return float(self._states[_FRONT_OF_SIDE[side]][0])

    def wheel_angle(self, wheel: int) -> float:
        """Rolling angle of a wheel [rad], unbounded."""
        return float(self._states[_ROLLING + wheel][0])

    def wheel_rate(self, wheel: int) -> float:
        """Rolling rate of a wheel now [rad/s]."""
        joint = _ROLLING + wheel
        return float(1.5 * self._states[joint][1] - 0.5 * self._previous[joint][1])

    def base_pose(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Position [m] of the centre and orientation quaternion (x, y, z, w) of the chassis in the world."""
        position, orientation = pybullet.getBasePositionAndOrientation(self.body, self.client)
        return self._centre(position, orientation), orientation

    def base_velocity(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Linear [m/s] and angular [rad/s] velocity of the chassis in the world, over the last step."""
        linear, angular = pybullet.getBaseVelocity(self.body, self.client)
        arm = self._arm()
        if arm is not None:
            _, orientation = pybullet.getBasePositionAndOrientation(self.body, self.client)
            turned = pybullet.rotateVector(orientation, arm)
            linear = tuple(v + c for v, c in zip(linear, _cross(angular, turned), strict=True))
        return linear, angular

    def twist(self) -> tuple[float, float, float]:
        """(x', y', gamma') of the chassis in its own frame [m/s, m/s, rad/s], of half a step ago."""
        linear, angular = self.base_velocity()
        return planar_twist(linear, angular[2], self.base_pose()[1])

    def floor_forces(self) -> list[tuple[float, float]]:
        """Normal and friction force of the floor on each wheel (4,) [N, N]."""
        forces = [(0.0, 0.0)] * len(WHEELS)
        for contact in pybullet.getContactPoints(self.body, physicsClientId=self.client):
            wheel = self.joints.index(contact[_LINK_OF_CONTACT]) - _ROLLING
            forces[wheel] = (contact[_NORMAL_FORCE], math.hypot(contact[_ONE_FRICTION], contact[_OTHER_FRICTION]))
        return forces

    def bodies(self) -> Mapping[str, RigidBody]:
        """Chassis, knuckles and wheels: mass, centre of mass in the world, inertias."""
        position, _ = pybullet.getBasePositionAndOrientation(self.body, self.client)
        centres = {-1: ("chassis", position)}
        for link in range(pybullet.getNumJoints(self.body, self.client)):
            name = pybullet.getJointInfo(self.body, link, self.client)[_LINK_NAME].decode()
            centres[link] = (name, pybullet.getLinkState(self.body, link, physicsClientId=self.client)[0])
        infos = {link: pybullet.getDynamicsInfo(self.body, link, self.client) for link in centres}
        return {
            name: RigidBody(infos[link][_MASS], centre, infos[link][_INERTIA])
            for link, (name, centre) in centres.items()
        }

    def steering_stops(self) -> list[tuple[float, float]]:
        """Smallest and largest steering angle of each unit (4,) [rad]."""
        infos = (pybullet.getJointInfo(self.body, joint, self.client) for joint in self.joints[:_ROLLING])
        return [(info[_LOWER_LIMIT], info[_LOWER_LIMIT + 1]) for info in infos]

    def close(self) -> None:
        """Disconnect from the physics world."""
        if pybullet.isConnected(self.client):
            pybullet.disconnect(self.client)

    def _arm(self) -> tuple[float, float, float] | None:
        """From the chassis' centre of mass to its centre, in its frame [m]; None where they are one."""
        x, y, z = self._prototype.rigid_bodies.chassis.centre
        return (-x, -y, -z) if x or y or z else None

    def _centre(self, position: tuple[float, ...], orientation: tuple[float, ...]) -> tuple[float, ...]:
        arm = self._arm()
        if arm is None:
            return position
        turned = pybullet.rotateVector(orientation, arm)
        return tuple(p + t for p, t in zip(position, turned, strict=True))

    def _surface(self, body: int, link: int) -> float:
        return float(pybullet.getDynamicsInfo(body, link, self.client)[_LATERAL_FRICTION])

    def _read(self) -> Any:
        return pybullet.getJointStates(self.body, self.joints, self.client)

    def _joint_indices(self) -> Mapping[str, int]:
        count = pybullet.getNumJoints(self.body, self.client)
        infos = (pybullet.getJointInfo(self.body, index, self.client) for index in range(count))
        return {info[1].decode(): info[0] for info in infos}

    def _deflection(self) -> float:
        """What a tyre gives way under a quarter of the weight [m]."""
        return self._prototype.truth["m_ch"] * GRAVITY / 4 / self._prototype.tyre.stiffness


def _cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
