"""The figures hold the data they are given, and the drawings are geometry."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.plan import Plan
from ident.estimate.result import Identification
from ident.records.record import Record, Step
from ident.report import figures
from ident.report.comparison import comparisons, folded
from ident.report.driven_path import covered_floor, driven_legs, vehicle_outline
from ident.report.excitation import phase_planes
from ident.report.rows import Role, parameter_rows
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]


def unpacked(values: Any) -> Array:
    assert values["dtype"] == "f4"
    return np.frombuffer(base64.b64decode(values["bdata"]), dtype="<f4").astype(float)


def test_both_sides_of_24_are_drawn_and_their_difference_below(identification: Identification) -> None:
    for comparison in comparisons(identification):
        figure = figures.torque_figure(comparison, identification.processing)
        measured, modelled, residual = (unpacked(trace["y"]) for trace in figure["data"])
        keep = figures.drawn(len(comparison.time), comparison.sample_time, identification.processing)
        assert measured == pytest.approx(comparison.measured[keep], rel=1e-6, abs=1e-4)
        assert measured - modelled == pytest.approx(residual, abs=2e-4)
        assert unpacked(figure["data"][0]["x"]) == pytest.approx(comparison.time[keep], abs=1e-4)


def test_the_model_side_is_linear_in_the_ten_parameters_and_b_w_stands_on_the_other(
    identification: Identification,
) -> None:
    values = identification.values
    for comparison, equations in zip(comparisons(identification), identification.equations, strict=True):
        inertia = equations.regressor[:, 10] * values[10]
        if comparison.role is Role.INERTIA:
            assert comparison.measured == pytest.approx(equations.torque)
        else:
            assert comparison.measured == pytest.approx(equations.torque - inertia)
            assert comparison.modelled == pytest.approx(equations.regressor[:, :10] @ values[:10])


def test_the_nrmse_of_what_is_drawn_is_the_one_reported(identification: Identification) -> None:
    for comparison, floor in zip(comparisons(identification), identification.floors, strict=True):
        error = comparison.residual[comparison.moving]
        assert np.sqrt(np.mean(error**2)) == pytest.approx(floor.residual)


def test_exactly_the_rows_in_stiction_are_shaded(identification: Identification) -> None:
    for comparison in comparisons(identification):
        spans = comparison.stuck_spans()
        inside = np.zeros(len(comparison.time), dtype=bool)
        for start, stop in spans:
            inside |= (comparison.time >= start - 1e-9) & (comparison.time < stop - 1e-9)
        inside[-1] |= not comparison.moving[-1]
        assert np.array_equal(inside, ~comparison.moving)
        shapes = figures.torque_figure(comparison, identification.processing)["layout"]["shapes"]
        assert [(shape["x0"], shape["x1"]) for shape in shapes] == spans


def test_drawing_every_nth_sample_keeps_the_whole_band_of_the_filter(identification: Identification) -> None:
    keep = figures.drawn(17000, 0.002, identification.processing)
    nyquist = np.pi / (keep.step * 0.002)
    assert nyquist >= 3.9 * identification.processing.cutoff
    assert len(range(*figures.drawn(1_000_000, 0.002, identification.processing).indices(1_000_000))) <= 3000


def test_folding_separates_what_repeats_from_what_does_not(identification: Identification) -> None:
    comparison = next(entry for entry in comparisons(identification) if entry.step == "straight")
    fold = folded(comparison)
    assert fold is not None
    kept = ~np.isnan(fold.mean)
    numbers = comparison.period[comparison.period >= 0]
    assert len(fold.periods) == len(np.unique(numbers))
    floor = next(floor for floor in identification.floors if floor.step == "straight")
    assert fold.noise == pytest.approx(floor.noise)
    shifted = replace(comparison, measured=comparison.measured + 5.0)
    moved = folded(shifted)
    assert moved is not None
    assert moved.mean[kept] == pytest.approx(fold.mean[kept] + 5.0)
    assert moved.noise == pytest.approx(fold.noise)


def test_nothing_is_folded_without_repeats(identification: Identification) -> None:
    comparison = next(entry for entry in comparisons(identification) if entry.step == "lane_change")
    assert folded(comparison) is None


def test_the_path_of_the_wheels_is_the_path_that_was_planned(
    record: Record, prototype: VehicleDescription, identification: Identification, plan: Plan, truth: Parameters
) -> None:
    legs = driven_legs(record, prototype.geometry, identification.processing)
    assert [leg.step for leg in legs] == [step for step in plan.steps if step is not Step.WHEEL_LIFTED]
    start = np.zeros(3)
    for leg in legs:
        planned = plan.reference(Step(leg.step), truth).path[-1]
        cos, sin = np.cos(start[2]), np.sin(start[2])
        turned = np.array([cos * planned[0] - sin * planned[1], sin * planned[0] + cos * planned[1], planned[2]])
        expected = start + turned
        assert leg.pose[-1] == pytest.approx(expected, abs=5e-3)
        start = leg.pose[-1]
    assert legs[-1].pose[-1, 1] - legs[-1].pose[0, 1] == pytest.approx(plan.manoeuvre.shift, rel=0.05)
    assert covered_floor(legs)[0] > plan.manoeuvre.length


def test_wheels_are_drawn_at_their_offset_and_point_where_they_roll(geometry: Geometry) -> None:
    rotation = geometry.rotation_angle
    frame, *wheels = vehicle_outline(np.zeros(3), np.array([-rotation, rotation]), geometry)
    assert np.ptp(frame, axis=0) == pytest.approx([geometry.wheelbase, geometry.track_width])
    for axis, contact, front, back in wheels:
        assert np.hypot(*(contact - axis)) == pytest.approx(geometry.wheel_offset)
        assert np.hypot(*(front - back)) == pytest.approx(2 * geometry.wheel_radius)
        # Pure rotation: every wheel stands across its radius, at the lever of mode 4.
        assert np.dot(front - back, contact) == pytest.approx(0.0, abs=1e-9)
        assert np.hypot(*contact) == pytest.approx(geometry.rotation_lever)


def test_a_drawn_vehicle_turns_and_moves_with_its_pose(geometry: Geometry) -> None:
    pose = np.array([2.0, -1.0, 0.7])
    home = vehicle_outline(np.zeros(3), np.array([0.2, 0.1]), geometry)
    moved = vehicle_outline(pose, np.array([0.2, 0.1]), geometry)
    for before, after in zip(home, moved, strict=True):
        back = (after - pose[:2]) @ np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
        assert back == pytest.approx(before)


def test_planes_show_the_motion_that_was_driven(
    record: Record, identification: Identification, prototype: VehicleDescription, plan: Plan, truth: Parameters
) -> None:
    planes = phase_planes(record, identification.equations, prototype.geometry, identification.processing)
    assert [plane.coordinate for plane in planes] == ["alpha_l", "alpha_r", "x", "gamma"]
    assert [plane.unit for plane in planes] == ["rad", "rad", "m", "rad"]
    for plane in planes:
        driven = plan.reference(Step(plane.step), truth).tracks[plane.coordinate].velocity
        assert np.abs(plane.speed).max() == pytest.approx(np.abs(driven).max(), rel=0.05)
        figure = figures.excitation_figure(plane)
        assert sum(len(unpacked(trace["x"])) for trace in figure["data"]) == len(plane.speed)


def test_relative_intervals_and_truth_are_in_percent(identification: Identification, truth: Parameters) -> None:
    rows = parameter_rows(identification, truth)
    intervals, true_values = figures.interval_figure(rows)["data"]
    assert intervals["y"] == [row.estimate.name for row in rows][::-1]
    for row, width, offset in zip(rows[::-1], intervals["error_x"]["array"], true_values["x"], strict=True):
        value = row.estimate.value
        assert width == pytest.approx(100 * (row.estimate.ci95[1] - value) / value)
        assert value * (1 + offset / 100) == pytest.approx(row.truth)
    assert len(figures.interval_figure(parameter_rows(identification))["data"]) == 1
