"""What a record says does not depend on how often it was sampled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.lag import LAG_NAME
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

EFFECTS = (EffectName.STRIBECK, EffectName.TIME_DELAY, EffectName.ELASTICITY, EffectName.WHEEL_RADIUS)
OFTENER = (2, 4)
"""500 and 1000 Hz, where 250 Hz are evaluated as they are."""


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


def moving(problem: Problem, column: int) -> list[Array]:
    """A column of the baseline, -1 for the target, in the used rows of every block."""
    rows = (np.column_stack([block.baseline, block.target])[:, column][block.moving] for block in problem.blocks)
    return list(rows)


@pytest.mark.parametrize("times", OFTENER)
def test_equations_of_one_motion_are_the_same_at_any_rate(problems: dict[int, Problem], times: int) -> None:
    for column in (-1, *range(11)):
        for block, slow, fast in zip(
            problems[1].blocks, moving(problems[1], column), moving(problems[times], column), strict=True
        ):
            assert rms(fast) == pytest.approx(rms(slow), rel=0.02, abs=1e-3 * max(rms(block.target), 1e-3))


@pytest.mark.parametrize("times", OFTENER)
@pytest.mark.parametrize(
    "key", ["time_delay@drive_fl", "stribeck@wheels", "elasticity@drive_rr", "wheel_radius@wheel_fl"]
)
def test_so_is_what_a_cause_adds(problems: dict[int, Problem], times: int, key: str) -> None:
    def powers(problem: Problem) -> list[float]:
        columns = zip(problem.blocks, problem.candidate(key).variants[0].columns, strict=True)
        return [0.0 if column is None else rms(column[block.moving, 0]) for block, column in columns]

    slow, fast = powers(problems[1]), powers(problems[times])
    assert fast == pytest.approx(slow, rel=0.02, abs=0.01 * max(slow))


@pytest.mark.parametrize("times", OFTENER)
def test_a_part_of_a_sample_is_as_much_less_late_as_the_sample_is_shorter(
    problems: dict[int, Problem], times: int
) -> None:
    """Of the interval at which the record was sampled, not of the rate at which rows are evaluated."""
    lag = problems[1].names.index(LAG_NAME)
    late, less = (np.array([rms(rows) for rows in moving(problems[each], lag)]) for each in (1, times))
    np.testing.assert_allclose(less, late / times, rtol=0.03, atol=0.01 * late.max())


@pytest.mark.parametrize("times", OFTENER)
def test_so_is_the_shortest_delay_that_sampling_does_not_make(problems: dict[int, Problem], times: int) -> None:
    slow, fast = (problems[each].candidate("time_delay@drives").negligible for each in (1, times))
    assert fast == pytest.approx(np.array(slow) / times)
