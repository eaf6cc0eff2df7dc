"""Where in the plane of speed and acceleration a step has been."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import Equations, motion_of
from ident.estimate.filters import Processing, zero_phase
from ident.estimate.identify import FIT_STEPS
from ident.records.record import Record, Segment, Step
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

_COORDINATES: Final = {"x": 0, "y": 1, "gamma": 2, "alpha_l": 3, "alpha_r": 4}
"""Index into q of the coordinates that identification steps drive."""

_POINTS: Final = 2000


@dataclass(frozen=True)
class PhasePlane:
    """Speed and acceleration of the coordinate that a step drives, smoothed as the rows of its equations.

    Attributes:
        step, coordinate: which.
        unit: of the coordinate, m or rad.
        speed, acceleration: (N,) [unit/s, unit/s²].
        moving: (N,) rows that the estimate uses.
    """

    step: str
    coordinate: str
    unit: str
    speed: Array
    acceleration: Array
    moving: NDArray[np.bool_]


def phase_planes(
    record: Record, equations: tuple[Equations, ...], geometry: Geometry, processing: Processing
) -> list[PhasePlane]:
    """One plane for every segment of an identification step."""
    fitted = [rows for rows in equations if rows.step in FIT_STEPS]
    segments = [segment for segment in record.segments if segment.step in FIT_STEPS]
    return [_plane(segment, rows, geometry, processing) for segment, rows in zip(segments, fitted, strict=True)]


def _plane(segment: Segment, rows: Equations, geometry: Geometry, processing: Processing) -> PhasePlane:
    motion = motion_of(segment, geometry, processing)
    index = _COORDINATES[rows.coordinate]
    both = np.stack([motion.rates[:, index], motion.accelerations[:, index]], axis=1)
    smooth = zero_phase(both, processing.cutoff, segment.sample_time)
    keep = slice(None, None, max(1, len(smooth) // _POINTS))
    unit = "m" if Step(segment.step) in (Step.STRAIGHT, Step.LATERAL) else "rad"
    return PhasePlane(rows.step, rows.coordinate, unit, smooth[keep, 0], smooth[keep, 1], rows.moving[keep])
