"""A model whose values are judged: what it must be, and what is shown of a changed value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.vehicle.closing import extended_model, plain_model
from ident.diagnosis.vehicle.diagnose import VehicleDiagnosis, diagnose_vehicle
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.errors import DataFileError, RecordError
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.parameters import Parameters

CHANGE = 0.05
"""Of the dry friction of the wheels: the vehicle has more than the model says."""


def noisy(vehicle: VehicleDescription, seed: int) -> Record:
    generator = np.random.default_rng(seed)
    record = ideal_record(FOUR, vehicle, seed)
    segments = [
        replace(one, motor_torques=one.motor_torques + 0.01 * generator.normal(size=one.motor_torques.shape))
        for one in record.segments
    ]
    return Record(segments, f"seed {seed}")


@pytest.fixture(scope="module")
def vehicle() -> VehicleDescription:
    return load_vehicle("prototype")


@pytest.fixture(scope="module")
def model(vehicle: VehicleDescription) -> Parameters:
    """What a simulation might use."""
    values = vehicle.prior.replaced(d_cw=vehicle.prior["d_cw"] / (1 + CHANGE)).values
    return Parameters(values, 2e-3 * np.abs(values))


@pytest.fixture(scope="module")
def found(vehicle: VehicleDescription, model: Parameters) -> VehicleDiagnosis:
    return diagnose_vehicle([noisy(vehicle, 1)], [noisy(vehicle, 2)], vehicle, model)


def test_a_value_of_zero_has_no_relative_change_and_is_refused(vehicle: VehicleDescription) -> None:
    record = ideal_record(FOUR, vehicle)
    with pytest.raises(DataFileError, match="d_vl of the model is zero"):
        diagnose_vehicle([record], [], vehicle, vehicle.prior.replaced(d_vl=0.0))


def test_a_record_without_torques_is_refused(vehicle: VehicleDescription) -> None:
    record = ideal_record(FOUR, vehicle)
    segments = [replace(one, motor_torques=np.zeros_like(one.motor_torques)) for one in record.segments]
    with pytest.raises(RecordError, match="no motor torque ever changes"):
        diagnose_vehicle([record], [Record(segments, "silent")], vehicle)


@pytest.mark.slow
def test_a_changed_value_is_named_with_its_size(found: VehicleDiagnosis) -> None:
    (effect,) = found.diagnosis.effects
    assert (effect.name, effect.where) == ("parameter_change", "d_cw")
    assert effect.parameters["change"].value == pytest.approx(CHANGE, abs=0.01)


@pytest.mark.slow
def test_the_gap_shown_is_that_of_the_model_that_was_given(found: VehicleDiagnosis, model: Parameters) -> None:
    assert plain_model(found.findings, model).parameters.values == pytest.approx(model.values)
    where = found.diagnosis.where[0]
    assert where.step in ("straight", "rotation")
    assert max(found.findings.repeated_before.values()) > 3 * max(found.findings.repeated_after.values())


@pytest.mark.slow
def test_a_changed_value_is_in_the_extended_model_once(found: VehicleDiagnosis, vehicle: VehicleDescription) -> None:
    extended = extended_model(found.findings, vehicle.prior)
    (change,) = extended.effects
    assert extended.parameters["d_cw"] * (1 + change.size) == pytest.approx(vehicle.prior["d_cw"], rel=0.01)
