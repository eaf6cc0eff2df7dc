"""Rear units that wander in the play of their coupling while their side steers at standstill.

Both wheels of a side are driven alike there, so no load says on which flank of a play the rear unit lies, and which way
it is carried differs from repeat to repeat. But it crosses the play again and again, and both wheels tell how far: what
they roll turns their units by angles whose difference d stays constant without a play. The range of d within a second,
its 0.9 quantile over a step, is a row of its own, which a play makes as large as itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.rattling import ABOVE_OTHERS
from ident.diagnosis.vehicle.records.rows import OwnRows
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WINDOW: Final = 1.0
"""Within which a unit has crossed its play [s]."""

SMOOTH: Final = 0.04
"""Over which d is averaged [s]: encoders leave some microradians there."""

SHAPE: Final = (1, 2, 3)
"""Powers of the steering angle that are no wandering: other radii and eccentric wheels are smooth functions of it."""

REACHED: Final = 0.9
"""Quantile of the ranges of a step that is taken: in some seconds a unit stays on one flank."""

FORETOLD: Final = 0.6
"""Part of its range that d may keep beside those functions of the angle and what gears give way by: torques of both
wheels, and their signs, times whatever fits. On the emulator eccentric wheels keep 0.1 to 0.5 (how they are rolled
apart depends on more than the angle), plays and compliances of a gear 0.05 to 0.45, plays of the coupling 0.8 and more.
"""

LEAST: Final = 5e-5
"""Range of d from which a unit wanders [rad]; without a play it is up to 0.02 mrad on the emulator."""

UNTOLD: Final = 0.1
"""Part of the range that may stay unexplained: a unit does not always reach both flanks [-]."""

COORDINATES: Final = ("wander_l", "wander_r")


@dataclass(frozen=True)
class Wandering:
    """How far the units of a side roll apart in a step at standstill.

    Attributes:
        across: range of d within `WINDOW` [rad].
        foretold: whether angle and torques foretell it, as they do of other wheels and of a gear that gives way.
    """

    across: float
    foretold: bool


def wandering(
    alpha: Array, turned: Array, torques: Array, near: Mask, moving: Mask, sample_time: float
) -> Wandering | None:
    """How far the units of a side roll apart; None where there is no window to look at.

    Args:
        alpha: steering angle of the side (N,) [rad].
        turned: angles by which front and rear wheel have turned their units (N, 2) [rad].
        torques: of their motors (N, 2), in whatever unit.
        near: (N,) where no wheel pushes the chassis aside.
        moving: (N,) where the side steers.
        sample_time: [s].
    """
    width = 2 * round(WINDOW / 2 / sample_time) + 1
    window = np.ones(width, dtype=bool)
    whole = ndimage.binary_erosion(near, window)
    inside = whole & ndimage.binary_dilation(moving, window)
    if not inside.any():
        return None
    looked_at = ndimage.binary_dilation(whole, window)
    apart = _smooth(turned[:, 1] - turned[:, 0], sample_time)
    run = ndimage.label(looked_at)[0]
    level = run[:, None] == np.arange(1, run.max() + 1)
    shape = np.hstack([level, np.stack([alpha**power for power in SHAPE], axis=1)])
    gears = _smooth(np.hstack([torques, np.sign(_smooth(torques, sample_time))]), sample_time)
    plain, shaped, geared = (
        _range(apart - design @ least_squares(design[looked_at], apart[looked_at]), width)[inside]
        for design in (level.astype(float), shape, np.hstack([shape, gears]))
    )
    # A play is no function of the angle; what one takes from it by chance must not make it larger.
    across = float(np.quantile(np.minimum(plain, shaped), REACHED))
    return Wandering(across, bool(np.quantile(geared, REACHED) <= FORETOLD * np.quantile(plain, REACHED)))


def _smooth(values: Array, sample_time: float) -> Array:
    return np.asarray(ndimage.uniform_filter1d(values, max(1, round(SMOOTH / sample_time)), axis=0))


def _range(values: Array, width: int) -> Array:
    """Largest less smallest value (N,) of the samples around each."""
    return np.asarray(ndimage.maximum_filter1d(values, width) - ndimage.minimum_filter1d(values, width))


def wanders(across: float, others: Sequence[float]) -> bool:
    """Whether a range [rad] is that of a play, and not what the other side shows too, if that is known."""
    return bool(others) and across > max(LEAST, *(ABOVE_OTHERS * other for other in others))


def wander_rows(side: int, geometry: Geometry) -> OwnRows:
    """How far the rear wheel of a side (0 left, 1 right) rolls across the play [m]."""
    return OwnRows((COORDINATES[side],), (SLICES["wander"].start + side,), geometry.wheel_offset, UNTOLD)
