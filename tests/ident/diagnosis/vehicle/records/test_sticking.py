"""How slow a joint may be and still surely moves: what its encoder says of its rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.diagnosis.vehicle.records.sources import Source, processing_of, sources_of
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription


def steered_with(noise: float, vehicle: VehicleDescription) -> tuple[Source, Record]:
    """Rows of forces of a steering step, angles measured with white noise [rad], and the record without."""
    record, random = ideal_record(FOUR, vehicle), np.random.default_rng(1)
    noisy = [
        replace(one, steering_angles=one.steering_angles + noise * random.standard_normal(one.steering_angles.shape))
        for one in record.segments
    ]
    measured = replace(record, segments=noisy)
    found = sources_of(measured, vehicle.geometry, [Step.STEERING_LEFT], processing_of([measured]))
    return next(one for one in found if one.channel is Channel.DYNAMIC), record


@pytest.mark.parametrize("noise", [0.0, 3e-5, 3e-4])
def test_no_sample_slides_in_which_the_joint_may_stand(noise: float, prototype: VehicleDescription) -> None:
    source, record = steered_with(noise, prototype)
    segment = next(one for one in record.segments if one.step == Step.STEERING_LEFT)
    rate = np.gradient(segment.steering_angles[:, 0], segment.sample_time)
    stride = round(source.sample_time / segment.sample_time)
    assert not source.holds[np.abs(rate[::stride]) < 0.005].any()
    assert source.holds.mean() > 0.75


def test_rows_about_a_quick_reversal_are_used(prototype: VehicleDescription) -> None:
    source, record = steered_with(0.0, prototype)
    segment = next(one for one in record.segments if one.step == Step.STEERING_LEFT)
    rate = np.gradient(segment.steering_angles[:, 0], segment.sample_time)
    stride = round(source.sample_time / segment.sample_time)
    fast = np.flatnonzero(np.abs(rate) > 0.05)
    turns = np.flatnonzero(np.diff(rate[fast] > 0))
    reversals = (fast[turns] + fast[turns + 1]) // 2 // stride
    quick = reversals[(fast[turns + 1] - fast[turns]) * segment.sample_time < 0.05]
    assert len(quick) > 5
    assert not source.holds[quick].any()
    assert source.moving[0][quick].all()
