"""What a record says does not depend on how often it was sampled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Block, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.lag import LAG_NAME
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.estimate.filters import Processing, moving_rows
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

EFFECTS = (EffectName.QUADRATIC_DRAG, EffectName.TIME_DELAY, EffectName.WHEEL_RADIUS)
OFTENER = (2, 8)
"""500 Hz and 2 kHz, of which every second sample is evaluated."""


def oftener(segment: Segment, times: int) -> Segment:
    """The same motion, so many samples in the place of each."""
    dt = segment.sample_time / times
    time = segment.time[0] + dt * np.arange(times * len(segment))
    torques, wheels, steering = (
        CubicSpline(segment.time, values)(np.minimum(time, segment.time[-1]))
        for values in (segment.motor_torques, segment.wheel_angles, segment.steering_angles)
    )
    return replace(
        segment,
        sample_time=dt,
        time=time,
        motor_torques=torques,
        wheel_angles=wheels,
        steering_angles=steering,
        period=np.repeat(segment.period, times),
    )


@pytest.fixture(scope="module")
def problems(prototype: VehicleDescription) -> dict[int, Problem]:
    """Of one motion, by how many samples stand for each of 250 Hz."""
    segments = ideal_record(FOUR, prototype).segments
    records = {times: Record([oftener(one, times) for one in segments], f"{times}") for times in (1, *OFTENER)}
    return {
        times: build_problem([record], prototype, prototype.prior, effects=EFFECTS) for times, record in records.items()
    }


def moves(block: Block) -> NDArray[np.bool_]:
    """Rows far from samples that stick, of which there are as many as the sampling and its filters say."""
    assert block.features is not None
    return block.moving & moving_rows(block.features[:, 1:2], Processing(), block.sample_time)


def at_moments_of(slow: Block, fast: Block, values: Array) -> Array:
    """Rows of a block at those moments of another one in which it moves."""
    moments, own = (np.arange(len(block.target)) * block.sample_time for block in (slow, fast))
    return np.asarray(CubicSpline(own, values)(moments[moves(slow)]))


@pytest.mark.parametrize("times", OFTENER)
def test_equations_of_one_motion_are_the_same_at_any_rate(problems: dict[int, Problem], times: int) -> None:
    for slow, fast in zip(problems[1].blocks, problems[times].blocks, strict=True):
        least = 1e-3 * max(rms(slow.target), 1e-3)
        for column in range(len(PARAMETER_NAMES)):
            same = at_moments_of(slow, fast, fast.baseline[:, column])
            assert rms(same - slow.baseline[moves(slow), column]) < 0.02 * rms(slow.baseline[:, column]) + least
        assert rms(at_moments_of(slow, fast, fast.target) - slow.target[moves(slow)]) < 0.01 * rms(slow.target) + least


@pytest.mark.parametrize("times", OFTENER)
@pytest.mark.parametrize("key", ["time_delay@drive_fl", "quadratic_drag@wheels", "wheel_radius@wheel_fl"])
def test_so_is_what_a_cause_adds(problems: dict[int, Problem], times: int, key: str) -> None:
    late, early = (problems[each].candidate(key).variants[0].columns for each in (1, times))
    acting = [one is not None for one in late]
    assert any(acting)
    assert acting == [one is not None for one in early]
    for slow, fast, one, other in zip(problems[1].blocks, problems[times].blocks, late, early, strict=True):
        if one is not None and other is not None:
            same = at_moments_of(slow, fast, other[:, 0])
            assert rms(same - one[moves(slow), 0]) < 0.05 * rms(one[moves(slow), 0])


@pytest.mark.parametrize("times", OFTENER)
def test_a_part_of_a_sample_is_as_much_less_late_as_the_sample_is_shorter(
    problems: dict[int, Problem], times: int
) -> None:
    """Of the interval at which the record was sampled, not of the rate at which rows are evaluated."""
    lag = problems[1].names.index(LAG_NAME)
    late, less = (
        np.array([rms(block.baseline[block.moving, lag]) for block in problems[each].blocks]) for each in (1, times)
    )
    np.testing.assert_allclose(less, late / times, rtol=0.03, atol=0.01 * late.max() / times)


@pytest.mark.parametrize("times", OFTENER)
def test_so_is_the_shortest_delay_that_sampling_does_not_make(problems: dict[int, Problem], times: int) -> None:
    slow, fast = (problems[each].candidate("time_delay@drives").negligible for each in (1, times))
    assert fast == pytest.approx(np.array(slow) / times)
