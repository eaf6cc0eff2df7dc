"""Records of another vehicle are refused; a wheel that slides while its side steers is of this one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.vehicle.causes.belonging import refuse_other_vehicle
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.errors import RecordError
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription


def spun(vehicle: VehicleDescription, factors: tuple[float, ...]) -> Record:
    """A record in which the wheels (4,) roll so many times as far while the left side steers."""
    record = ideal_record(FOUR, vehicle)

    def changed(segment: Segment) -> Segment:
        if segment.step != Step.STEERING_LEFT:
            return segment
        return replace(segment, wheel_angles=segment.wheel_angles * np.array(factors))

    return replace(record, segments=[changed(segment) for segment in record.segments])


@pytest.mark.parametrize("factors", [(1.0, 1.0, 1.0, 1.0), (1.6, 1.0, 1.0, 1.0), (1.0, -0.5, 1.0, 1.0)])
def test_one_wheel_of_a_side_may_slide(factors: tuple[float, ...], prototype: VehicleDescription) -> None:
    refuse_other_vehicle([spun(prototype, factors)], prototype.geometry)


@pytest.mark.parametrize("factors", [(1.6, 1.6, 1.0, 1.0), (-1.0, -1.0, 1.0, 1.0), (0.5, 1.6, 1.0, 1.0)])
def test_a_vehicle_whose_wheels_both_roll_otherwise_is_another(
    factors: tuple[float, ...], prototype: VehicleDescription
) -> None:
    with pytest.raises(RecordError, match=r"step steering_left: its wheels roll .* rad per rad of steering"):
        refuse_other_vehicle([spun(prototype, factors)], prototype.geometry)
