"""Mistakes that users make: each ends with exit code 2, what is wrong, and the remedy; nothing moves or is lost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.network import DEFAULT_NETWORK
from ident.campaign.excitation import FourierSeries
from ident.campaign.reference import excitation_reference
from ident.campaign.steps import EXCITATIONS
from ident.estimate.result import KnownInertia
from ident.records.files import write_record
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import load_vehicle

SHIPPED_VEHICLE = Path(__file__).parents[2] / "ident" / "vehicle" / "data" / "prototype.toml"


def assert_user_error(answer: Any, *words: str) -> None:
    assert answer.code == 2, answer
    assert "Traceback" not in answer.err + answer.out
    assert "remedy:" in answer.error
    for word in words:
        assert word in answer.error, answer.error


def driven(step: Step, size: float = 0.5) -> Segment:
    """A step that follows the model exactly."""
    vehicle, spec = load_vehicle(), EXCITATIONS[step]
    series = FourierSeries(np.array([size, 0.0, -size]), np.array([0.0, size, -2 * size / 3]), spec.period)
    reference = excitation_reference(spec, series, 4, vehicle, vehicle.prior, 0.002)
    wheels = np.zeros((len(reference), 4))
    steering = np.zeros((len(reference), 2))
    for name, track in reference.tracks.items():
        wheels += track.wheels * (track.position - track.position[0])[:, None]
        if name.startswith("alpha"):
            steering[:, 0 if name == "alpha_l" else 1] = track.position
    time = np.arange(len(reference)) * 0.002
    return make_segment(Segment(step, 0.0, time, reference.feed_forward, wheels, steering, reference.period), "test")


@pytest.fixture(scope="module")
def record() -> Record:
    steps = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
    return Record([driven(step) for step in steps])


@pytest.fixture
def network_with(tmp_path: Path) -> Callable[[str, str], Path]:
    """A copy of the shipped network file with one text replaced."""

    def write(old: str, new: str) -> Path:
        text = DEFAULT_NETWORK.read_text()
        assert old in text
        for eds in DEFAULT_NETWORK.parent.glob("*.eds"):
            (tmp_path / eds.name).write_bytes(eds.read_bytes())
        path = tmp_path / "network.toml"
        path.write_text(text.replace(old, new))
        return path

    return write


CAMPAIGN = ("campaign", "--skip", "steering_left", "--skip", "steering_right", "--skip", "rotation")


def campaign(quasi: Callable[..., Any], out: Path, *more: object) -> Any:
    return quasi(*CAMPAIGN, "--skip", "lane_change", "--b-w", 0.121, "--b-w-std", 0.001, "--out", out, *more)


def test_wrong_identity(quasi: Any, network_with: Any, tmp_path: Path) -> None:
    answer = campaign(
        quasi, tmp_path / "run", "--network", network_with("product_code = 0x402", "product_code = 0x403")
    )
    assert_user_error(answer, "node 1", "drive_fl")


def test_wrong_units(quasi: Any, network_with: Any, tmp_path: Path) -> None:
    network = network_with("rated_torque = { value = 1.27", "rated_torque = { value = 12.7")
    assert_user_error(campaign(quasi, tmp_path / "run", "--network", network), "rated_torque", "1.27 Nm", "12.7 Nm")
    assert not (tmp_path / "run").exists()


def test_missing_node_on_a_bus_with_nobody(quasi: Any, tmp_path: Path) -> None:
    answer = campaign(quasi, tmp_path / "run", "--bus", "virtual:empty", "--yes")
    assert_user_error(answer, "node", "boot")


def test_unknown_bus(quasi: Any, tmp_path: Path) -> None:
    answer = campaign(quasi, tmp_path / "run", "--bus", "sockercan:can0", "--yes")
    assert_user_error(answer, "sockercan", "socketcan")


def test_a_folder_that_holds_a_run_is_not_overwritten(quasi: Any, tmp_path: Path) -> None:
    run = tmp_path / "run"
    (run / "frames").mkdir(parents=True)
    (run / "frames" / "000_straight.blf").write_bytes(b"precious")
    assert_user_error(campaign(quasi, run), "already holds a run", "--resume")
    assert (run / "frames" / "000_straight.blf").read_bytes() == b"precious"


def test_resume_without_a_run(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(campaign(quasi, tmp_path / "nowhere", "--resume"), "no run folder")


def test_a_resumed_run_is_not_driven_with_other_options(quasi: Any, tmp_path: Path, plan_run: Any) -> None:
    run = tmp_path / "run"
    plan_run(run, [Step.ROTATION], known_inertia=KnownInertia(0.121, 0.001, "given"))
    for options, named in (
        (("--vehicle", "compact"), "--vehicle"),
        (("--seed", 9), "--seed"),
        (("--b-w", 0.2, "--b-w-std", 0.001), "--b-w"),
        (("--lateral",), "--lateral"),
    ):
        answer = quasi("campaign", "--out", run, "--resume", *options)
        assert_user_error(answer, "was planned with another", named)


def test_a_run_without_rotation_is_refused_for_the_yaw_inertia(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(Record([segment for segment in record.segments if segment.step != Step.ROTATION]), path)
    assert_user_error(quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01), "C_ch", "rotation")


def test_messages_keep_their_brackets(quasi: Any, tmp_path: Path) -> None:
    vehicle = tmp_path / "mine.toml"
    vehicle.write_text('name = "mine"\n')
    assert_user_error(campaign(quasi, tmp_path / "run", "--vehicle", vehicle), "[limits]")


def test_a_folder_that_cannot_be_written_to(quasi: Any, record: Record, tmp_path: Path) -> None:
    path, taken = tmp_path / "record.csv", tmp_path / "taken"
    write_record(record, path)
    taken.write_text("a file")
    assert_user_error(quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01, "--out", taken), "taken", "--out")


def test_numbers_out_of_range(quasi: Any, tmp_path: Path) -> None:
    assert campaign(quasi, tmp_path / "run", "--seed", -1).code == 2
    assert_user_error(campaign(quasi, tmp_path / "run", "--periods", 1_000_000), "at most 100")
    assert_user_error(quasi("identify", tmp_path, "--b-w-std", 0.01), "without B_w")


def test_a_record_that_is_not_there(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(quasi("identify", tmp_path / "nothere"), "does not exist")


def test_too_few_periods(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(campaign(quasi, tmp_path / "run", "--periods", 2), "2 periods", "at least 4")


def test_wheel_inertia_without_its_deviation(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(quasi("identify", tmp_path, "--b-w", 0.121), "standard deviation", "--b-w-std")


def test_a_vehicle_that_cannot_be(quasi: Any, tmp_path: Path) -> None:
    vehicle = tmp_path / "mine.toml"
    vehicle.write_text(SHIPPED_VEHICLE.read_text().replace("wheelbase = { value = 1.2", "wheelbase = { value = -1.2"))
    assert_user_error(campaign(quasi, tmp_path / "run", "--vehicle", vehicle), "wheelbase", "positive")
    assert not (tmp_path / "run").exists()


def test_a_floor_that_is_too_small(quasi: Any, tmp_path: Path) -> None:
    vehicle = tmp_path / "mine.toml"
    vehicle.write_text(
        SHIPPED_VEHICLE.read_text().replace("floor_length = { value = 12.0", "floor_length = { value = 2.0")
    )
    assert_user_error(campaign(quasi, tmp_path / "run", "--vehicle", vehicle), "2.00 m", "floor")


def test_an_unknown_vehicle(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(campaign(quasi, tmp_path / "run", "--vehicle", "protoype"), "protoype", "prototype")


def test_an_unreadable_log(quasi: Any, tmp_path: Path) -> None:
    log = tmp_path / "000_straight.blf"
    log.write_bytes(b"LOGG" + bytes(40))
    assert_user_error(quasi("identify", log), "000_straight.blf")


def test_a_record_with_nan(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(record, path)
    lines = path.read_text().splitlines()
    cells = lines[100].split(",")
    cells[4] = "nan"
    path.write_text("\n".join([*lines[:100], ",".join(cells), *lines[101:]]) + "\n")
    assert_user_error(quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01), "steering_left", "99")


def test_a_record_with_a_gap_in_time(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(record, path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:500], *lines[510:]]) + "\n")
    assert_user_error(quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01), "not uniform")


def test_too_little_excitation_names_the_parameters(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(Record([segment for segment in record.segments if segment.step != Step.STEERING_LEFT]), path)
    answer = quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01)
    assert_user_error(answer, "C_l", "d_vl", "d_cl", "steering_left")
    assert not (tmp_path / "parameters.toml").exists()


def test_a_record_without_lifted_wheels_asks_for_their_inertia(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(record, path)
    assert_user_error(quasi("identify", path), "wheel_lifted", "--b-w")


def test_a_good_record_is_identified_and_reported(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.parquet"
    write_record(record, path)
    answer = quasi("identify", path, "--b-w", 0.12, "--b-w-std", 0.01, "--out", tmp_path / "result")
    assert answer.code == 0, answer
    assert "m_ch" in answer.out
    assert (tmp_path / "result" / "parameters.toml").is_file()
    assert "<html" in (tmp_path / "result" / "report.html").read_text()


def test_a_record_that_is_given_twice_is_no_second_drive(quasi: Any, record: Record, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_record(record, path)
    assert_user_error(quasi("identify", path, path, "--b-w", 0.12, "--b-w-std", 0.01), "more than once")


def test_a_run_folder_that_cannot_be_made(quasi: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert_user_error(campaign(quasi, tmp_path / "file" / "run"), "cannot be made a run folder", "--out")


def test_a_folder_in_place_of_a_vehicle_file(quasi: Any, tmp_path: Path) -> None:
    assert_user_error(campaign(quasi, tmp_path / "run", "--vehicle", tmp_path.as_posix()), "cannot be read")
