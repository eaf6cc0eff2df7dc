"""What took no part in a fit judges it: the later repeats and the lane change, in every channel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.closing import extended_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, Drive, ideal_record
from ident.diagnosis.vehicle.outcome import outcomes
from ident.diagnosis.vehicle.records.sources import DIAGNOSED, Source, sources_of
from ident.diagnosis.vehicle.unseen import later_part, unseen_gaps
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel
from ident.estimate.filters import Processing
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription

Drives = Callable[..., tuple[Record, Record]]

FEW = (EffectName.TORQUE_BIAS, EffectName.ASYMMETRIC_COULOMB, EffectName.QUADRATIC_DRAG, EffectName.SLOPE)
"""The true causes and those that are like them: here it is judged what they close, not whether they are found."""


def biased(segment: Segment) -> Segment:
    return replace(segment, motor_torques=segment.motor_torques - np.array([0, 0, 0.05, 0]))


@pytest.fixture(scope="module")
def confirmed(prototype: VehicleDescription, drives: Drives) -> Findings:
    """What is found in the record to fit and confirmed in the other one."""
    fit, confirm = drives(prototype, biased)
    return diagnose_vehicle([fit], [confirm], prototype, effects=FEW).findings


@pytest.mark.parametrize("alone", [False, True])
def test_a_cause_that_is_right_closes_dynamic_and_outcome_on_what_was_not_fitted(
    prototype: VehicleDescription, drives: Drives, confirmed: Findings, alone: bool
) -> None:
    fit, confirm = drives(prototype, biased)
    confirming = [] if alone else [confirm]
    findings = diagnose_vehicle([fit], [], prototype, effects=FEW).findings if alone else confirmed
    found = {one.channel: one.gap for one in unseen_gaps(findings, [fit], confirming, prototype)}
    assert set(found) == {"kinematic", "dynamic", "outcome"}
    assert found["dynamic"].closed > 0.8
    assert found["outcome"].closed > 0.8
    assert found["kinematic"].after == pytest.approx(found["kinematic"].before, abs=0.05)


def test_a_lane_change_is_told_apart(prototype: VehicleDescription, drives: Drives, confirmed: Findings) -> None:
    fit, confirm = drives(prototype, biased)
    straight = next(segment for segment in confirm.segments if segment.step == "straight")
    lane = replace(straight, step="lane_change", period=np.full(len(straight), -1))
    unseen = unseen_gaps(confirmed, [fit], [replace(confirm, segments=[*confirm.segments, lane])], prototype)
    changed = {one.channel: one.gap for one in unseen if one.steps == "lane_change"}
    assert changed["dynamic"].closed > 0.8


def test_more_of_an_effect_that_the_model_has_is_one_effect(prototype: VehicleDescription, drives: Drives) -> None:
    known = make_effect(EffectName.TORQUE_BIAS, "drive_fr", {"bias": 0.03}, {"bias": 0.001})
    fit, confirm = drives(prototype, biased)
    model = ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values), (known,))
    findings = diagnose_vehicle([fit], [confirm], prototype, model, effects=(EffectName.TORQUE_BIAS,)).findings
    (bias,) = extended_model(findings, prototype.prior, given=model.effects).effects
    assert bias["bias"] == pytest.approx(0.05, abs=0.003)


def test_the_model_that_was_given_keeps_its_effects(prototype: VehicleDescription, drives: Drives) -> None:
    known = make_effect(EffectName.QUADRATIC_DRAG, "chassis", {"coefficient": 0.001})
    fit, confirm = drives(prototype, biased)
    model = ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values), (known,))
    findings = diagnose_vehicle([fit], [confirm], prototype, model, effects=FEW).findings
    extended = extended_model(findings, prototype.prior, given=model.effects)
    assert extended.effects[0] == known
    assert {effect.where for effect in extended.effects[1:]} & {"drive_fr", "wheel_fr"}


@pytest.fixture(scope="module")
def sources(drives: Drives, prototype: VehicleDescription) -> list[Source]:
    return sources_of(drives(prototype, lambda segment: segment)[0], prototype.geometry, DIAGNOSED, Processing())


def test_the_later_repeats_of_a_step_are_its_later_part(sources: list[Source]) -> None:
    for source in sources:
        later = later_part(source)
        assert set(np.unique(source.period)) == {0, 1}
        assert set(np.unique(later.period)) == {-1, 1}
        assert len(later.inputs) == len(source.inputs), "what was before is still what an effect remembers"
        for rows, whole in zip(later.moving, source.moving, strict=True):
            np.testing.assert_array_equal(rows, whole & (source.period == 1))


def test_of_a_record_without_repeats_parts_are_held_out_by_turns(sources: list[Source]) -> None:
    source = replace(sources[0], period=np.full_like(sources[0].period, -1))
    (rows,), (whole,) = later_part(source).moving, source.moving
    # Some of two fifths, the rest being too near to what is fitted.
    assert 0.2 * whole.sum() < rows.sum() < 0.4 * whole.sum()
    assert not np.any(rows & ~whole)
    assert np.flatnonzero(rows)[-1] == np.flatnonzero(whole)[-1]


def test_a_lane_change_is_held_out_whole(sources: list[Source]) -> None:
    lane = replace(sources[0], step="lane_change")
    assert later_part(lane) is lane


def test_a_turn_between_the_steps_is_driven_though_it_is_no_part_that_repeats(
    prototype: VehicleDescription, drives: Drives
) -> None:
    """A floor that rises one way helps the other way: whoever loses half a turn has a gap twice as large."""
    force = prototype.prior["m_ch"] * 9.81 * np.sin(0.01)
    torque = force * prototype.geometry.wheel_radius / (4 * prototype.geometry.gear_ratio)
    uphill = {"straight": 1.0, "straight_turned": -1.0}

    def on_a_slope(segment: Segment) -> Segment:
        return replace(segment, motor_torques=segment.motor_torques + uphill.get(segment.step, 0.0) * torque)

    fit, _ = drives(prototype, on_a_slope, DIAGNOSTIC["two headings"].drives)
    findings = diagnose_vehicle([fit], [], prototype, effects=FEW).findings
    assert "slope@chassis" in {cause.candidate.key for cause in findings.causes}
    dynamic = next(one.gap for one in unseen_gaps(findings, [fit], [], prototype) if one.channel == "dynamic")
    assert dynamic.before > 5
    assert dynamic.after < 1.5


def test_a_record_that_numbers_no_repeats_confirms_in_the_noise_of_those_that_do(
    prototype: VehicleDescription, drives: Drives
) -> None:
    fit, confirm = drives(prototype, biased)
    once = replace(confirm, segments=[replace(s, period=np.full(len(s), -1)) for s in confirm.segments])
    findings = diagnose_vehicle([fit], [once], prototype, effects=FEW).findings
    found = {one.channel: one.gap for one in unseen_gaps(findings, [fit], [once], prototype)}
    assert set(found) == {"kinematic", "dynamic", "outcome"}
    assert found["dynamic"].closed > 0.8


def test_without_any_repeat_there_is_no_noise_to_measure_in(prototype: VehicleDescription, drives: Drives) -> None:
    fit, _ = drives(prototype, biased)
    once = replace(fit, segments=[replace(s, period=np.full(len(s), -1)) for s in fit.segments])
    findings = diagnose_vehicle([once], [], prototype, effects=FEW).findings
    assert {one.channel for one in unseen_gaps(findings, [once], [], prototype)} <= {"kinematic"}


def test_segments_of_one_mode_with_other_loads_are_simulated_with_their_own(prototype: VehicleDescription) -> None:
    """Without noise what was driven comes out again, with 80 kg aboard and without."""
    record = ideal_record([Drive(Step.STRAIGHT), *DIAGNOSTIC["known payload"].drives], prototype)
    sources = sources_of(record, prototype.geometry, DIAGNOSED, Processing(), as_recorded=True)
    found = {
        (one.step, one.coordinate): one for one in outcomes(sources, ExtendedModel(prototype.prior), prototype.geometry)
    }
    assert set(found) == {("straight", "x"), ("straight_loaded", "x"), ("rotation_loaded", "gamma")}
    for one in found.values():
        assert np.abs(one.differences).max() < 0.01
    silent = replace(record, segments=[replace(segment, extra={}) for segment in record.segments])
    sources = sources_of(silent, prototype.geometry, DIAGNOSED, Processing(), as_recorded=True)
    off = {
        (one.step, one.coordinate): one for one in outcomes(sources, ExtendedModel(prototype.prior), prototype.geometry)
    }
    assert np.abs(off["straight_loaded", "x"].differences).max() > 0.02
    np.testing.assert_allclose(off["straight", "x"].differences, found["straight", "x"].differences, atol=1e-12)
