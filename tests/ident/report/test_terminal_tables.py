"""What a terminal of 80 columns shows."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console, RenderableType

from ident.campaign.plan import Plan
from ident.estimate.result import Identification
from ident.report.digits import digits, percent, significant
from ident.report.tables import (
    condition_line,
    excitation_table,
    lag_line,
    loop_table,
    paper_table,
    parameter_table,
    room_table,
    step_table,
)
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

NARROW = 80


def printed(renderable: RenderableType) -> list[str]:
    file = io.StringIO()
    Console(file=file, width=NARROW, color_system=None).print(renderable)
    return file.getvalue().splitlines()


def line_of(lines: list[str], name: str) -> str:
    return next(line for line in lines if line.split()[:1] == [name])


def test_every_table_fits_eighty_columns_without_an_ellipsis(
    identification: Identification, truth: Parameters, plan: Plan
) -> None:
    tables = [
        parameter_table(identification, truth),
        paper_table(identification),
        excitation_table(identification),
        step_table(identification),
        loop_table(plan),
        room_table(plan),
    ]
    for table in tables:
        lines = printed(table)
        assert max(map(len, lines)) <= NARROW
        cells = "\n".join(lines).replace(" … ", " ")  # the interval's own
        assert "…" not in cells


def test_each_parameter_stands_beside_its_truth_and_error(identification: Identification, truth: Parameters) -> None:
    lines = printed(parameter_table(identification, truth))
    for name in PARAMETER_NAMES:
        estimate, line = identification[name], line_of(lines, name)
        error = percent(estimate.value / truth[name] - 1, signed=True)
        for text in (
            digits(estimate.value, estimate.std),
            digits(estimate.std, estimate.std),
            digits(truth[name], estimate.std),
            error,
        ):
            assert text in line


def test_without_truth_nothing_is_compared(identification: Identification) -> None:
    assert "truth" not in "\n".join(printed(parameter_table(identification)))


def test_table_2_stands_beside_the_result_with_its_own_stds(identification: Identification) -> None:
    lines = printed(paper_table(identification))
    assert "842.07 ± 0.99" in line_of(lines, "m_ch")
    assert line_of(lines, "B_w").count("±") == 1  # the paper prints none


def test_a_poor_parameter_is_marked_where_it_stands(identification: Identification) -> None:
    first = identification.estimates[0]
    poor = replace(first, ci95=(-first.value, 3 * first.value))
    worse = replace(identification, estimates=(poor, *identification.estimates[1:]))
    assert "poor" in line_of(printed(excitation_table(worse)), "C_l")
    assert "poor" not in line_of(printed(excitation_table(worse)), "d_vl")
    caption = parameter_table(worse).caption
    assert isinstance(caption, str)
    assert "half the value" in caption
    assert parameter_table(identification).caption is None


def test_steps_show_rms_values_and_nrmse(identification: Identification) -> None:
    lines = printed(step_table(identification))
    for floor in identification.floors:
        line = next(line for line in lines if line.split()[:2] == [floor.step, floor.coordinate])
        assert significant(floor.signal) in line
        assert line.rstrip().endswith(percent(floor.nrmse))


def test_loops_show_the_margins_that_python_control_found(plan: Plan) -> None:
    lines = printed(loop_table(plan))
    for name in ("alpha_l", "alpha_r", "x", "y", "gamma"):
        cells = line_of(lines, name).split()
        design = plan.designs[name]
        assert float(cells[1]) == pytest.approx(design.velocity_crossover, rel=0.01)
        assert float(cells[2]) == pytest.approx(design.velocity_phase_margin, abs=0.5)
        assert float(cells[4]) == pytest.approx(design.slipping_phase_margin, abs=0.5)
    assert "beta" in "\n".join(lines)
    assert "beta_fl" not in "\n".join(lines)


def test_the_room_is_that_of_the_plan_beside_what_the_vehicle_file_allows(plan: Plan) -> None:
    along = line_of(printed(room_table(plan)), "along").split()
    assert float(along[1]) == pytest.approx(plan.room().length, abs=0.005)
    assert float(along[-1]) == plan.vehicle.limits.floor_length


def test_the_lag_of_the_torques_has_its_standard_deviation(identification: Identification) -> None:
    line = lag_line(replace(identification, lag=Lag(-1.04e-4, 9e-5, 0.002)))
    assert line is not None
    assert line.plain.endswith("-104 ± 90 \N{GREEK SMALL LETTER MU}s")
    assert lag_line(replace(identification, lag=None)) is None


def test_the_condition_number_stands_beside_the_papers(identification: Identification) -> None:
    text = condition_line(identification).plain
    assert f"{identification.condition:.2f}" in text
    assert "11.56" in text
