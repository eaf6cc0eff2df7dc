"""Motors that move in their gears while their wheels rest: the other side steers at standstill.

Nothing loads them there, and the controller lets them drift from flank to flank. A motor does so that rattles where the
vehicle drives; others move with wheels that slide. How far it moves in such a step is a row of its own: the play of its
gear, and what the flanks, or a gear that gives way, yield to the load that it has where it is farthest ahead and
farthest behind. The side that steers drags the chassis along, and the wheel with it, some hundredths of a milliradian a
second: so that is looked at within seconds, where the motor moves farthest. What rolls at standstill takes its motion
for that of wheels or chassis; a wide one has it left out.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.rattling import ABOVE_OTHERS
from ident.diagnosis.vehicle.records.rows import OwnRows
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST: Final = 2e-4
"""Range of its motion from which a motor is loose [rad]; in rigid gears it is up to 0.07 mrad on the emulator, up to
0.25 mrad where another one of 5 mrad pushes the chassis, or a wheel slides: those rattle in no drive."""

WIDE: Final = 7e-4
"""Range from which what rolls at standstill is left out of a record [rad]: gears that give way move their motors by up
to 0.5 mrad on the emulator, and their load foretells it."""

FARTHEST: Final = 0.005
"""Part of the time that a motor is taken to be at either end of its range [-]."""

UNTOLD: Final = 0.05
"""Part of the range that may stay unexplained: noise makes it larger, and not every flank is reached [-]."""

TOGETHER: Final = 1000
"""Samples within which a motor reaches both of its flanks, and no wheel is dragged far."""

DRAGGED: Final = 5e-5
"""Motion of the wheel itself, which may be in such a range [rad]: in rigid gears that is up to 0.07 mrad."""

COORDINATES: Final = tuple(f"rest_{wheel}" for wheel in WHEELS)


def moved_at_rest(beta: Array, near: Mask) -> Array:
    """How far the motors (2) of a side that rests move [rad], zero where that is no play.

    Args:
        beta: their angles, at the wheels (N, 2) [rad].
        near: (N,) where no wheel pushes the chassis aside.
    """
    if not near.any():
        return np.zeros(2)
    whole = np.array([_extent(angle) for angle in beta[near].T])
    other = whole[::-1]
    across = np.array([max(map(_extent, _parts(angle))) for angle in beta[near].T])
    return np.where((whole > LEAST) & ((whole > ABOVE_OTHERS * other) | (other > LEAST)), across, 0.0)


def range_of(values: Array, inputs: Array, wheel: int) -> float:
    """What of values (N,) a motor that moves at rest has more where it is farthest ahead than where farthest behind.

    Zero for a motor that does not; `inputs` are the signals (N, INPUTS), `wheel` is its number.
    """
    at_rest = inputs[:, SLICES["rest"].start + wheel] != 0
    if not at_rest.any():
        return 0.0
    angles, behind = _parts(inputs[at_rest, SLICES["beta"].start + wheel]), _parts(values[at_rest])
    widest = int(np.argmax([_extent(angle) for angle in angles]))
    return _range(behind[widest], *_farthest(angles[widest]))


def _parts(values: Array) -> list[Array]:
    """Values (N,) in pieces of about `TOGETHER`."""
    return np.array_split(values, max(len(values) // TOGETHER, 1))


def _extent(angle: Array) -> float:
    """How far an angle (N,) goes."""
    return _range(angle, *_farthest(angle))


def _farthest(angle: Array) -> tuple[Mask, Mask]:
    behind, ahead = np.quantile(angle, [FARTHEST, 1 - FARTHEST])
    return angle >= ahead, angle <= behind


def _range(values: Array, ahead: Mask, behind: Mask) -> float:
    return float(values[ahead].mean() - values[behind].mean())


def rest_rows(wheel: int, geometry: Geometry) -> OwnRows:
    """How far the motor of a wheel (0 to 3) moves while that rests, beyond what its gear gives way by [m]."""
    return OwnRows((COORDINATES[wheel],), (SLICES["rest"].start + wheel,), geometry.wheel_radius, UNTOLD, DRAGGED)


def resting_wheel(own: OwnRows | None) -> int | None:
    """Number (0 to 3) of the wheel that rows are of, None for those that are not of a motor at rest."""
    return COORDINATES.index(own.coordinates[0]) if own is not None and own.coordinates[0] in COORDINATES else None
