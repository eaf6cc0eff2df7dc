"""`quasiomni diagnose` of the platform: what cannot be used is refused by name, and nothing is left behind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.records.files import write_record
from ident.records.record import Record, Segment
from ident.vehicle.description import load_vehicle

Quasi = Callable[..., Any]
Change = Callable[[Segment], Segment]


def _plain(segment: Segment) -> Segment:
    return segment


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Path]:
    """A record of the four steps, its segments changed."""

    def write(seed: int, change: Change = _plain) -> Path:
        path = tmp_path / f"run{seed}.csv"
        segments = [change(segment) for segment in ideal_record(FOUR, load_vehicle("prototype"), seed).segments]
        write_record(Record(segments, path.name), path)
        return path

    return write


def _refused(quasi: Quasi, tmp_path: Path, *arguments: object) -> str:
    """What it complains about; neither JSON nor page is left, not even half of one."""
    out, page = tmp_path / "diagnosis.json", tmp_path / "report.html"
    answer = quasi("diagnose", *arguments, "--json", out, "--report", page)
    assert answer.code == 2
    assert "error:" in answer.error
    assert "remedy:" in answer.error
    assert not out.exists()
    assert not page.exists()
    assert not list(tmp_path.glob(".*.part"))
    return " ".join(answer.error.split())


def test_a_missing_channel_is_named(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    path = record(1)
    lines = [line.split(",") for line in path.read_text().splitlines()]
    gone = lines[0].index("torque_rr")
    path.write_text("\n".join(",".join(line[:gone] + line[gone + 1 :]) for line in lines))
    assert "lacks the channel torque_rr" in _refused(quasi, tmp_path, path)


def test_a_value_that_is_no_number_is_named(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    def spoilt(segment: Segment) -> Segment:
        torques = segment.motor_torques.copy()
        torques[77, 3] = np.nan
        return replace(segment, motor_torques=torques)

    assert "torque_rr" in _refused(quasi, tmp_path, record(1, spoilt))


def test_a_vehicle_that_stands_still_is_refused(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    def still(segment: Segment) -> Segment:
        held = np.repeat(segment.steering_angles[:1], len(segment.time), axis=0)
        return replace(segment, wheel_angles=0 * segment.wheel_angles, steering_angles=held)

    assert "does not move" in _refused(quasi, tmp_path, record(1, still))


def test_a_confirming_record_of_another_rate_is_refused(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    def slower(segment: Segment) -> Segment:
        return replace(segment, time=2 * segment.time)

    assert "sampled every" in _refused(quasi, tmp_path, record(1), "--confirm", record(2, slower))


def test_a_record_cannot_confirm_itself(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    path = record(1)
    assert "the same samples" in _refused(quasi, tmp_path, path, "--confirm", path)


@pytest.mark.parametrize(("text", "complaint"), [("nonsense = [", "model.toml"), ("[parameters]\n", "C_l")])
def test_a_model_that_cannot_be_read_is_named(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path, text: str, complaint: str
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(text)
    assert complaint in _refused(quasi, tmp_path, record(1), "--model", model)


def test_a_vehicle_that_nobody_knows_is_named(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    assert "lorry" in _refused(quasi, tmp_path, record(1), "--vehicle", "lorry")


def test_records_of_another_vehicle_are_refused(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    complaint = _refused(quasi, tmp_path, record(1), "--vehicle", "compact")
    assert "its wheels roll 1.20 rad per rad of steering, which for this vehicle is 0.64" in complaint
    assert "--vehicle" in complaint


def test_a_posture_that_is_not_that_of_the_step_is_refused(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    def ahead(segment: Segment) -> Segment:
        return replace(segment, steering_angles=0 * segment.steering_angles) if segment.step == "rotation" else segment

    assert "step rotation: alpha_l is 0.00 rad on average" in _refused(quasi, tmp_path, record(1, ahead))


def _thinned(segment: Segment, every: int, most: int | None = None) -> Segment:
    kept = slice(None, most, every)
    return Segment(
        step=segment.step,
        sample_time=segment.sample_time * every,
        time=segment.time[kept],
        motor_torques=segment.motor_torques[kept],
        wheel_angles=segment.wheel_angles[kept],
        steering_angles=segment.steering_angles[kept],
        period=segment.period[kept],
    )


def test_a_record_that_is_sampled_too_slowly_is_refused(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    path = record(1, lambda segment: _thinned(segment, 5))
    assert "is sampled every 20 ms, too slowly" in _refused(quasi, tmp_path, path)


def test_a_step_of_a_few_samples_is_refused(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    path = record(1, lambda segment: _thinned(segment, 1, 10 if segment.step == "rotation" else None))
    assert "step rotation has 10 samples" in _refused(quasi, tmp_path, path)
