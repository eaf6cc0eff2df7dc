"""Rows by way of means are those of the filter that passes every sample."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.vehicle.causes.coarse import Coarse
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.diagnosis.vehicle.records.sources import processing_of, sources_of
from ident.estimate.filters import zero_phase
from ident.records.record import FOUR_STEPS
from ident.vehicle.description import VehicleDescription


@pytest.mark.parametrize("cutoff", [15.0, 40.0])
@pytest.mark.parametrize(("jumping", "missed"), [(False, 1e-3), (True, 4e-3)])
def test_what_the_filter_lets_through_is_there_to_a_thousandth_and_a_jump_to_four(
    prototype: VehicleDescription, cutoff: float, jumping: bool, missed: float
) -> None:
    record = ideal_record(FOUR, prototype)
    source = sources_of(record, prototype.geometry, FOUR_STEPS, processing_of([record]))[0]
    time = np.arange(len(source.inputs)) * source.sample_time
    waves = np.sin(np.multiply.outer(time, np.array([1.0, 7.0, 20.0, 40.0])) + 0.3)
    turning = np.sin(3 * time)
    factor = 1.0 + 0.5 * (np.sign(turning) if jumping else turning)
    expected = zero_phase(factor[:, None] * waves, cutoff, source.sample_time)[:: source.factor]
    found = Coarse(source, cutoff).rows([(0.25 * factor, waves), (0.75 * factor, waves)])
    inside = slice(len(found) // 10, -len(found) // 10)
    assert found[inside] == pytest.approx(expected[inside], abs=missed)
