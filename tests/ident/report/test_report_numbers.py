"""Digits, rows and Table 2."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.estimate.result import Identification
from ident.records.record import Record
from ident.report.digits import (
    MISSING,
    digits,
    percent,
    quantity_text,
    range_text,
    significant,
    unit_text,
    value_text,
    with_std,
)
from ident.report.paper import load_paper_result
from ident.report.rows import Role, parameter_rows, role_of, step_rows
from ident.report.summary import summarise
from ident.vehicle.parameters import Parameters


@given(st.floats(-1e4, 1e4), st.floats(1e-6, 1e3))
def test_a_value_is_rounded_by_less_than_a_tenth_of_its_std(value: float, std: float) -> None:
    assert abs(float(digits(value, std)) - value) <= 0.5000001 * max(0.1 * std, 0 if std < 10 else 1)


@given(st.floats(1e-6, 9.0))
def test_a_std_keeps_two_significant_digits(std: float) -> None:
    assert float(digits(std, std)) == pytest.approx(std, rel=0.051)


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (842.0684, 0.9934, "842.07 ± 0.99"),
        (0.3342, 0.0685, "0.334 ± 0.069"),
        (286.5955, 1.1835, "286.6 ± 1.2"),
        (3.9656, 0.0125, "3.966 ± 0.013"),
        (812.4, 123.0, "812 ± 123"),
        (0.121, 0.0, "0.121"),
    ],
)
def test_table_2_is_written_to_the_digits_its_stds_support(value: float, std: float, text: str) -> None:
    assert with_std(value, std) == text


def test_what_is_no_number_is_a_dash() -> None:
    assert digits(math.nan, 1.0) == percent(math.nan) == significant(math.inf) == MISSING


def test_percentages_and_units_read_naturally() -> None:
    assert [percent(0.00094), percent(0.031), percent(0.63), percent(-0.011, signed=True)] == [
        "0.09 %",
        "3.1 %",
        "63 %",
        "-1.1 %",
    ]
    assert [significant(573.85), significant(2.206), significant(0.0301), significant(0.0)] == [
        "574",
        "2.21",
        "0.0301",
        "0",
    ]
    assert unit_text("kg m^2") == "kg m²"


@pytest.mark.parametrize(
    ("value", "std", "unit", "text"),
    [
        (0.0039, 0.00012, "s", "3.90 ± 0.12 ms"),
        (1.9e-5, 3e-7, "rad/Nm", "19.00 ± 0.30 μrad/Nm"),
        (-7.6e-6, 0.0, "m", "-7.6 μm"),
        (0.003, 0.001, "Nm", "3.0 ± 1.0 mNm"),
        (1e-3, 0.0, "s", "1 ms"),
        (9.9996e-4, 0.0, "m", "1 mm"),
        (9.9999e-4, 1e-6, "s", "1.0000 ± 0.0010 ms"),
        (6.1, 0.1, "Nm", "6.10 ± 0.10 Nm"),
        (0.0, 0.01, "rad", "0 ± 10 mrad"),
        (1e-9, 0.2, "rad", "0.00 ± 0.20 rad"),
        (math.nan, 0.0, "rad", "– rad"),
        (0.02, 0.004, "1", "0.0200 ± 0.0040"),
        (0.05, 0.01, "kg m^2", "0.050 ± 0.010 kg m²"),
    ],
)
def test_small_lengths_times_angles_and_torques_have_a_prefix(value: float, std: float, unit: str, text: str) -> None:
    assert quantity_text(value, std, unit) == text


def test_both_ends_of_a_range_have_the_prefix_of_the_larger() -> None:
    assert range_text(-1.27e-5, 1.11e-6, "m") == "-12.7 to 1.1 μm"
    assert range_text(-0.02, 6.1, "Nm", 2) == "0.0 to 6.1 Nm"
    assert range_text(1e-9, 0.05, "kg m^2") == "0.0000 to 0.0500 kg m²"
    assert range_text(0.0, 0.0, "m") == "0 to 0 m"
    assert value_text(0.0451, "rad", 2) == "45 mrad"
    assert value_text(9e-7, "m", beside=1.2e-5) == "0.900 μm"


@given(st.floats(1e-9, 0.0999))
def test_a_prefix_leaves_one_to_a_thousand_before_it(size: float) -> None:
    number, unit = value_text(size, "m", 6).split()
    assert 0.995 <= float(number) < 1000
    assert float(number) * {"mm": 1e-3, "μm": 1e-6, "nm": 1e-9}.get(unit, 1.0) == pytest.approx(size, rel=1e-5)


def test_the_shipped_table_2_is_that_of_the_paper() -> None:
    paper = load_paper_result()
    assert paper.condition == 11.56
    assert paper.parameters["m_ch"] == 842.0684
    assert paper.parameters.std_of("d_cw") == 0.0125
    assert paper.parameters["B_w"] == 0.121
    assert paper.parameters.std_of("B_w") == 0.0


def test_a_row_says_how_far_the_truth_is_in_percent_and_in_std(
    identification: Identification, truth: Parameters
) -> None:
    for row in parameter_rows(identification, truth):
        estimate = row.estimate
        assert row.error is not None
        assert row.error_in_std is not None
        assert row.error * truth[estimate.name] == pytest.approx(estimate.value - truth[estimate.name], abs=1e-9)
        assert row.error_in_std * estimate.std == pytest.approx(estimate.value - truth[estimate.name], abs=1e-9)
        assert row.covered == (estimate.ci95[0] <= truth[estimate.name] <= estimate.ci95[1])
        assert 0.0 <= row.inertia_share <= 1.0


def test_without_truth_or_paper_a_row_claims_no_error(identification: Identification) -> None:
    row = parameter_rows(identification)[0]
    assert (row.truth, row.error, row.error_in_std, row.covered, row.paper) == (None,) * 5


def test_lifted_wheels_give_b_w_only_when_it_was_not_given(identification: Identification) -> None:
    assert role_of("wheel_lifted", identification) is Role.INERTIA
    given_inertia = replace(identification["B_w"], method="data sheet")
    given = replace(identification, estimates=(*identification.estimates[:-1], given_inertia))
    assert role_of("wheel_lifted", given) is Role.SHOWN
    assert [row.role for row in step_rows(identification)] == [Role.INERTIA] * 4 + [Role.FIT] * 4 + [
        Role.VALIDATION
    ] * 2


def test_a_good_result_carries_no_warning(identification: Identification, record: Record, truth: Parameters) -> None:
    rows = parameter_rows(identification, truth)
    quiet = [replace(floor, model_error=0.0) for floor in identification.floors]
    steps = step_rows(replace(identification, floors=tuple(quiet)))
    summary = summarise("prototype", identification, record, rows, steps)
    assert summary.warnings == ()
    assert "wheels in the air" in summary.sentences[1]
    covered = sum(row.covered is True for row in rows)
    assert any(f"{covered} of 11 intervals hold it" in sentence for sentence in summary.sentences)
