"""Channels of a record against what the vehicle file says that drives, stops and steps allow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.assessment.verdict import Reason, ReasonCode, Verdict
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

MARGIN: Final = 1.1
"""Torques and speeds may exceed the data sheet by this factor: ripple, noise, rounding."""

STOP_MARGIN: Final = 0.02
"""Steering angles may exceed the mechanical stops by this much [rad]."""

OFF_POSTURE: Final = 0.02
"""Steering angle off the posture of its step with which another motion mode is driven [rad], as (9) tells modes."""

SPEED_WINDOW: Final = 0.02
"""Time over which a speed is taken [s]: long against the steps of an encoder."""

OFTEN: Final = 99.5
"""Share of the samples below the largest ones that count [%]: single jumps are faults of the record, not speeds."""

_SIDES: Final = ("alpha_l", "alpha_r")


def signal_reasons(record: Record, vehicle: VehicleDescription) -> Iterator[Reason]:
    """What in the channels cannot be, each channel once with its worst step."""
    found: dict[tuple[str, str], Reason] = {}
    for segment in record.segments:
        for reason in _of_segment(segment, vehicle):
            key = (reason.code, reason.channel)
            if key not in found or reason.value > found[key].value:
                found[key] = reason
    yield from found.values()


def _of_segment(segment: Segment, vehicle: VehicleDescription) -> Iterator[Reason]:
    yield from _torques(segment, vehicle.limits.peak_torque)
    yield from _speeds(segment, vehicle.limits.motor_speed / vehicle.geometry.gear_ratio)
    yield from _stops(segment, vehicle.geometry.steering_limit)
    yield from _posture(segment, vehicle.geometry)


def _torques(segment: Segment, peak: float) -> Iterator[Reason]:
    for wheel, torques in zip(WHEELS, segment.motor_torques.T, strict=True):
        largest = float(np.percentile(np.abs(torques), OFTEN))
        if largest > MARGIN * peak:
            text = (
                f"torque_{wheel} reaches {largest:.4g} Nm in {segment.step}, but the motor has at most {peak:g} Nm. "
                "Give torques in Nm at the motor shaft."
            )
            yield _impossible(ReasonCode.BEYOND_PEAK_TORQUE, f"torque_{wheel}", largest, MARGIN * peak, text)


def _speeds(segment: Segment, limit: float) -> Iterator[Reason]:
    width = max(round(SPEED_WINDOW / segment.sample_time), 1)
    if len(segment) <= width:
        return
    rates = (segment.wheel_angles[width:] - segment.wheel_angles[:-width]) / (width * segment.sample_time)
    for wheel, rate in zip(WHEELS, rates.T, strict=True):
        largest = float(np.percentile(np.abs(rate), OFTEN))
        if largest > MARGIN * limit:
            text = (
                f"beta_{wheel} turns at {largest:.4g} rad/s in {segment.step}, but motor and gear allow {limit:.3g} "
                "rad/s. Give angles in rad at the wheel, and time in s."
            )
            yield _impossible(ReasonCode.BEYOND_MOTOR_SPEED, f"beta_{wheel}", largest, MARGIN * limit, text)


def _stops(segment: Segment, stop: float) -> Iterator[Reason]:
    for name, angle in zip(_SIDES, segment.steering_angles.T, strict=True):
        largest = float(np.percentile(np.abs(angle), OFTEN))
        if largest > stop + STOP_MARGIN:
            unit = " It looks like degrees." if largest > math.pi else ""
            text = (
                f"{name} reaches {largest:.4g} rad in {segment.step}, beyond the mechanical stop at {stop:g} rad. Give "
                f"the angle of the front wheel in rad, zero straight ahead.{unit}"
            )
            yield _impossible(ReasonCode.BEYOND_STOPS, name, largest, stop + STOP_MARGIN, text)


def _posture(segment: Segment, geometry: Geometry) -> Iterator[Reason]:
    expected = _postures(geometry).get(segment.step)
    if expected is None:
        return
    medians = np.median(segment.steering_angles, axis=0)
    for name, angle, wanted in zip(_SIDES, medians, expected, strict=True):
        error = abs(float(angle) - wanted)
        if error > OFF_POSTURE:
            text = (
                f"{name} stands at {angle:.4g} rad in {segment.step}, where {wanted:.4g} rad is needed: that is "
                "another motion. Look at sign, zero and order of the steering encoders."
            )
            yield _impossible(ReasonCode.WRONG_POSTURE, name, error, OFF_POSTURE, text)


def _postures(geometry: Geometry) -> dict[str, tuple[float, float]]:
    """Steering angles at which a step keeps its wheels [rad]."""
    rotation, quarter = geometry.rotation_angle, math.pi / 2
    return {
        Step.STRAIGHT: (0.0, 0.0),
        Step.ROTATION: (-rotation, rotation),
        Step.LATERAL: (-quarter, quarter),
    }


def _impossible(code: ReasonCode, channel: str, value: float, limit: float, text: str) -> Reason:
    return Reason(code, channel, value, limit, text, Verdict.UNUSABLE)
