"""What the tests of this suite share: the controller under test, on the bench, stepped every cycle."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from vehicle_controller import VehicleController

from hil.testing import World


@pytest.fixture
def controller(bench: World) -> Iterator[VehicleController]:
    controller = VehicleController(bench.bus, bench.clock, bench.network)
    controller.start()
    bench.every_cycle(controller.step)
    yield controller
    controller.close()


@pytest.fixture
def driving(bench: World, controller: VehicleController) -> VehicleController:
    """At 0.5 m/s, the wish renewed every cycle."""

    def step() -> None:
        controller.drive(0.5)
        controller.step()

    bench.every_cycle(step)
    bench.run(2.0)
    return controller
