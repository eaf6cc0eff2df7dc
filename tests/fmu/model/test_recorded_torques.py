"""The identified model, driven with the torques that a campaign recorded, moves as the vehicle did."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.campaign.reading import read_run
from ident.estimate.equations import motion_of
from ident.estimate.filters import Processing, zero_phase
from ident.estimate.identify import identify
from ident.estimate.result import KnownInertia
from ident.records.record import Record, Segment, Step
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

pytestmark = pytest.mark.slow

NRMSE = 0.05
HELD = 2e-3
PROCESSING = Processing()
WHEEL_INERTIA = KnownInertia(0.121, 0.0, "as emulated")
STEPS = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION, Step.LANE_CHANGE)


@pytest.fixture(scope="module")
def record(drive: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Record:
    folder: Path = tmp_path_factory.mktemp("campaign") / "run"
    drive(folder, STEPS, seed=3, known_inertia=WHEEL_INERTIA)
    return read_run(folder)


@pytest.fixture(scope="module")
def identified(record: Record, core_of: Callable[..., Any]) -> Any:
    core = core_of("prototype")
    values = identify(record, core.vehicle.geometry, known_inertia=WHEEL_INERTIA).values
    core.identified = dict(zip(PARAMETER_NAMES, values, strict=True))
    return core


def driven(core: Any, segment: Segment, steering_gain: float = 0.0) -> Segment:
    """The same torques on the FMU. A gain [Nm/rad] turns the steering to the recorded angles, front against rear."""
    instance = core.new(**core.identified)
    start = segment.steering_angles[0]
    instance.set(alpha_l=start[0], alpha_r=start[1])
    instance.set(
        **{f"beta_{wheel}": segment.wheel_angles[0, place] for place, wheel in enumerate(("fl", "rl", "fr", "rr"))}
    )
    alpha, beta = [start], [segment.wheel_angles[0]]
    for torques, wanted in zip(segment.motor_torques[:-1], segment.steering_angles[:-1], strict=True):
        left, right = steering_gain * (wanted - alpha[-1])
        instance.u[:4] = torques + np.array([-left, left, right, -right])
        instance.step(segment.sample_time)
        alpha.append(np.array([instance["alpha_l"], instance["alpha_r"]]))
        beta.append(np.array([instance[f"beta_{wheel}"] for wheel in ("fl", "rl", "fr", "rr")]))
    return Segment(
        segment.step,
        segment.sample_time,
        segment.time,
        segment.motor_torques,
        np.array(beta),
        np.array(alpha),
        segment.period,
    )


def driven_velocity(segment: Segment, core: Any) -> Array:
    """Of the coordinate that the step moves, through the same filter and odometry for both."""
    rates = motion_of(segment, core.vehicle.geometry, PROCESSING).rates
    moved = {Step.STEERING_LEFT: 3, Step.STEERING_RIGHT: 4, Step.ROTATION: 2}.get(Step(segment.step), 0)
    return zero_phase(rates[:, moved], PROCESSING.cutoff, segment.sample_time)


def nrmse(segment: Segment, simulated: Segment, core: Any) -> float:
    measured, modelled = driven_velocity(segment, core), driven_velocity(simulated, core)
    return float(np.sqrt(np.mean((modelled - measured) ** 2) / np.mean(measured**2)))


def segment_of(record: Record, step: Step) -> Segment:
    return next(segment for segment in record.segments if segment.step == step)


@pytest.mark.parametrize(
    ("step", "held"),
    [
        (Step.STEERING_LEFT, "alpha_r"),
        (Step.STEERING_RIGHT, "alpha_l"),
        (Step.STRAIGHT, "alpha_l"),
        (Step.ROTATION, "alpha_r"),
    ],
)
def test_each_step_is_followed_and_held_steering_stays_held(
    record: Record, identified: Any, step: Step, held: str
) -> None:
    segment = segment_of(record, step)
    simulated = driven(identified, segment)
    assert nrmse(segment, simulated, identified) < NRMSE
    side = simulated.steering_angles[:, ("alpha_l", "alpha_r").index(held)]
    assert np.abs(side - side[0]).max() < HELD


def test_the_lane_change_is_followed_where_the_steering_is_kept_to_its_angles(record: Record, identified: Any) -> None:
    """Without that, angles that nothing feeds back drift until left and right want to turn about different centres."""
    segment = segment_of(record, Step.LANE_CHANGE)
    assert nrmse(segment, driven(identified, segment, steering_gain=20.0), identified) < NRMSE
