"""Samples that no time stamp misses are lost where all encoders jump at once, not where one motor rings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.faults.clock import skipped
from ident.records.record import Segment

Array = NDArray[np.float64]

CYCLE, SAMPLES = 0.002, 2000


def segment(wheel_angles: Array) -> Segment:
    """Steering that turns with the wheels, as a side does."""
    count = len(wheel_angles)
    steering = np.stack([0.1 * wheel_angles[:, 0], np.zeros(count)], axis=1)
    return Segment(
        step="steering_left",
        sample_time=CYCLE,
        time=np.arange(count) * CYCLE,
        motor_torques=np.zeros((count, 4)),
        wheel_angles=wheel_angles,
        steering_angles=steering,
        period=np.zeros(count, dtype=np.int64),
    )


def rolled() -> Array:
    """Angles (N, 4) of wheels of one side that roll to and fro, with the noise of their encoders."""
    time = np.arange(SAMPLES) * CYCLE
    angle = 3 * np.sin(2 * np.pi * 0.4 * time)
    angles = np.stack([angle, -angle, np.zeros(SAMPLES), np.zeros(SAMPLES)], axis=1)
    return np.asarray(angles + 1e-6 * np.random.default_rng(1).normal(size=angles.shape))


def test_samples_that_all_encoders_miss_are_lost() -> None:
    _, faults = skipped(segment(np.delete(rolled(), slice(400, 403), axis=0)))
    assert [(str(fault.name), fault.value) for fault in faults] == [("lost_samples", 3.0)]


def test_a_motor_that_leaps_ahead_of_all_others_has_lost_nothing() -> None:
    """It is thrown from flank to flank while the others hardly move: what all encoders do is what it does."""
    angles = rolled() * [0.02, 1.0, 0.0, 0.0]
    leap = 2.5 * (angles[400, 1] - angles[399, 1])
    angles[400:, 1] += leap
    _, faults = skipped(segment(angles))
    assert not faults
