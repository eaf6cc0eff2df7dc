"""The page and the ten lines of a diagnosis: true to the numbers, largest first, nothing loaded from anywhere."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.diagnosis import Diagnosis, Gap, NamedEffect, Share, Unseen, Verdict
from ident.diagnosis.problem import Block, Candidate, Channel, Problem, Variant
from ident.effects import EffectParameter
from ident.report.commands import Asked
from ident.report.gap import GapReport, render_gap_report
from ident.report.gap_figures import map_figure, residual_figures
from ident.report.gap_summary import gap_line, summary_lines
from ident.vehicle.quantities import Quantity

Array = NDArray[np.float64]

SAMPLES, REPEATS = 500, 4
LARGE = {("straight", "x"): (100.0, 1.0), ("rotation", "gamma"): (100.0, 1.0), ("straight", "roll"): (1e-4, 1e-4)}
"""Rms of the signal and of the noise; the third is all noise, as rolling constraints are."""


def _problem(part: int, effect: float) -> Problem:
    """An effect in `rotation, gamma` of so many times the noise."""
    blocks, columns = [], []
    for number, ((step, coordinate), (signal, noise)) in enumerate(LARGE.items()):
        generator = np.random.default_rng([part, number])
        baseline = np.tile(generator.normal(size=(SAMPLES, 1)), (REPEATS, 1))
        column = np.tile(generator.normal(size=(SAMPLES, 1)), (REPEATS, 1))
        acts = coordinate == "gamma"
        target = signal * baseline[:, 0] + noise * generator.normal(size=len(baseline)) + acts * effect * column[:, 0]
        blocks.append(
            Block(
                record="made up",
                channel=Channel.KINEMATIC if coordinate == "roll" else Channel.DYNAMIC,
                step=step,
                coordinate=coordinate,
                unit="m/s" if coordinate == "roll" else "Nm",
                sample_time=0.02,
                bandwidth=100.0,
                target=target,
                baseline=baseline * signal / 100.0,
                moving=np.ones(len(target), dtype=bool),
                period=np.repeat(np.arange(REPEATS), SAMPLES),
                regions={"forward": baseline[:, 0] > 0, "backward": baseline[:, 0] < 0},
                features=baseline,
            )
        )
        columns.append(column if acts else None)
    candidate = Candidate("scrub", "chassis", (EffectParameter("torque", "Nm", ""),), (Variant(tuple(columns)),))
    return Problem(("m_ch",), ("kg",), tuple(blocks), (candidate,))


@pytest.fixture(scope="module")
def findings() -> Findings:
    return judge(_problem(0, 3.0), _problem(1, 3.0), seed=1)


@pytest.fixture(scope="module")
def page(findings: Findings) -> str:
    return render_gap_report(GapReport(findings, findings.diagnosis("drive a circle"), ["a.csv"], ["b.csv"], "m.toml"))


def drawn(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="figures">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    figures: dict[str, Any] = json.loads(found.group(1))
    return figures


def values(series: Any) -> Array:
    """Numbers of a series of a figure, packed or plain."""
    if isinstance(series, dict):
        return np.frombuffer(base64.b64decode(series["bdata"]), dtype=series["dtype"]).astype(float)
    return np.asarray(series, dtype=float)


def test_no_more_than_all_of_a_gap_is_said_to_be_closed(findings: Findings) -> None:
    """A gap just above its noise that ends just below it."""
    diagnosis = replace(findings.diagnosis(), gap=Gap(1.01, 0.95, 1.0))
    assert diagnosis.gap.closed > 4
    assert "100 % of it closed" in gap_line(findings, diagnosis)


def test_the_largest_gap_over_its_noise_comes_first_whatever_its_share_of_the_signal(findings: Findings) -> None:
    """All of the rolling constraint is noise, 3 % of the torque is gap."""
    titles = [title for _, title, _ in residual_figures(findings)]
    assert titles[0].startswith("rotation · gamma: 3.")
    assert all(re.search(r": 0\.\d+ times the noise", title) for title in titles[1:])
    assert any("roll (kinematic)" in title for title in titles[1:])


def test_residuals_are_those_before_and_with_the_causes(findings: Findings) -> None:
    _, _, figure = residual_figures(findings)[0]
    before, after = (values(line["y"]) for line in figure["data"])
    assert np.sqrt(np.nanmean(before**2)) == pytest.approx(3.0, rel=0.15)
    assert np.sqrt(np.nanmean(after**2)) == pytest.approx(1 / np.sqrt(REPEATS), rel=0.2)


def test_a_coordinate_without_rows_is_not_drawn() -> None:
    """As the rolling rows of a drive in which a motor rattles."""
    problems = []
    for part in (0, 1):
        problem = _problem(part, 3.0)
        *blocks, last = problem.blocks
        silent = replace(last, moving=np.zeros_like(last.moving))
        problems.append(replace(problem, blocks=(*blocks, silent)))
    titles = [title for _, title, _ in residual_figures(judge(*problems, seed=1))]
    assert len(titles) == 2
    assert not any("roll" in title for title in titles)


def test_the_map_leaves_out_what_does_not_matter_and_puts_opposites_beside_each_other() -> None:
    shares = [
        Share("dynamic", "straight", "x", "late", 0.4),
        Share("dynamic", "straight", "x", "all", 0.9995),
        Share("dynamic", "straight", "x", "forward", 0.7),
        Share("dynamic", "straight", "x", "my_region", 0.1),
        Share("dynamic", "straight", "x", "backward", 0.2995),
        Share("kinematic", "straight", "roll", "all", 0.0005),
    ]
    (heat,) = map_figure(shares)["data"]
    assert heat["x"] == ["all", "forward", "backward", "late", "my region"]
    assert heat["y"] == ["straight, x"]
    assert heat["z"] == [[0.9995, 0.7, 0.2995, 0.4, 0.1]]


def test_the_page_says_what_was_found_and_loads_nothing(page: str, findings: Findings) -> None:
    assert "Vehicle: contact patches that resist turning on the spot by 2.9" in page
    assert "drive a circle" in page
    assert "m.toml" in page
    head = page[: page.index("<script")]
    assert not re.search(r'(src|href)="(?!#|data:)', head)
    shown = drawn(page)
    assert set(shown) == {"map", *(key for key, _, _ in residual_figures(findings))}
    assert all(f'id="{key}"' in page for key in shown)


def test_nothing_on_the_page_is_fetched_and_no_style_names_another_place(page: str) -> None:
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert "url(" not in outside
    assert "@import" not in outside
    assert not re.search(r'(src|href)="(?!#|data:)', outside)
    assert all("src=" not in tag for tag in re.findall(r"<script[^>]*>", page))


def test_the_answer_comes_first_and_the_details_below(page: str) -> None:
    order = ["summary", "rivals", "steps", "before-and-after", "next", "where", "causes", "parameters", "provenance"]
    places = [page.index(f'<section id="{name}">') for name in order]
    assert places == sorted(places)
    assert all(f'href="#{name}"' in page for name in order[1:])
    assert 'data-place="chassis" class="marked"' in page
    assert page.count('class="marked"') == 1


def test_what_is_not_named_is_marked_nowhere(findings: Findings) -> None:
    for verdict in (Verdict.UNKNOWN, Verdict.NONE):
        other = replace(findings, verdict=verdict, causes=findings.causes if verdict is Verdict.UNKNOWN else ())
        page = render_gap_report(GapReport(other, other.diagnosis(), ("one",), (), None))
        assert 'class="marked"' not in page
        assert "No place is marked" in page


def test_the_band_of_a_trace_is_twice_the_noise_of_the_mean_of_its_repeats(findings: Findings) -> None:
    _, _, figure = residual_figures(findings)[0]
    (band,) = figure["layout"]["shapes"]
    assert band["y1"] == -band["y0"] == pytest.approx(2 * 1.0 / np.sqrt(REPEATS), rel=0.1)


def test_commands_on_the_page_are_for_the_records_that_were_diagnosed(findings: Findings) -> None:
    asked = Asked(["my run"], ["b.csv"], run="my run")
    page = render_gap_report(GapReport(findings, findings.diagnosis(), ["my run"], ["b.csv"], None, asked))
    assert "quasiomni diagnose &#39;my run&#39; --confirm b.csv --extended extended.toml" in page
    assert "quasiomni fmu &#39;my run&#39; --model extended.toml" in page


def test_everything_in_the_map_adds_up(page: str) -> None:
    (heat,) = drawn(page)["map"]["data"]
    assert heat["x"][0] == "all"
    assert sum(row[0] for row in heat["z"]) == pytest.approx(1.0, abs=0.01)


def _diagnosis(verdict: Verdict, count: int) -> Diagnosis:
    effects = tuple(
        NamedEffect(
            "torque_bias", f"drive_{place}", {"bias": Quantity(0.1, "Nm", "", 0.01)}, 0.9, ("torque_bias", "slope"), 0.2
        )
        for place in ("fl", "rl", "fr", "rr")[:count]
    )
    where = (Share("dynamic", "straight", "x", "forward", 0.9), Share("dynamic", "straight", "x", "all", 0.8))
    return Diagnosis(verdict, effects, where, Gap(2.0, 1.1, 1.0), ("com_offset",), "drive a circle")


@pytest.mark.parametrize(
    ("verdict", "count"), [(Verdict.EFFECT, 4), (Verdict.EFFECT, 1), (Verdict.NONE, 0), (Verdict.UNKNOWN, 0)]
)
def test_ten_lines_say_it_all(findings: Findings, verdict: Verdict, count: int) -> None:
    lines = summary_lines(findings, _diagnosis(verdict, count))
    assert len(lines) <= 10
    assert lines[-1] == "Next: drive a circle"
    assert sum("might as well be slope" in line for line in lines) == count
    assert not any("more (--report" in line for line in lines)
    assert any("2.00 times the noise" in line for line in lines)
    assert any("80 % of it in straight, x" in line for line in lines) is (verdict is not Verdict.NONE)


def test_causes_that_ten_lines_have_no_room_for_are_counted(findings: Findings) -> None:
    gap = Gap(4.0, 1.1, 1.0)
    unseen = tuple(Unseen(steps, "dynamic", gap) for steps in ("repeated", "lane_change"))
    many = replace(_diagnosis(Verdict.EFFECT, 4), unseen=unseen)
    lines = summary_lines(findings, many)
    assert len(lines) == 10
    shown = sum("might as well be slope" in line for line in lines)
    assert f"  and {4 - shown} more (--report FILE shows them)" in lines
    assert lines[-1] == "Next: drive a circle"


def test_what_is_nearest_is_said_where_it_is_not_the_answer(findings: Findings) -> None:
    unknown = replace(findings, verdict=Verdict.UNKNOWN)
    assert "Nearest, but not it: scrub@chassis." in summary_lines(unknown, unknown.diagnosis())
