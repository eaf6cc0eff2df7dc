"""What the contact patches of the tyres resist turning with, dry friction that is given to MuJoCo as a torque.

Of a contact that resists turning as well as sliding MuJoCo softens the turning by the square of how much more it
resists sliding: a patch that resists by 0.3 Nm would creep by 0.3 rad/s under that. What stops a unit within a step,
and no more than the patch can, creeps by thousandths of that.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.engine.layout import steering_joint
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]


class Patches:
    """Turning resistance of the patches of a model.

    Args:
        model: MuJoCo's, whose chassis is free.
        resistance: (4,) of each wheel by its load [Nm/N].

    Attributes:
        loads: (4,) forces of the floor on the wheels in the last step [N]; they are a part of the state.
    """

    def __init__(self, model: Any, resistance: Array) -> None:
        joints = [model.joint(steering_joint(wheel)).dofadr[0] for wheel in WHEELS]
        self._model, self._resistance, self._joints = model, resistance, np.array(joints)
        self._wheels = [model.body(f"wheel_{wheel}").id for wheel in WHEELS]
        self._wheel_of = {int(model.geom(f"tyre_{wheel}").id): number for number, wheel in enumerate(WHEELS)}
        # Of a unit alone: with it, what it is joined to is not stopped too far.
        self._inertias = 1 / model.dof_invweight0[self._joints]
        self.loads = np.zeros(len(WHEELS))

    def feel(self, data: Any) -> None:
        """Take the loads of the step that has been made."""
        self.loads[:] = 0.0
        force = np.zeros(6)
        for index in range(data.ncon):
            mujoco.mj_contactForce(self._model, data, index, force)
            self.loads[self._wheel_of[int(data.contact[index].geom2)]] = force[0]

    def resist(self, data: Any) -> None:
        """Give the wheels the torques that resist their turning over the next step."""
        turning = data.qvel[5] + data.qvel[self._joints]
        most = self._resistance * self.loads
        stopping = self._inertias * turning / self._model.opt.timestep
        data.xfrc_applied[self._wheels, 5] = -np.clip(stopping, -most, most)
