"""Friction of bristles that bend before they slide (`ident.plant.bristles`): its state follows the measured angles.

Bristles are straight where a segment begins; behind its first strokes it makes no difference what they were.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.transforms import Setting
from ident.plant.bristles import FIRST_JOINT, bent_along
from ident.plant.places import STEERING, rows_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BristleCause:
    """Friction of bristles at a place.

    Attributes:
        where: place.
    """

    where: str
    name: ClassVar[EffectName] = EffectName.PRESLIDING

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers among the two steering axes and the four wheels."""
        return tuple(row - FIRST_JOINT for row in rows_of(self.where))

    def bent(self, inputs: Array, angle: float) -> Array:
        """How far the bristles of its joints are bent (N, joints)."""
        return np.stack([bent_along(joint_angle(inputs, joint), angle) for joint in self.joints], axis=1)

    def without(self, inputs: Array, sizes: Array, setting: Setting) -> Array:
        """Inputs (N, INPUTS) that say what the bristles resist, of an amplitude [Nm] and over an angle [rad]."""
        del setting
        amplitude, angle = sizes
        changed = copied(inputs)
        columns = [SLICES["bristles"].start + joint for joint in self.joints]
        changed[:, columns] += amplitude * self.bent(inputs, float(angle))
        return changed


def joint_angle(inputs: Array, joint: int) -> Array:
    """Angle (N,) of one of the two steering axes and the four wheels [rad]."""
    name, place = ("alpha", joint) if joint < len(STEERING) else ("beta", joint - len(STEERING))
    return inputs[:, SLICES[name].start + place]
