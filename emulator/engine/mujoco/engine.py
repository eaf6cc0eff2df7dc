"""The vehicle in MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.as_built import AsBuilt
from emulator.engine.layout import JOINTS, in_world, joint_coulomb, planar_twist, turned_to
from emulator.engine.mujoco.mjcf import DEFAULT_SOLVER, SolverSettings, generate_mjcf, overlap, quarter_weight
from emulator.engine.mujoco.patches import Patches
from emulator.engine.protocol import STAND_CLEARANCE
from emulator.rigid_bodies import RigidBody
from ident.vehicle.geometry import WHEELS

_FRONT_OF_SIDE = (0, 2)
_ROLLING = 4
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class MuJoCoEngine:
    """An `emulator.engine.protocol.Engine`.

    MuJoCo integrates by semi-implicit Euler: a step's velocities are those of the middle of the step, its positions
    those of the end. Dry friction of a joint is a constraint of limited torque that stops it, `frictionloss`.

    Args:
        built: the vehicle.
        step_size: [s].
        gui: show it in a window.
        settings: of solver and contacts.

    Attributes:
        model, data: MuJoCo's own, for tests, pictures and benchmarks.

    Raises:
        UserError: a window is asked for where there is no display.
    """

    model: Any
    data: Any

    def __init__(
        self, built: AsBuilt, *, step_size: float, gui: bool, settings: SolverSettings = DEFAULT_SOLVER
    ) -> None:
        self.step_size = step_size
        self._settings = settings
        self._viewer: Any = None
        self._gui = gui
        self.build(built)
        self.coulomb = joint_coulomb(built.prototype.truth)
        self.place(on_stand=False, angles=[0.0] * 8)

    def build(self, built: AsBuilt) -> None:
        """Build the vehicle so the next time that it is placed."""
        self._built = built
        self._prototype = built.prototype

    def place(self, *, on_stand: bool, angles: Sequence[float]) -> None:
        """Put the vehicle at rest at the origin, on the floor or on the jack-stand.

        Args:
            on_stand: chassis held, wheels in the air.
            angles: (8,) joint angles [rad].
        """
        text = generate_mjcf(self._built, step_size=self.step_size, on_stand=on_stand, settings=self._settings)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self._dry = self.model.pair_friction.copy()
        self._tyres = [int(self.model.geom(f"tyre_{wheel}").id) for wheel in WHEELS]
        self._give_tyres_their_stiffness()
        resistance = np.array([wheel.patch_torque for wheel in self._built.wheels]) / quarter_weight(self._prototype)
        self._patches = None if on_stand or not resistance.any() else Patches(self.model, resistance)
        # A unit's steering joint comes before its rolling joint, and both behind what floats: views, made once.
        self._joint_torques = self.data.qfrc_applied[-8:]
        self._joint_angles = self.data.qpos[-8:]
        self._joint_rates = self.data.qvel[-8:]
        self._joint_friction = self.model.dof_frictionloss[-8:]
        self._chassis = int(self.model.body("chassis").id)
        height = self._prototype.body.centre_height + (STAND_CLEARANCE if on_stand else -overlap(self._prototype) / 2)
        self._base: tuple[float, float, float] | None = (0.0, 0.0, height) if on_stand else None
        if on_stand:
            self.model.body_pos[self._chassis, 2] = height
        else:
            self.data.qpos[2] = height
        self._joint_angles[:] = by_unit(angles)
        self.set_friction(self.coulomb)
        mujoco.mj_forward(self.model, self.data)
        self._load_patches()
        self._pushed = False
        self._read()
        self._previous = self._rates
        self._show()

    def set_motion(
        self, *, heading: float, twist: tuple[float, float, float], angles: Sequence[float], rates: Sequence[float]
    ) -> None:
        """Let the vehicle move as if it had done so over the last step; `Engine.set_motion` says how."""
        if self._base is None:
            qx, qy, qz, qw = turned_to(heading, self.base_pose()[1])
            self.data.qpos[:2] = 0.0
            self.data.qpos[3:7] = qw, qx, qy, qz
            linear, angular = in_world(twist, heading)
            self.data.qvel[:3] = linear
            # MuJoCo has the linear velocity in the world, the angular one in the body's frame.
            backwards = np.array([qw, -qx, -qy, -qz])
            turned = np.zeros(3)
            mujoco.mju_rotVecQuat(turned, np.array(angular), backwards)
            self.data.qvel[3:6] = turned
        self._joint_angles[:] = by_unit(angles)
        self._joint_rates[:] = by_unit(rates)
        self.data.qacc_warmstart[:] = 0.0
        mujoco.mj_forward(self.model, self.data)
        self._load_patches()
        self._read()
        self._previous = self._rates

    def step(self, torques: Sequence[float]) -> None:
        """One engine step under the joint torques (8,) [Nm]."""
        self._joint_torques[:] = by_unit(torques)
        if self._patches is not None:
            self._patches.resist(self.data)
        mujoco.mj_step(self.model, self.data)
        self._load_patches()
        if self._pushed:
            self.data.xfrc_applied[self._chassis] = 0.0
            self._pushed = False
        self._previous = self._rates
        self._read()
        if self._viewer is not None:
            self._viewer.sync()

    def set_friction(self, torques: Sequence[float]) -> None:
        """Largest torque of the dry friction in each joint from now on (8,) [Nm]."""
        self._joint_friction[:] = by_unit(torques)

    def set_ground(self, wheel: int, friction: float | None) -> None:
        """Give a wheel (fl, rl, fr, rr: 0 to 3) ground of another friction coefficient [-]; None is that of before."""
        pair = self.model.pair(WHEELS[wheel]).id
        self.model.pair_friction[pair, :2] = self._dry[pair, :2] if friction is None else friction

    def push(self, force: tuple[float, float, float]) -> None:
        """A force on the chassis in its own frame, at its centre of mass, for the next step [N]."""
        if self._base is None:
            turned = np.zeros(3)
            mujoco.mju_rotVecQuat(turned, np.array(force), self.data.qpos[3:7])
            self.data.xfrc_applied[self._chassis, :3] += turned
            self._pushed = True

    def angles(self) -> list[float]:
        """(8,) joint angles [rad]."""
        return list(self._angles)

    def mean_rates(self) -> list[float]:
        """(8,) joint rates over the last step, that is half a step ago [rad/s]."""
        return list(self._rates)

    def rates(self) -> list[float]:
        """(8,) joint rates now [rad/s], extrapolated to second order from the last two steps."""
        return [1.5 * now - 0.5 * before for now, before in zip(self._rates, self._previous, strict=True)]

    def steering_angle(self, side: int) -> float:
        """Steering angle of the front wheel of a side (0 left, 1 right) [rad]."""
        return self._angles[_FRONT_OF_SIDE[side]]

    def wheel_angle(self, wheel: int) -> float:
        """Rolling angle of a wheel [rad], unbounded."""
        return self._angles[_ROLLING + wheel]

    def wheel_rate(self, wheel: int) -> float:
        """Rolling rate of a wheel now [rad/s]."""
        joint = _ROLLING + wheel
        return 1.5 * self._rates[joint] - 0.5 * self._previous[joint]

    def base_pose(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Position [m] of the centre and orientation quaternion (x, y, z, w) of the chassis in the world."""
        if self._base is not None:
            return self._base, (0.0, 0.0, 0.0, 1.0)
        x, y, z, qw, qx, qy, qz = self.data.qpos[:7].tolist()
        return (x, y, z), (qx, qy, qz, qw)

    def base_velocity(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Linear [m/s] and angular [rad/s] velocity of the chassis in the world, over the last step."""
        if self._base is not None:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        turned = np.zeros(3)
        mujoco.mju_rotVecQuat(turned, self.data.qvel[3:6], self.data.qpos[3:7])
        return tuple(self.data.qvel[:3].tolist()), tuple(turned.tolist())

    def twist(self) -> tuple[float, float, float]:
        """(x', y', gamma') of the chassis in its own frame [m/s, m/s, rad/s], of half a step ago."""
        linear, angular = self.base_velocity()
        return planar_twist(linear, angular[2], self.base_pose()[1])

    def floor_forces(self) -> list[tuple[float, float]]:
        """Normal and friction force of the floor on each wheel (4,) [N, N]."""
        forces, force = np.zeros((len(WHEELS), 3)), np.zeros(6)
        for index in range(self.data.ncon):
            mujoco.mj_contactForce(self.model, self.data, index, force)
            # A cylinder touches the floor twice.
            forces[self._tyres.index(int(self.data.contact[index].geom2))] += force[:3]
        return [(normal, math.hypot(one, other)) for normal, one, other in forces.tolist()]

    def bodies(self) -> Mapping[str, RigidBody]:
        """Chassis, knuckles and wheels: mass, centre of mass in the world, inertias."""
        model, data = self.model, self.data
        mujoco.mj_comPos(model, data)
        return {
            model.body(index).name: RigidBody(
                float(model.body_mass[index]),
                tuple(data.xipos[index].tolist()),
                tuple(model.body_inertia[index].tolist()),
            )
            for index in range(1, model.nbody)
        }

    def steering_stops(self) -> list[tuple[float, float]]:
        """Smallest and largest steering angle of each unit (4,) [rad]."""
        return [tuple(self.model.joint(name).range.tolist()) for name in JOINTS[:_ROLLING]]

    def save(self) -> NDArray[np.float64]:
        """Everything that the next steps depend on; `restore` goes on from it bit by bit."""
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, state, _STATE)
        loads = np.zeros(0) if self._patches is None else self._patches.loads
        grip = self.model.pair_friction.ravel()
        return np.concatenate([state, self._previous, self._joint_friction, grip, loads])

    def restore(self, saved: NDArray[np.float64]) -> None:
        """Go on from what `save` gave, of a vehicle that was built and placed alike."""
        size = mujoco.mj_stateSize(self.model, _STATE)
        mujoco.mj_setState(self.model, self.data, saved[:size], _STATE)
        self._read()
        self._previous = saved[size : size + 8].tolist()
        self._joint_friction[:] = saved[size + 8 : size + 16]
        grip = self.model.pair_friction
        grip[:] = saved[size + 16 : size + 16 + grip.size].reshape(grip.shape)
        if self._patches is not None:
            self._patches.loads[:] = saved[size + 16 + grip.size :]

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def _load_patches(self) -> None:
        if self._patches is not None:
            self._patches.loads[:] = [normal for normal, _ in self.floor_forces()]

    def _read(self) -> None:
        angles, rates = self._joint_angles.tolist(), self._joint_rates.tolist()
        self._angles: list[float] = angles[0::2] + angles[1::2]
        self._rates: list[float] = rates[0::2] + rates[1::2]

    def _give_tyres_their_stiffness(self) -> None:
        """Make the contact normal a spring and a damper of the tyre's stiffness.

        MuJoCo's constraint gives f = (-b v - k d r - a) / R with R = (1 - d) / d times the inverse mass A that it
        estimates of the two bodies, and in the direct format of `solref` k = k' / d^2, b = b' / d. So
        k' = (1 - d) A K makes it a spring K; what -a / R adds is an inertia along the normal alone.
        """
        tyre, give = self._prototype.tyre, 1 - self._settings.contact_impedance
        damping = 2 * tyre.damping_ratio * math.sqrt(tyre.stiffness * self._prototype.truth["m_ch"] / 4)
        for wheel in WHEELS:
            inverse_mass = self.model.body_invweight0[self.model.body(f"wheel_{wheel}").id, 0]
            reference = [-give * inverse_mass * tyre.stiffness, -give * inverse_mass * damping]
            self.model.pair_solref[self.model.pair(wheel).id] = reference

    def _show(self) -> None:
        if self._gui:
            from emulator.engine.mujoco.window import open_window

            self.close()
            self._viewer = open_window(self.model, self.data)


def by_unit(values: Sequence[float]) -> Sequence[float]:
    """Values of the eight joints as MuJoCo has them: steering and rolling of a wheel, then of the next."""
    sfl, srl, sfr, srr, rfl, rrl, rfr, rrr = values
    return sfl, rfl, srl, rrl, sfr, rfr, srr, rrr
