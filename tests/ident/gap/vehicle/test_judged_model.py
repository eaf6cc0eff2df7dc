"""What a model must be to be judged."""

from __future__ import annotations

import pytest

from ident.errors import DataFileError
from ident.gap.vehicle.diagnose import diagnose_vehicle
from ident.gap.vehicle.ideal import FOUR, ideal_record
from ident.vehicle.description import load_vehicle


def test_a_value_of_zero_has_no_relative_change_and_is_refused() -> None:
    vehicle = load_vehicle("prototype")
    record = ideal_record(FOUR, vehicle)
    with pytest.raises(DataFileError, match="d_vl of the model is zero"):
        diagnose_vehicle([record], [], vehicle, vehicle.prior.replaced(d_vl=0.0))
