"""Sizes that are hard to get right: of what the model has already, what is not linear, and what scales all torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.closing import channel_gaps, extended_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC
from ident.effects import EFFECTS, Effect, make_effect
from ident.effects.extended import ExtendedModel
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters
from tests.ident.diagnosis.vehicle.flaws import rippled, sticky

Drives = Callable[..., tuple[Record, Record]]


def judged(prototype: VehicleDescription, *effects: Effect) -> ExtendedModel:
    return ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values), effects)


def test_a_centre_of_mass_far_off_the_centre_is_found_with_the_inertia_that_it_makes(
    prototype: VehicleDescription, drives: Drives
) -> None:
    """On a known slope, by Newton and Steiner; C_ch stays that about the centre of mass."""
    slope, ahead, g = 0.0175, 0.15, prototype.geometry
    weight = prototype.prior["m_ch"] * 9.80665 * np.sin(slope)
    circle = np.hypot(g.wheelbase, g.track_width) / 2 + g.wheel_offset

    def on_a_slope(segment: Segment) -> Segment:
        turned = segment.wheel_angles[:, 2] * g.wheel_radius / circle
        turning = np.gradient(np.gradient(turned, segment.sample_time), segment.sample_time)
        torque = prototype.prior["m_ch"] * ahead**2 * turning - weight * ahead * np.sin(turned)
        senses = np.sign(np.ptp(segment.wheel_angles, axis=0) * np.sign(segment.wheel_angles.T @ turned))
        change = {
            "straight": np.full((len(segment), 4), weight * g.wheel_radius / 4),
            "rotation": torque[:, None] * senses * g.wheel_radius / (4 * circle),
        }.get(segment.step, 0.0)
        return replace(segment, motor_torques=segment.motor_torques + change / g.gear_ratio)

    fit, confirm = drives(prototype, on_a_slope)
    known = make_effect(EffectName.SLOPE, "chassis", {"angle": slope})
    model = ExtendedModel(replace(prototype.prior, std=0.005 * prototype.prior.values), (known,))
    findings = diagnose_vehicle([fit], [confirm], prototype, model, effects=(EffectName.COM_OFFSET,)).findings
    extended = extended_model(findings, prototype.prior, given=model.effects)
    (centre,) = (effect for effect in extended.effects if effect.name == EffectName.COM_OFFSET)
    assert centre["x"] == pytest.approx(ahead, abs=0.004)
    assert extended.parameters["C_ch"] == pytest.approx(prototype.prior["C_ch"], rel=0.01)
    assert channel_gaps([confirm], prototype, model, extended)[Channel.OUTCOME].after < 1.2


@pytest.mark.parametrize(
    ("flaw", "half", "size"),
    [
        (
            partial(sticky, friction=6.0, fall=0.3),
            make_effect(EffectName.STRIBECK, "steering_right", {"amplitude": 3.0, "velocity": 0.3}),
            6.0,
        ),
        (
            partial(rippled, amplitude=0.3),
            make_effect(EffectName.TORQUE_RIPPLE, "drive_fr", {"amplitude": 0.15, "order": 2.0, "phase": 0.4}),
            0.3,
        ),
    ],
)
def test_an_effect_that_has_grown_is_one_effect_of_its_whole_size(
    flaw: Callable[..., Segment], half: Effect, size: float, prototype: VehicleDescription, drives: Drives
) -> None:
    """The model has half of it; what is not linear in it is found anew, and agrees."""
    fit, confirm = drives(prototype, lambda segment: flaw(segment, prototype))
    model = judged(prototype, half)
    findings = diagnose_vehicle([fit], [confirm], prototype, model, effects=(half.name,)).findings
    (whole,) = extended_model(findings, prototype.prior, given=model.effects).effects
    assert whole.size == pytest.approx(size, rel=0.05)
    assert whole.parameters[EFFECTS[half.name].size.name].std < 0.1 * size


def rough(prototype: VehicleDescription, friction: float) -> ExtendedModel:
    """A model whose wheels have so many times their friction, and which knows that it may."""
    names = np.isin(PARAMETER_NAMES, ("d_vw", "d_cw"))
    values = prototype.prior.values * np.where(names, friction, 1.0)
    return ExtendedModel(Parameters(values, np.abs(values) * np.where(names, max(friction - 1, 0.005), 0.005)))


def gain_found(
    gain: float, experiment: str, friction: float | None, prototype: VehicleDescription, drives: Drives
) -> tuple[float, float]:
    """Gain of the first drive with its standard deviation, by a model with some friction of the wheels, or none."""

    def strong(segment: Segment) -> Segment:
        return replace(segment, motor_torques=segment.motor_torques / np.array([1 + gain, 1, 1, 1]))

    fit, confirm = drives(prototype, strong, DIAGNOSTIC[experiment].drives)
    model = None if friction is None else rough(prototype, friction)
    gains = (EffectName.TORQUE_GAIN,)
    cause, *others = diagnose_vehicle([fit], [confirm], prototype, model, effects=gains).findings.causes
    assert cause.candidate.key == "torque_gain@drive_fl"
    # The friction that the model has wrong is no candidate here, and may be a law beside it.
    assert all(other.law is not None and other.candidate.where == "wheels" for other in others)
    return float(cause.part.values[0]), float(cause.part.std[0])


@pytest.mark.parametrize("friction", [None, 1.0, 1.5])
def test_wheels_in_the_air_tell_the_gain_of_a_drive_whatever_the_model_says_of_their_friction(
    friction: float | None, prototype: VehicleDescription, drives: Drives
) -> None:
    """A fifth more torque than is reported; friction that is half as large again in the model, or no model."""
    error, std = gain_found(0.2, "wheels lifted", friction, prototype, drives)
    assert error == pytest.approx(0.2, abs=0.004 + 2.5 * std)
    assert std < 0.015


@pytest.mark.parametrize("friction", [None, 1.5])
def test_dither_tells_the_gain_of_a_drive_though_its_torque_is_as_noisy_as_the_rows(
    friction: float | None, prototype: VehicleDescription, drives: Drives
) -> None:
    """A torque that is fitted to a sum that it is part of takes the noise of the sum away, if it may."""
    error, std = gain_found(0.08, "torque dither", friction, prototype, drives)
    assert error == pytest.approx(0.08, abs=0.003 + 2 * std)
    assert std < 0.01
