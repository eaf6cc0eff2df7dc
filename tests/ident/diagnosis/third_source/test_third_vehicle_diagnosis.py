"""What the diagnosis says of a vehicle that is written without its formulas, and with physics beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.closing import channel_gaps, extended_model, plain_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Drives = Callable[..., tuple[Record, Record]]


def test_of_the_plain_vehicle_no_cause_is_named_and_its_parameters_come_out(
    drives: Drives, prototype: VehicleDescription, plain_truth: dict[str, float]
) -> None:
    fit, confirm = drives()
    found = diagnose_vehicle([fit], [confirm], prototype)
    # Its contacts creep, which the model lacks: 0.7 of the noise repeats in both records, and no cause fits it.
    assert found.diagnosis.verdict is not Verdict.EFFECT
    assert not found.diagnosis.effects
    p, g = extended_model(found.findings, prototype.prior).parameters, prototype.geometry
    wheel = 2 * g.lever_ratio**2
    # An inertia of the steering asks for a tenth of what its friction does: without noise 2 % of it stay unsure.
    for name, merged, part in (("C_l", wheel, 0.05), ("C_r", wheel, 0.05), ("m_ch", 4 / g.wheel_radius**2, 0.002)):
        expected = plain_truth[name] + merged * plain_truth["B_w"]
        assert p[name] + merged * p["B_w"] == pytest.approx(expected, rel=part), name
    for name in ("d_vw", "d_cw"):
        assert p[name] == pytest.approx(plain_truth[name], rel=0.01), name
    for side in "lr":
        coulomb = p[f"d_c{side}"] + 2 * g.lever_ratio * p["d_cw"]
        expected = plain_truth[f"d_c{side}"] + 2 * g.lever_ratio * plain_truth["d_cw"]
        assert coulomb == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
def test_bristles_at_a_steering_axis_come_out_as_stribeck_there(drives: Drives, prototype: VehicleDescription) -> None:
    fit, confirm = drives(bristles=(0, 3.0, 0.3))
    found = diagnose_vehicle([fit], [confirm], prototype)
    (effect,) = found.diagnosis.effects
    assert (effect.name, effect.where) == ("stribeck", "steering_left")
    assert effect.parameters["amplitude"].value == pytest.approx(3.0, rel=0.15)
    assert effect.parameters["velocity"].value == pytest.approx(0.3, rel=0.15)
    assert effect.gap_closed_held_out > 0.7


@pytest.mark.slow
def test_two_masses_and_a_spring_come_out_as_elasticity_of_that_drive_and_close_every_channel(
    drives: Drives, prototype: VehicleDescription, plain_truth: Mapping[str, float]
) -> None:
    """Of the outcome, of which noise and contacts leave little to close, more than the true numbers do."""
    fit, confirm = drives(compliance=5e-4)
    found = diagnose_vehicle([fit], [confirm], prototype)
    (effect,) = found.diagnosis.effects
    assert (effect.name, effect.where) == ("elasticity", "drive_fl")
    assert effect.parameters["compliance"].value == pytest.approx(5e-4, rel=0.01)
    models: list[Any] = [make(found.findings, prototype.prior) for make in (plain_model, extended_model)]
    gaps = channel_gaps([confirm], prototype, *models)
    assert gaps[Channel.KINEMATIC].closed > 0.98
    assert gaps[Channel.DYNAMIC].closed > 0.98
    values = np.array([plain_truth[name] for name in PARAMETER_NAMES])
    spring = make_effect(EffectName.ELASTICITY, "drive_fl", {"compliance": 5e-4})
    true = ExtendedModel(Parameters(values, np.zeros_like(values)), (spring,))
    outcome = channel_gaps([confirm], prototype, models[0], true)[Channel.OUTCOME]
    assert gaps[Channel.OUTCOME].closed > outcome.closed > 0
