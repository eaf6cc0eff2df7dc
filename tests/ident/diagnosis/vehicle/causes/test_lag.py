"""How late torques act: what sampling may do, and what the model says of other records of the vehicle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.lag import LAG_NAME, LAG_STD
from ident.diagnosis.vehicle.diagnose import VehicleDiagnosis, diagnose_vehicle
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.effects.extended import ExtendedModel
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import Parameters

INTERVAL = 0.004
"""Of ideal records [s]."""
LATE = INTERVAL / 2
STD = 9e-5
"""Of what a campaign tells of it [s]."""
NAMES = (EffectName.TIME_DELAY, EffectName.TORQUE_BIAS, EffectName.STRIBECK)


def late_record(vehicle: VehicleDescription, seed: int, lag: float) -> Record:
    """Of a vehicle whose torques act later by `lag` [s] than they are written down."""
    generator = np.random.default_rng(seed)
    segments = [
        replace(
            one,
            motor_torques=CubicSpline(one.time, one.motor_torques)(one.time + lag)
            + 0.01 * generator.normal(size=one.motor_torques.shape),
        )
        for one in ideal_record(FOUR, vehicle, seed).segments
    ]
    return Record(segments, f"seed {seed}")


def stated(vehicle: VehicleDescription, lag: Lag | None) -> tuple[float, float]:
    """What the rows take for the lag and its standard deviation [samples]."""
    problem = build_problem([late_record(vehicle, 1, 0.0)], vehicle, vehicle.prior, lag=lag, effects=NAMES)
    assert problem.nominal is not None
    place = problem.names.index(LAG_NAME)
    return float(problem.nominal.values[place]), float(problem.nominal.std[place])


def judged(vehicle: VehicleDescription, actual: float, lag: Lag | None) -> VehicleDiagnosis:
    """The diagnosis of two records whose torques are late by `actual` [s]."""
    model = ExtendedModel(Parameters(vehicle.prior.values, 2e-3 * np.abs(vehicle.prior.values)), lag=lag)
    fit, confirm = ([late_record(vehicle, seed, actual)] for seed in (1, 2))
    return diagnose_vehicle(fit, confirm, vehicle, model, effects=NAMES)


def test_of_records_sampled_alike_the_model_says_it(prototype: VehicleDescription) -> None:
    assert stated(prototype, Lag(3e-4, STD, INTERVAL)) == pytest.approx((3e-4 / INTERVAL, STD / INTERVAL))


@pytest.mark.parametrize(
    "lag",
    [None, Lag(3e-4, STD, 2 * INTERVAL), Lag(2 * INTERVAL, STD, INTERVAL)],
    ids=["of no model", "of another rate", "longer than sampling"],
)
def test_else_it_is_what_sampling_may_do(prototype: VehicleDescription, lag: Lag | None) -> None:
    assert stated(prototype, lag) == (0.0, LAG_STD)


def test_torques_later_than_before_by_less_than_a_sample_are_found(prototype: VehicleDescription) -> None:
    """Half a sample, which sampling alone explains: unless it was not there when the model was identified."""
    found = judged(prototype, LATE, Lag(0.0, STD, INTERVAL))
    (cause,) = found.findings.causes
    assert cause.candidate.key == "time_delay@drives"
    assert cause.part.values[0] == pytest.approx(LATE, abs=3 * float(cause.part.std[0]) + STD)


@pytest.mark.parametrize("lag", [None, Lag(LATE, STD, INTERVAL)], ids=["not known", "as before"])
def test_what_sampling_explains_is_no_cause(prototype: VehicleDescription, lag: Lag | None) -> None:
    assert judged(prototype, LATE, lag).findings.verdict is Verdict.NONE
