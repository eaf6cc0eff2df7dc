"""A model with the right effect closes the gap on records it has not seen, in all channels; a wrong one does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.closing import channel_gaps, extended_model, plain_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.effects import EFFECTS, make_effect
from ident.effects.extended import ExtendedModel
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription

Drives = Callable[..., tuple[Record, Record]]


def biased(segment: Segment) -> Segment:
    return replace(segment, motor_torques=segment.motor_torques - np.array([0, 0, 0.05, 0]))


def flawed(record: Record, flaw: Callable[[Segment], Segment]) -> Record:
    return replace(record, segments=[flaw(segment) for segment in record.segments])


def worn(segment: Segment) -> Segment:
    """The wheel fl is half a millimetre smaller than the vehicle file says."""
    return replace(segment, wheel_angles=segment.wheel_angles * np.array([0.1 / 0.0995, 1, 1, 1]))


def test_the_right_effect_closes_dynamic_and_outcome(prototype: VehicleDescription, drives: Drives) -> None:
    _, unseen = drives(prototype, biased)
    right = make_effect(EffectName.TORQUE_BIAS, "drive_fr", {"bias": 0.05})
    wrong = make_effect(EffectName.TORQUE_BIAS, "drive_rl", {"bias": -0.05})
    plain = ExtendedModel(prototype.prior)
    closed = channel_gaps([unseen], prototype, plain, ExtendedModel(prototype.prior, (right,)))
    assert closed[Channel.DYNAMIC].closed > 0.9
    assert closed[Channel.OUTCOME].closed > 0.9
    missed = channel_gaps([unseen], prototype, plain, ExtendedModel(prototype.prior, (wrong,)))
    assert missed[Channel.DYNAMIC].closed < 0.2


def test_the_right_radius_closes_the_kinematic_gap(prototype: VehicleDescription, drives: Drives) -> None:
    _, unseen = drives(prototype, worn)
    right = make_effect(EffectName.WHEEL_RADIUS, "wheel_fl", {"error": -0.0005})
    gaps = channel_gaps([unseen], prototype, ExtendedModel(prototype.prior), ExtendedModel(prototype.prior, (right,)))
    assert gaps[Channel.KINEMATIC].closed > 0.95


def late(segment: Segment) -> Segment:
    """The left encoder is 8 ms late."""
    angle = np.interp(segment.time - 0.008, segment.time, segment.steering_angles[:, 0])
    return replace(segment, steering_angles=np.stack([angle, segment.steering_angles[:, 1]], axis=1))


def test_the_right_delay_of_an_encoder_closes_what_is_read_too_late(
    prototype: VehicleDescription, drives: Drives
) -> None:
    _, unseen = drives(prototype, late)
    right = make_effect(EffectName.TIME_DELAY, "encoder_left", {"delay": 0.008})
    gaps = channel_gaps([unseen], prototype, ExtendedModel(prototype.prior), ExtendedModel(prototype.prior, (right,)))
    assert gaps[Channel.KINEMATIC].closed > 0.9
    assert gaps[Channel.OUTCOME].after <= gaps[Channel.OUTCOME].before


def test_a_model_may_have_every_effect_there_is(prototype: VehicleDescription, drives: Drives) -> None:
    """Each at its last place, hardly of any size: all channels stay where they were."""
    _, unseen = drives(prototype, lambda segment: segment)
    sizes = {EffectName.SLIP: 0.6, EffectName.ELASTICITY: 1e-6}
    effects = tuple(
        make_effect(name, spec.places[-1], {spec.size.name: sizes.get(name, 1e-9)}) for name, spec in EFFECTS.items()
    )
    plain = ExtendedModel(prototype.prior)
    for gap in channel_gaps([unseen], prototype, plain, ExtendedModel(prototype.prior, effects)).values():
        assert gap.after == pytest.approx(gap.before, abs=0.05)


def test_the_noise_may_come_from_other_records(prototype: VehicleDescription, drives: Drives) -> None:
    """A single repeat has no noise of its own to be measured in."""
    repeated, unseen = drives(prototype, biased)
    once = flawed(unseen, lambda segment: replace(segment, period=np.full(len(segment), -1)))
    right = make_effect(EffectName.TORQUE_BIAS, "drive_fr", {"bias": 0.05})
    models = ExtendedModel(prototype.prior), ExtendedModel(prototype.prior, (right,))
    gaps = channel_gaps([once], prototype, *models, repeated=[repeated])
    assert gaps[Channel.DYNAMIC].closed > 0.9
    assert np.isnan(channel_gaps([once], prototype, *models)[Channel.DYNAMIC].before)


def test_nothing_is_found_where_nothing_is_missing(prototype: VehicleDescription, drives: Drives) -> None:
    fit, confirm = drives(prototype, lambda segment: segment)
    assert diagnose_vehicle([fit], [confirm], prototype).diagnosis.verdict is Verdict.NONE


def test_a_bias_is_named_with_its_set_its_place_and_its_size(prototype: VehicleDescription, drives: Drives) -> None:
    fit, confirm = drives(prototype, biased)
    found = diagnose_vehicle([fit], [confirm], prototype)
    first = found.diagnosis.effects[0]
    assert {first.name, *first.ambiguity_set} == {"torque_bias", "asymmetric_coulomb"}
    assert first.where in ("drive_fr", "wheel_fr")
    if first.name == "torque_bias":
        bias = first.parameters["bias"]
        assert abs(bias.value - 0.05) < 3 * bias.std + 1e-3
    models = (plain_model(found.findings, prototype.prior), extended_model(found.findings, prototype.prior))
    gaps = channel_gaps([confirm], prototype, *models)
    assert gaps[Channel.DYNAMIC].closed > 0.8


def test_a_heavier_vehicle_is_a_drift_of_the_model_that_was_given(
    prototype: VehicleDescription, drives: Drives
) -> None:
    """88 kg more than the model has: mass is refitted without a model, and is the cause with one."""

    def loaded(segment: Segment) -> Segment:
        if segment.step != "straight":
            return segment
        g = prototype.geometry
        acceleration = g.wheel_radius * np.gradient(
            np.gradient(segment.wheel_angles[:, 0], segment.sample_time), segment.sample_time
        )
        change = 88.0 * acceleration * g.wheel_radius / (4 * g.gear_ratio)
        return replace(segment, motor_torques=segment.motor_torques + change[:, None])

    fit, confirm = drives(prototype, loaded)
    assert diagnose_vehicle([fit], [confirm], prototype).diagnosis.verdict is Verdict.NONE
    known = ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values))
    first = diagnose_vehicle([fit], [confirm], prototype, known).diagnosis.effects[0]
    assert {"payload", "parameter_change"} & {first.name, *first.ambiguity_set}
    assert first.where in ("chassis", "m_ch")


@pytest.mark.slow
def test_a_small_wheel_is_named(prototype: VehicleDescription, drives: Drives) -> None:
    fit, confirm = drives(prototype, worn)
    first = diagnose_vehicle([fit], [confirm], prototype).diagnosis.effects[0]
    assert (first.name, first.where) == ("wheel_radius", "wheel_fl")
    assert first.parameters["error"].value == pytest.approx(-0.0005, rel=0.02)
