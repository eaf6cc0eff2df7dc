"""One whole campaign over CAN against the prototype in the physics engine: what a user gets, judged by the truth."""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hil.bench.truth import truth_of
from hil.campaign.folder import Run, open_run
from hil.campaign.reading import read_any, read_logs, read_run
from hil.campaign.runner import ALIGNED, PARALLEL
from hil.campaign.study import TOLERANCES
from hil.frames.recorder import finished_steps
from ident.assessment import Assessment
from ident.campaign.steps import ORDER
from ident.estimate.identify import identify
from ident.estimate.result import Identification
from ident.parameters_file import Identified, read_model, write_model
from ident.records.files import write_record
from ident.records.record import Record, Step
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

INCREMENT = 2 * np.pi / 2**17
"""Of a steering encoder [rad]; they dither by as much."""

STEPS = tuple(step for step in ORDER if step is not Step.LATERAL)


@pytest.fixture(scope="module", params=["prototype", "compact"])
def vehicle(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def run(vehicle: str, drive: Callable[..., Run], tmp_path_factory: pytest.TempPathFactory) -> Run:
    return drive(tmp_path_factory.mktemp(vehicle) / "run", STEPS, vehicle=vehicle, seed=41)


@pytest.fixture(scope="module")
def record(run: Run) -> Record:
    return read_run(run.folder.path)


@pytest.fixture(scope="module")
def result(record: Record, run: Run) -> Identification:
    return identify(record, run.plan.vehicle.geometry)


@pytest.fixture(scope="module")
def truth(vehicle: str) -> Parameters:
    return truth_of(vehicle)


def test_every_parameter_is_found(result: Identification, truth: Parameters) -> None:
    """Within 3.5 standard deviations, or half its tolerance: wheels aligned to three increments still slip a little."""
    for estimate in result.estimates:
        error = abs(estimate.value - truth[estimate.name])
        slip = 0.5 * TOLERANCES[estimate.name] / 100 * truth[estimate.name]
        assert error < max(3.5 * estimate.std, slip), estimate.name


def test_the_intervals_are_no_wider_than_what_is_asked_of_the_estimate(
    result: Identification, truth: Parameters
) -> None:
    for estimate in result.estimates:
        half_width = 50 * (estimate.ci95[1] - estimate.ci95[0]) / truth[estimate.name]
        assert half_width < 1.3 * TOLERANCES[estimate.name], estimate.name


def test_at_most_two_of_eleven_intervals_miss_the_truth(result: Identification, truth: Parameters) -> None:
    held = [low <= truth[e.name] <= high for e in result.estimates for low, high in [e.ci95]]
    assert sum(held) >= 9


def test_the_lane_change_that_was_not_fitted_is_predicted(result: Identification) -> None:
    nrmse = {floor.coordinate: floor.nrmse for floor in result.floors if floor.step == Step.LANE_CHANGE}
    assert nrmse["x"] < 0.05
    assert nrmse["alpha_v"] < 0.15


def test_the_measured_regressor_is_better_conditioned_than_the_papers(result: Identification) -> None:
    assert result.condition <= 8.0


def test_noise_is_told_from_model_error(result: Identification) -> None:
    for floor in result.floors:
        if floor.step in (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION):
            assert 0 < floor.noise < 0.03 * floor.signal
            assert floor.model_error < 2 * floor.noise


def test_each_step_is_repeated_at_least_four_times(record: Record) -> None:
    for step in STEPS:
        if step is not Step.LANE_CHANGE:
            (segment,) = record.of(step)
            assert len(segment.periods) >= 4


def test_the_excitation_stays_inside_the_room_that_was_announced(record: Record, run: Run) -> None:
    (straight,) = record.of(Step.STRAIGHT)
    travel = run.plan.vehicle.geometry.wheel_radius * (straight.wheel_angles - straight.wheel_angles[0]).mean(axis=1)
    planned = run.plan.reference(Step.STRAIGHT, run.plan.vehicle.prior).path[:, 0]
    assert np.abs(travel).max() < np.abs(planned).max() + 0.05


def test_wheels_are_aligned_before_they_are_driven(record: Record, run: Run) -> None:
    for step in (Step.STRAIGHT, Step.ROTATION):
        (segment,) = record.of(step)
        left, right = segment.steering_angles[0] - run.plan.posture(step)
        assert max(abs(left), abs(right)) < ALIGNED + INCREMENT
        assert abs(left - right) < PARALLEL + 2 * INCREMENT


def test_the_frames_alone_give_the_same_estimate(run: Run, result: Identification, tmp_path: Path) -> None:
    """On another machine there may be nothing but the logs and the network file."""
    shutil.copytree(run.folder.frames, tmp_path / "frames")
    logs = [path for _, path in finished_steps(tmp_path / "frames")]
    alone = identify(read_logs(logs, run.network), run.plan.vehicle.geometry)
    np.testing.assert_allclose(alone.values, result.values, rtol=1e-9)
    assert read_any(tmp_path, run.network).steps == read_logs(logs, run.network).steps


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4"])
def test_a_plain_record_gives_the_same_estimate(
    record: Record, result: Identification, run: Run, tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"record{suffix}"
    write_record(record, path)
    read = identify(read_any(path, run.network), run.plan.vehicle.geometry)
    np.testing.assert_allclose(read.values, result.values, rtol=1e-7)
    np.testing.assert_allclose([e.std for e in read.estimates], [e.std for e in result.estimates], rtol=1e-4)


def test_the_result_file_reads_back_and_states_everything(result: Identification, run: Run, tmp_path: Path) -> None:
    path = tmp_path / "parameters.toml"
    identified = Identified(result, Assessment())
    write_model(identified.model, path, {"run": run.folder.path.name}, identified=identified)
    read = read_model(path).parameters
    np.testing.assert_allclose(read.values, result.values, rtol=1e-8)
    document = tomllib.loads(path.read_text())
    assert tuple(document["parameters"]) == PARAMETER_NAMES
    entry = document["parameters"]["m_ch"]
    assert entry["unit"] == "kg"
    assert entry["ci95"][0] < entry["value"] < entry["ci95"][1]
    assert np.array(document["correlation"]["matrix"]).shape == (11, 11)


def test_a_run_folder_is_self_contained(run: Run, result: Identification, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    shutil.copytree(run.folder.path, moved)
    opened = open_run(moved)
    assert opened.seed == run.seed
    again = identify(read_run(moved), opened.plan.vehicle.geometry)
    np.testing.assert_array_equal(again.values, result.values)


def test_logs_are_numbered_in_the_order_driven(run: Run) -> None:
    names = [path.name for path in sorted(run.folder.frames.iterdir())]
    assert all(re.fullmatch(r"\d{3}_\w+\.blf", name) for name in names)
    driven = [step for step, _ in finished_steps(run.folder.frames) if step != Step.ALIGNMENT]
    assert driven == list(STEPS)
