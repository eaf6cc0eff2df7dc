"""What the contact patches of the tyres resist turning with: dry friction that is given to MuJoCo as a torque.

Of a contact that resists turning as well as sliding MuJoCo softens the turning by the square of how much more it
resists sliding: a patch of 0.3 Nm that is loaded by nearly that would turn by 0.2 rad/s.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from emulator.engine.layout import steering_joint
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

_YAW: Final = 5
"""Of the chassis in MuJoCo's velocities, and about the vertical in its forces on a body."""


class Patches:
    """Turning resistance of the patches of a model whose chassis is free.

    Args:
        model: MuJoCo's.
        resistance: (4,) of each wheel by its load [Nm/N].

    Attributes:
        loads: (4,) normal forces of the floor on the wheels in the last step [N]; they are a part of the state.
    """

    def __init__(self, model: Any, resistance: Array) -> None:
        self._resistance, self._step = resistance, model.opt.timestep
        self._joints = np.array([model.joint(steering_joint(wheel)).dofadr[0] for wheel in WHEELS])
        self._wheels = [model.body(f"wheel_{wheel}").id for wheel in WHEELS]
        # Of a unit alone: less than what turns with it, so that it is never turned back.
        self._inertias = 1 / model.dof_invweight0[self._joints]
        self.loads = np.zeros(len(WHEELS))

    def resist(self, data: Any) -> None:
        """Give the wheels the torques that stop their turning within the next step, as far as the patches can.

        To the torques that are there comes what stops the turning that those leave: what is held does not creep.
        """
        turning, speeding_up = (rates[_YAW] + rates[self._joints] for rates in (data.qvel, data.qacc_warmstart))
        stopping = self._inertias * (turning / self._step + speeding_up)
        most = self._resistance * self.loads
        data.xfrc_applied[self._wheels, _YAW] = np.clip(data.xfrc_applied[self._wheels, _YAW] - stopping, -most, most)
