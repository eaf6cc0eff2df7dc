"""Whether records are of the vehicle whose file is given: its geometry is taken as true by everything that follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ident.campaign.steps import EXCITATIONS
from ident.diagnosis.observations.linear import rms
from ident.errors import RecordError
from ident.plant.modes import Mode
from ident.records.record import Record, Segment, Step, base_step
from ident.vehicle.geometry import Geometry

POSTURE: Final = 0.1
"""Largest mean deviation of a steering angle from that of its step [rad]; no misadjusted encoder is as far off."""

ROLLING: Final = 0.25
"""Largest relative deviation of the way that a wheel rolls while its side steers; no worn tyre is as far off."""

TURNED: Final = 0.05
"""Rms of the steering angle from which its wheels can be compared with it [rad]."""


def refuse_other_vehicle(records: Sequence[Record], geometry: Geometry) -> None:
    """Refuse records whose steps are driven at other steering angles, or whose wheels roll otherwise while steering.

    The first tells l/b (the posture of rotation), the second a/r: beta' = -s (a/r) alpha' in front, +s (a/r) alpha'
    behind, s = 1 on the left and -1 on the right.

    Raises:
        RecordError: a record is of another vehicle, or its steps are not what they are called.
    """
    for record in records:
        for segment in record.segments:
            step = base_step(segment.step)
            spec = EXCITATIONS.get(step) if step is not None else None
            if spec is None or spec.mode is None:
                continue
            fault = _of_rolling(segment, geometry) if spec.mode is Mode.ALIGNMENT else None
            fault = fault or _of_posture(segment, spec.steering(geometry).tolist(), spec.coordinate)
            if fault:
                raise RecordError(
                    f"{record.source}, step {segment.step}: {fault}.",
                    "Name the file of the vehicle that was recorded (--vehicle); check units and signs of the angles.",
                )


def _of_posture(segment: Segment, expected: Sequence[float], moved: str) -> str:
    for side, (name, angle) in enumerate(zip(("alpha_l", "alpha_r"), expected, strict=True)):
        found = float(np.mean(segment.steering_angles[:, side]))
        if name != moved and abs(found - angle) > POSTURE:
            return f"{name} is {found:.2f} rad on average, which for this vehicle is {angle:.2f}"
    return ""


def _of_rolling(segment: Segment, geometry: Geometry) -> str:
    side = 0 if base_step(segment.step) is Step.STEERING_LEFT else 1
    angle = segment.steering_angles[:, side] - segment.steering_angles[:, side].mean()
    if rms(angle) < TURNED:
        return ""
    wheels = segment.wheel_angles[:, 2 * side : 2 * side + 2]
    ratios = (wheels - wheels.mean(axis=0)).T @ angle / float(angle @ angle)
    expected = geometry.wheel_offset / geometry.wheel_radius
    # A wheel on slippery ground rolls as it likes; of another vehicle neither rolls like this one's.
    found = min(((-1) ** side * ratios * (-1, 1)).tolist(), key=lambda ratio: abs(ratio - expected))
    if abs(found / expected - 1) > ROLLING:
        return f"its wheels roll {found:.2f} rad per rad of steering, which for this vehicle is {expected:.2f}"
    return ""
