"""Motion modes and their detection from the steering angles, equation (9)."""

from __future__ import annotations

import enum
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ident.vehicle.geometry import Geometry


class Mode(enum.IntEnum):
    """k of (9), numbered as in Fig. 3."""

    ALIGNMENT = 1
    STEERED = 2
    LATERAL = 3
    ROTATION = 4


def icr_residual(alpha: ArrayLike, geometry: Geometry) -> NDArray[np.float64]:
    """Signed angular distance of α (..., 2) from the curve f_ICR = 0 of (9), first order [rad].

    Uses the regular form (l/2) sin(α_r - α_l) + b sin α_l sin α_r = 0, which has no ∞ - ∞ straight ahead.
    """
    left, right = np.moveaxis(np.asarray(alpha, dtype=float), -1, 0)
    half_l, b = geometry.wheelbase / 2, geometry.track_width
    residual = half_l * np.sin(right - left) + b * np.sin(left) * np.sin(right)
    by_left = -half_l * np.cos(right - left) + b * np.cos(left) * np.sin(right)
    by_right = half_l * np.cos(right - left) + b * np.sin(left) * np.cos(right)
    distance: NDArray[np.float64] = residual / np.hypot(by_left, by_right)
    return distance


def virtual_steering(alpha: ArrayLike, geometry: Geometry) -> NDArray[np.float64]:
    """α_v of (6) from α (..., 2): the mean curvature that both sides ask for [rad]."""
    left, right = np.moveaxis(np.tan(np.asarray(alpha, dtype=float)), -1, 0)
    half_l, half_b = geometry.wheelbase / 2, geometry.track_width / 2
    curvature = (left / (half_l + half_b * left) + right / (half_l - half_b * right)) / 2
    angle: NDArray[np.float64] = np.arctan(half_l * curvature)
    return angle


def detect_mode(alpha: ArrayLike, geometry: Geometry, tolerance: float = 0.02) -> NDArray[np.int64]:
    """k of (9) for steering angles α (..., 2); `tolerance` [rad] on each angle.

    Mode 4 is tested before 3 and 2, since its angles satisfy the condition of mode 2 as well.
    """
    angles = np.asarray(alpha, dtype=float)
    opposite = np.array([-1.0, 1.0])
    rotation = np.all(np.abs(angles - geometry.rotation_angle * opposite) < tolerance, axis=-1)
    lateral = np.all(np.abs(angles - math.pi / 2 * opposite) < tolerance, axis=-1)
    outside_track = np.abs(virtual_steering(angles, geometry)) < geometry.rotation_angle
    steered = (np.abs(icr_residual(angles, geometry)) < tolerance) & outside_track
    return np.select([rotation, lateral, steered], [Mode.ROTATION, Mode.LATERAL, Mode.STEERED], default=Mode.ALIGNMENT)
