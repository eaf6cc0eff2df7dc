"""A result that cannot be true is not called good, whatever made it so; a sound one is."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.assessment import Assessment, ReasonCode, Verdict, assess
from ident.assessment.encoders import slopes
from ident.assessment.file import assessment_text, refuse_unusable
from ident.assessment.fit import drift_share
from ident.errors import UserError
from ident.estimate.filters import Processing
from ident.estimate.identify import identify
from ident.estimate.result import Identification
from ident.parameters_file import Identified, read_model, write_model
from ident.records.record import Record, Segment, Step
from ident.report.assessment import assessment_lines
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]
Change = Callable[[Segment], Segment]


def assessed(record: Record, vehicle: VehicleDescription) -> Assessment:
    return assess(identify(record, vehicle.geometry), record, vehicle)


def changed(record: Record, change: Change, *steps: Step) -> Record:
    """The record with a change in some steps, all if none is named."""
    return replace(record, segments=[change(one) if not steps or one.step in steps else one for one in record.segments])


def codes(assessment: Assessment) -> set[str]:
    return {reason.code for reason in assessment.reasons}


def torques_times(factor: float) -> Change:
    return lambda one: replace(one, motor_torques=factor * one.motor_torques)


def wheel_times(wheel: int, factor: float) -> Change:
    def change(one: Segment) -> Segment:
        angles = one.wheel_angles.copy()
        angles[:, wheel] *= factor
        return replace(one, wheel_angles=angles)

    return change


def steering_times(side: int, factor: float) -> Change:
    def change(one: Segment) -> Segment:
        angles = one.steering_angles.copy()
        angles[:, side] *= factor
        return replace(one, steering_angles=angles)

    return change


def test_a_sound_campaign_is_good(record: Record, prototype: VehicleDescription) -> None:
    assessment = assessed(record, prototype)
    assert assessment.verdict is Verdict.GOOD, assessment
    assert not assessment.reasons


@pytest.mark.parametrize("factor", [1000.0, -1.0, 0.01])
def test_torques_in_another_unit_or_of_the_other_sign_are_unusable(
    record: Record, prototype: VehicleDescription, factor: float
) -> None:
    assert assessed(changed(record, torques_times(factor)), prototype).verdict is Verdict.UNUSABLE


def test_torques_of_another_torque_constant_conflict_with_the_prior(
    record: Record, prototype: VehicleDescription
) -> None:
    """No motion tells torques from parameters: all times 1.6 is all parameters times 1.6, and only priors know."""
    assessment = assessed(changed(record, torques_times(1.6)), prototype)
    assert assessment.verdict is Verdict.DOUBTFUL
    assert codes(assessment) == {ReasonCode.PRIOR_CONFLICT}
    assert "m_ch" in {reason.channel for reason in assessment.reasons}


def test_angles_in_degrees_are_beyond_stops_and_motor_speed(record: Record, prototype: VehicleDescription) -> None:
    def degrees(one: Segment) -> Segment:
        return replace(one, wheel_angles=np.degrees(one.wheel_angles), steering_angles=np.degrees(one.steering_angles))

    assessment = assessed(changed(record, degrees), prototype)
    assert assessment.verdict is Verdict.UNUSABLE
    assert {ReasonCode.BEYOND_STOPS, ReasonCode.BEYOND_MOTOR_SPEED} <= codes(assessment)


def test_a_steering_encoder_of_the_other_sign_is_in_another_posture(
    record: Record, prototype: VehicleDescription
) -> None:
    assessment = assessed(changed(record, steering_times(0, -1.0)), prototype)
    assert assessment.verdict is Verdict.UNUSABLE
    assert ("wrong_posture", "alpha_l") in {(reason.code, reason.channel) for reason in assessment.reasons}
    assert ("encoders_disagree", "alpha_l") in {(reason.code, reason.channel) for reason in assessment.reasons}


@pytest.mark.parametrize("step", [Step.STRAIGHT, Step.ROTATION])
def test_a_wheel_that_slips_in_one_step_makes_its_inertia_doubtful(
    record: Record, prototype: VehicleDescription, step: Step
) -> None:
    assessment = assessed(changed(record, wheel_times(0, 1.05), step), prototype)
    assert assessment.verdict is Verdict.DOUBTFUL
    named = {(reason.code, reason.channel) for reason in assessment.reasons}
    assert (ReasonCode.ENCODERS_DISAGREE, "beta_fl") in named


def test_a_wrong_gear_ratio_is_seen_by_the_steering_encoders(record: Record, prototype: VehicleDescription) -> None:
    """Wheel angles too small by 20/25, as a network file with another gear ratio makes them."""
    assessment = assessed(changed(record, lambda one: replace(one, wheel_angles=0.8 * one.wheel_angles)), prototype)
    assert assessment.verdict is Verdict.UNUSABLE
    assert ReasonCode.ENCODERS_DISAGREE in codes(assessment)


def test_the_slope_of_an_encoder_is_the_factor_on_it(record: Record, prototype: VehicleDescription) -> None:
    """One wheel of four times 1.1: the other three say one, its own slope is 1.1."""
    straight = next(changed(record, wheel_times(2, 1.1)).of(Step.STRAIGHT))
    found = {one.channel: one.slope for one in slopes(straight, prototype.geometry, Processing())}
    assert found["beta_fr"] == pytest.approx(1.1, abs=1e-3)
    assert found["beta_fl"] == pytest.approx(3 / 3.1, abs=1e-3)


def test_friction_that_warms_up_is_no_noise(record: Record, prototype: VehicleDescription, truth: Parameters) -> None:
    """What differs from repeat to repeat belongs to the vehicle: friction that falls by 40 % within 12 s."""

    def warming(one: Segment) -> Segment:
        rates = np.gradient(one.wheel_angles, one.sample_time, axis=0)
        share = 0.4 * (1 - np.exp(-(one.time - one.time[0]) / 12.0))
        less = share[:, None] * truth["d_cw"] * np.tanh(rates / 0.01) / prototype.geometry.gear_ratio
        return replace(one, motor_torques=one.motor_torques - less)

    assessment = assessed(changed(record, warming, Step.STRAIGHT), prototype)
    assert ReasonCode.REPEATS_DIFFER in codes(assessment)
    place = next(reason.channel for reason in assessment.reasons if reason.code == ReasonCode.REPEATS_DIFFER)
    assert place == "straight.x"


def test_a_trend_of_the_parameters_takes_little_off_noise(identification: Identification) -> None:
    straight = next(one for one in identification.equations if one.step == Step.STRAIGHT)
    assert drift_share(straight) < 0.1


def with_value(identification: Identification, name: str, **values: object) -> Identification:
    index = PARAMETER_NAMES.index(name)
    estimates = list(identification.estimates)
    estimates[index] = replace(estimates[index], **values)  # type: ignore[arg-type]
    return replace(identification, estimates=tuple(estimates))


@pytest.mark.parametrize(
    ("name", "interval", "verdict"),
    [
        ("m_ch", (-843.0, -841.0), Verdict.UNUSABLE),
        ("d_vw", (-0.7, -0.5), Verdict.UNUSABLE),
        ("d_vw", (-0.03, 0.02), Verdict.DOUBTFUL),
    ],
)
def test_no_parameter_is_negative_and_poor_excitation_is_no_excuse(
    identification: Identification,
    record: Record,
    prototype: VehicleDescription,
    name: str,
    interval: tuple[float, float],
    verdict: Verdict,
) -> None:
    std = (interval[1] - interval[0]) / 4
    impossible = with_value(identification, name, value=sum(interval) / 2, ci95=interval, std=std)
    assessment = assess(impossible, record, prototype)
    found = [reason for reason in assessment.reasons if reason.channel == name]
    assert found[0].code == ReasonCode.NOT_POSITIVE
    assert found[0].verdict is verdict
    assert ReasonCode.POORLY_EXCITED not in {reason.code for reason in found}


@pytest.mark.parametrize(("gyration", "verdict"), [(0.1, Verdict.DOUBTFUL), (1.2, Verdict.DOUBTFUL), (2.0, "unusable")])
def test_a_yaw_inertia_that_no_body_of_the_mass_and_size_has(
    identification: Identification, record: Record, prototype: VehicleDescription, gyration: float, verdict: str
) -> None:
    half_diagonal = np.hypot(prototype.geometry.wheelbase, prototype.geometry.track_width) / 2
    inertia = identification["m_ch"].value * (gyration * half_diagonal) ** 2
    odd = with_value(identification, "C_ch", value=inertia, ci95=(0.99 * inertia, 1.01 * inertia))
    found = [r for r in assess(odd, record, prototype).reasons if r.code == ReasonCode.IMPOSSIBLE_INERTIA]
    assert [reason.verdict for reason in found] == [verdict]


def test_a_poor_parameter_and_a_missed_lane_change_are_said_in_words(
    identification: Identification, record: Record, prototype: VehicleDescription
) -> None:
    estimate = identification["C_l"]
    floors = [
        replace(floor, residual=0.2 * floor.signal) if floor.step == "lane_change" else floor
        for floor in identification.floors
    ]
    floors[4] = replace(floors[4], noise=0.1, model_error=0.3)
    worse = replace(with_value(identification, "C_l", ci95=(0.0, 2 * estimate.value)), floors=tuple(floors))
    texts = [reason.text for reason in assess(worse, record, prototype).reasons]
    assert [text.split()[:2] for text in texts] == [
        ["C_l", "is"],
        ["In", "steering_left,"],
        ["The", "steering"],
        ["The", "drive"],
    ]
    assert "20 % NRMSE" in texts[-1]


def test_the_verdict_and_its_reasons_are_in_the_file_beside_the_parameters(
    identification: Identification, record: Record, prototype: VehicleDescription, tmp_path: Path
) -> None:
    impossible = with_value(identification, "m_ch", value=-842.0, ci95=(-843.0, -841.0))
    assessment = assess(impossible, record, prototype)
    path = tmp_path / "parameters.toml"
    identified = Identified(impossible, assessment)
    write_model(identified.model, path, {"run": 'a "quoted" name'}, identified=identified)
    table = tomllib.loads(path.read_text())["assessment"]
    assert table["verdict"] == "unusable"
    assert len(table["reasons"]) == len(assessment.reasons)
    assert {"code", "channel", "value", "limit", "text"} <= table["reasons"][0].keys()
    assert read_model(path).parameters["m_ch"] == -842.0
    with pytest.raises(UserError, match=r"unusable.*m_ch"):
        read_model(path, force=False)


def test_a_file_of_no_assessment_or_a_better_one_passes() -> None:
    refuse_unusable({}, "by hand", force=False)
    refuse_unusable(tomllib.loads(assessment_text(Assessment())), "good", force=False)


def test_the_first_line_says_the_verdict_and_the_last_the_next_command(
    record: Record, prototype: VehicleDescription
) -> None:
    assessment = assessed(changed(record, torques_times(-1.0)), prototype)
    lines = [str(line) for line in assessment_lines(assessment, "quasiomni diagnose runs/monday")]
    assert lines[0].startswith("Unusable:")
    assert lines[-1] == "Next: quasiomni diagnose runs/monday"
    assert [str(line) for line in assessment_lines(Assessment(), "x")] == ["Good: nothing speaks against this result."]
