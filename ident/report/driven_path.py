"""The path that a record's wheels have rolled, by odometry (3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import Motion, motion_of
from ident.estimate.filters import Processing
from ident.plant import kinematics
from ident.records.record import Record, Step
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

_SIGNS = ((+1, +1), (-1, +1), (+1, -1), (-1, -1))
"""Signs of (x, y) of the steering axes, order fl, rl, fr, rr."""


@dataclass(frozen=True)
class Leg:
    """What one segment adds to the path.

    Attributes:
        step: its name.
        pose: (N, 3) of the chassis in the frame of the record's start [m, m, rad].
        alpha: (N, 2) steering angles [rad].
    """

    step: str
    pose: Array
    alpha: Array


def driven_legs(record: Record, geometry: Geometry, processing: Processing) -> list[Leg]:
    """Legs one behind the other; segments with the wheels in the air are left out, gaps in time stand still."""
    legs: list[Leg] = []
    start = np.zeros(3)
    for segment in record.segments:
        if segment.step == Step.WHEEL_LIFTED:
            continue
        motion = motion_of(segment, geometry, processing)
        legs.append(_leg(segment.step, motion, segment.sample_time, start))
        start = legs[-1].pose[-1]
    return legs


def _leg(step: str, motion: Motion, sample_time: float, start: Array) -> Leg:
    local = kinematics.integrate_pose(motion.rates[:, :3], sample_time)
    cos, sin = np.cos(start[2]), np.sin(start[2])
    x = start[0] + cos * local[:, 0] - sin * local[:, 1]
    y = start[1] + sin * local[:, 0] + cos * local[:, 1]
    return Leg(step, np.stack([x, y, start[2] + local[:, 2]], axis=1), motion.alpha)


def vehicle_outline(pose: Array, alpha: Array, geometry: Geometry) -> list[Array]:
    """Lines that draw a vehicle at a pose (3,) with steering angles (2,): the rectangle of the steering axes, then
    from every axis to its wheel and along it; (n, 2) each [m]."""
    half = np.array([geometry.wheelbase, geometry.track_width]) / 2
    corners = [np.array(signs) * half for signs in _SIGNS]
    frame = np.stack([corners[index] for index in (0, 1, 3, 2, 0)])
    wheels = [_wheel(corner, signs, alpha, geometry) for corner, signs in zip(corners, _SIGNS, strict=True)]
    return [_placed(line, pose) for line in (frame, *wheels)]


def _wheel(corner: Array, signs: tuple[int, int], alpha: Array, geometry: Geometry) -> Array:
    """Steering axis, contact, front and back end of a wheel in the chassis frame (4, 2)."""
    front, side = signs
    delta = front * (alpha[0] if side > 0 else alpha[1])
    along = geometry.wheel_radius * np.array([np.cos(delta), np.sin(delta)])
    contact = corner + side * geometry.wheel_offset * np.array([-np.sin(delta), np.cos(delta)])
    return np.stack([corner, contact, contact + along, contact - along])


def _placed(points: Array, pose: Array) -> Array:
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]) + pose[:2])


def covered_floor(legs: Sequence[Leg]) -> tuple[float, float]:
    """Extent of the chassis centre's path along and across the vehicle's first heading [m]."""
    poses = np.concatenate([leg.pose for leg in legs])
    extent = poses.max(axis=0) - poses.min(axis=0)
    return float(extent[0]), float(extent[1])
