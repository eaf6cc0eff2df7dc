"""What took no part in a fit judges it: the later repeats and the lane change, in every channel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.gap.vehicle.closing import extended_model
from ident.gap.vehicle.diagnose import diagnose_vehicle
from ident.gap.vehicle.unseen import later_part, unseen_gaps
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.effects import EffectName, make_effect
from ident.vehicle.extended import ExtendedModel

Drives = Callable[..., tuple[Record, Record]]


def biased(segment: Segment) -> Segment:
    return replace(segment, motor_torques=segment.motor_torques - np.array([0, 0, 0.05, 0]))


@pytest.mark.parametrize("alone", [False, True])
def test_a_cause_that_is_right_closes_dynamic_and_outcome_on_what_was_not_fitted(
    prototype: VehicleDescription, drives: Drives, alone: bool
) -> None:
    fit, confirm = drives(prototype, biased)
    confirming = [] if alone else [confirm]
    findings = diagnose_vehicle([fit], confirming, prototype).findings
    found = {one.channel: one.gap for one in unseen_gaps(findings, [fit], confirming, prototype)}
    assert set(found) == {"kinematic", "dynamic", "outcome"}
    assert found["dynamic"].closed > 0.8
    assert found["outcome"].closed > 0.8
    assert found["kinematic"].after == pytest.approx(found["kinematic"].before, abs=0.05)


def test_a_lane_change_is_told_apart(prototype: VehicleDescription, drives: Drives) -> None:
    fit, confirm = drives(prototype, biased)
    straight = next(segment for segment in confirm.segments if segment.step == "straight")
    lane = replace(straight, step="lane_change", period=np.full(len(straight), -1))
    findings = diagnose_vehicle([fit], [confirm], prototype).findings
    unseen = unseen_gaps(findings, [fit], [replace(confirm, segments=[*confirm.segments, lane])], prototype)
    changed = {one.channel: one.gap for one in unseen if one.steps == "lane_change"}
    assert changed["dynamic"].closed > 0.8


def test_the_model_that_was_given_keeps_its_effects(prototype: VehicleDescription, drives: Drives) -> None:
    known = make_effect(EffectName.QUADRATIC_DRAG, "chassis", {"coefficient": 0.001})
    fit, confirm = drives(prototype, biased)
    model = ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values), (known,))
    findings = diagnose_vehicle([fit], [confirm], prototype, model).findings
    extended = extended_model(findings, prototype.prior, given=model.effects)
    assert extended.effects[0] == known
    assert {effect.where for effect in extended.effects[1:]} & {"drive_fr", "wheel_fr"}


def test_the_later_repeats_of_a_step_are_its_later_part(drives: Drives, prototype: VehicleDescription) -> None:
    fit, _ = drives(prototype, lambda segment: segment)
    later = later_part(fit)
    assert later is not None
    for whole, part in zip(fit.segments, later.segments, strict=True):
        fitted = whole.periods[: (len(whole.periods) + 1) // 2]
        assert set(part.periods) == set(whole.periods) - set(fitted)
        assert len(part.motor_torques) == len(part) < len(whole)


def test_of_a_record_without_repeats_the_end_is_held_out(prototype: VehicleDescription, drives: Drives) -> None:
    fit, _ = drives(prototype, lambda segment: segment)
    segments = [replace(segment, period=np.full(len(segment), -1)) for segment in fit.segments]
    later = later_part(replace(fit, segments=segments))
    assert later is not None
    assert len(later.segments[0]) == pytest.approx(0.4 * len(segments[0]), abs=2)


def test_where_nothing_moves_in_what_is_held_out_there_is_nothing_to_say(
    prototype: VehicleDescription, drives: Drives
) -> None:
    fit, confirm = drives(prototype, lambda segment: segment)
    findings = diagnose_vehicle([fit], [confirm], prototype).findings

    def stopped(segment: Segment) -> Segment:
        """Standing through the later 60 %, in a record that numbers no repeats."""
        last = int(0.4 * len(segment))
        wheels, steering = segment.wheel_angles.copy(), segment.steering_angles.copy()
        wheels[last:], steering[last:] = wheels[last], steering[last]
        period = np.full(len(segment), -1)
        return replace(segment, wheel_angles=wheels, steering_angles=steering, period=period)

    still = replace(fit, segments=[stopped(segment) for segment in fit.segments])
    assert unseen_gaps(findings, [still], [], prototype) == ()
