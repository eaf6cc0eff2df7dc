"""How slow a joint may be and still surely moves: what its encoder says of its rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.diagnosis.vehicle.records.sources import Source, processing_of, sources_of
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]


def steered_with(noise: float, vehicle: VehicleDescription) -> tuple[Source, Array]:
    """Rows of forces of a steering step, angles measured with white noise [rad], and its true rates there [rad/s]."""
    record, random = ideal_record(FOUR, vehicle), np.random.default_rng(1)
    noisy = [
        replace(one, steering_angles=one.steering_angles + noise * random.standard_normal(one.steering_angles.shape))
        for one in record.segments
    ]
    measured = replace(record, segments=noisy)
    found = sources_of(measured, vehicle.geometry, [Step.STEERING_LEFT], processing_of([measured]))
    source = next(one for one in found if one.channel is Channel.DYNAMIC)
    segment = next(one for one in record.segments if one.step == Step.STEERING_LEFT)
    rate = np.gradient(segment.steering_angles[:, 0], segment.sample_time)
    return source, rate[:: round(source.sample_time / segment.sample_time)]


@pytest.mark.parametrize("noise", [0.0, 3e-5, 3e-4])
def test_no_sample_slides_in_which_the_joint_may_stand(noise: float, prototype: VehicleDescription) -> None:
    source, rate = steered_with(noise, prototype)
    assert not source.holds[np.abs(rate) < 0.005].any()
    assert source.holds.mean() > 0.75


def test_rows_about_a_quick_reversal_are_used(prototype: VehicleDescription) -> None:
    source, rate = steered_with(0.0, prototype)
    fast = np.flatnonzero(np.abs(rate) > 0.05)
    turns = np.flatnonzero(np.diff(rate[fast] > 0))
    reversals = (fast[turns] + fast[turns + 1]) // 2
    quick = reversals[(fast[turns + 1] - fast[turns]) * source.sample_time < 0.05]
    assert len(quick) > 5
    assert not source.holds[quick].any()
    assert source.moving[0][quick].all()
