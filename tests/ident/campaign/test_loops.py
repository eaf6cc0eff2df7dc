"""Margins recomputed on the frequency response of what is promised, by a search of its own."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import pytest
from scipy import optimize

from ident.campaign.axis import Axis, axis_of
from ident.campaign.loops import (
    CURRENT_LOOP,
    HOLD_CYCLES,
    SLIPPING_MARGIN,
    STEERING_RATE_CYCLES,
    VELOCITY_MARGIN,
    LoopDesign,
    design_loop,
)
from ident.campaign.steps import EXCITATIONS
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription

CYCLE = 0.002
Response = Callable[[float], complex]
steps = pytest.mark.parametrize("step", list(EXCITATIONS))


def rate_cycles(step: Step) -> int:
    return STEERING_RATE_CYCLES if EXCITATIONS[step].coordinate.startswith("alpha") else 1


def velocity_response(design: LoopDesign, axis: Axis, inertia: float, cycles: int) -> Response:
    """(K + K_i/s) e^(-sT) / (1 + s/w_c) / (J s + D)."""
    dead_time = (HOLD_CYCLES + cycles / 2) * CYCLE

    def response(omega: float) -> complex:
        s = 1j * omega
        controller = design.velocity_gain + design.integral_gain / s
        return controller * cmath.exp(-s * dead_time) / (1 + s / CURRENT_LOOP) / (inertia * s + axis.viscous)

    return response


def position_response(design: LoopDesign, velocity: Response) -> Response:
    return lambda omega: design.position_gain / (1j * omega) * velocity(omega) / (1 + velocity(omega))


def crossover(response: Response) -> float:
    return math.exp(optimize.brentq(lambda x: math.log(abs(response(math.exp(x)))), math.log(0.05), math.log(400)))


def phase_margin(response: Response) -> float:
    return math.degrees(cmath.phase(-response(crossover(response))))


def gain_margin(response: Response) -> float:
    """At the first frequency beyond the crossover where the response is real and negative."""
    omega = crossover(response)
    while cmath.phase(-response(omega)) > 0:
        omega *= 1.002
    return 1 / abs(response(omega))


@pytest.fixture(scope="module", params=list(EXCITATIONS), ids=str)
def loop(request: pytest.FixtureRequest, vehicle: VehicleDescription) -> tuple[LoopDesign, Axis, int]:
    axis = axis_of(EXCITATIONS[request.param], vehicle)
    cycles = rate_cycles(request.param)
    return design_loop(axis, CYCLE, cycles), axis, cycles


def test_the_margins_promised_are_those_of_the_loop_with_its_true_dead_time(
    loop: tuple[LoopDesign, Axis, int],
) -> None:
    design, axis, cycles = loop
    velocity = velocity_response(design, axis, axis.inertia, cycles)
    position = position_response(design, velocity)
    assert crossover(velocity) == pytest.approx(design.velocity_crossover, rel=5e-3)
    assert crossover(position) == pytest.approx(design.position_crossover, rel=5e-3)
    assert phase_margin(velocity) == pytest.approx(design.velocity_phase_margin, abs=0.5)
    assert phase_margin(position) == pytest.approx(design.position_phase_margin, abs=0.5)
    assert gain_margin(velocity) == pytest.approx(design.velocity_gain_margin, rel=0.02)
    assert gain_margin(position) == pytest.approx(design.position_gain_margin, rel=0.02)
    slipping = velocity_response(design, axis, axis.slipping_inertia, cycles)
    assert phase_margin(slipping) == pytest.approx(design.slipping_phase_margin, abs=1.0)


def test_every_loop_is_well_damped_and_stays_stable_when_the_wheels_slip(loop: tuple[LoopDesign, Axis, int]) -> None:
    design, axis, cycles = loop
    assert design.velocity_phase_margin >= math.degrees(VELOCITY_MARGIN) - 1.0
    assert design.position_phase_margin >= 60.0
    assert min(design.velocity_gain_margin, design.position_gain_margin) >= 2.0
    assert design.slipping_phase_margin >= math.degrees(SLIPPING_MARGIN) - 1.0
    assert gain_margin(velocity_response(design, axis, axis.slipping_inertia, cycles)) >= 1.5


def test_a_slower_bus_gives_a_slower_loop_of_the_same_margin(vehicle: VehicleDescription) -> None:
    axis = axis_of(EXCITATIONS[Step.WHEEL_LIFTED], vehicle)
    fast, slow = design_loop(axis, 0.002), design_loop(axis, 0.004)
    assert slow.velocity_crossover < 0.7 * fast.velocity_crossover
    assert slow.velocity_phase_margin == pytest.approx(fast.velocity_phase_margin, abs=2.0)
