"""The gap of a simulator in words, numbers and as a page."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ident.diagnosis.vehicle.records.following import Difference
from ident.diagnosis.vehicle.simulator_gap import simulator_gap
from ident.report.simulator_gap import (
    SimulatorReport,
    least_text,
    render_simulator_report,
    summary_lines,
    write_simulator_json,
)


def difference(step: str, off: float, repeats: int) -> Difference:
    rows, samples = max(repeats, 1), 120
    recorded = np.random.default_rng(3).normal(size=(rows, samples))
    noise = np.random.default_rng(4).normal(size=(rows, samples))
    time = np.tile(np.arange(samples) * 2e-3, (rows, 1))
    return Difference(step, "x", "N", time, recorded, recorded + off + noise, np.arange(samples) // 60)


@pytest.fixture
def report() -> SimulatorReport:
    before, after = ([difference("straight", off, 4), difference("lane_change", off, 0)] for off in (5.0, 0.5))
    return SimulatorReport(simulator_gap(before, after), "run", "b.toml", "<a>.toml", ("stribeck@wheels",), "mujoco")


def test_the_first_line_says_how_far_it_shrinks(report: SimulatorReport) -> None:
    lines = summary_lines(report)
    assert "times the noise before" in lines[0]
    assert "stribeck@wheels" in lines[1]
    assert any("straight, x" in line and "closed" in line for line in lines)
    assert any("lane_change" in line and "noise is not known" in line for line in lines)


def test_what_is_at_least_so_much_is_not_rounded_upwards() -> None:
    assert least_text(0.99999) == "at least 99.9 %"
    assert least_text(-0.3) == "at least 0.0 %"


def test_numbers_are_json_without_nan(report: SimulatorReport, tmp_path: Path) -> None:
    write_simulator_json(report, tmp_path / "gap.json")
    document = json.loads((tmp_path / "gap.json").read_text())
    assert document["total"]["closed"] == pytest.approx(report.gap.total.closed)
    assert [step["floor"] is None for step in document["steps"]] == [False, True]
    assert all(math.isfinite(step["before"]) for step in document["steps"])


def test_the_page_is_whole_and_escapes_what_others_wrote(report: SimulatorReport) -> None:
    page = render_simulator_report(report)
    assert page.rstrip().endswith("</html>")
    assert "<a>.toml" not in page
    assert page.count('id="trace-') == 2
    for word in ("recorded", "before", "after", "at least"):
        assert word in page


def test_a_record_in_which_nothing_repeats_says_so() -> None:
    before, after = ([difference("lane_change", off, 0)] for off in (5.0, 0.5))
    report = SimulatorReport(simulator_gap(before, after), "run", "b", "a", (), "mujoco")
    assert "noise is not known" in summary_lines(report)[0]
    assert "lane_change" in render_simulator_report(report)
