from __future__ import annotations

import pytest

from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.geometry import Geometry


@pytest.fixture(scope="session", params=["prototype", "compact"])
def vehicle(request: pytest.FixtureRequest) -> VehicleDescription:
    """Both shipped vehicles: their a/r differ, one above and one below 1."""
    return load_vehicle(request.param)


@pytest.fixture(scope="session")
def geometry(vehicle: VehicleDescription) -> Geometry:
    return vehicle.geometry
