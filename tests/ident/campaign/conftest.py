from __future__ import annotations

import numpy as np
import pytest

from ident.campaign.axis import axis_of
from ident.campaign.excitation import motion_basis, resting_projection, series_of
from ident.campaign.optimise import SAMPLES, Excitation, Problem, size_within_limits
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.reference import Reference
from ident.campaign.steps import EXCITATIONS, ORDER, PERIODS, StepSpec
from ident.estimate.filters import Processing
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription

CYCLE = 0.002


def problem_of(spec: StepSpec, vehicle: VehicleDescription) -> Problem:
    axis = axis_of(spec, vehicle)
    return Problem(spec, axis, vehicle.limits, vehicle.geometry.gear_ratio, vehicle.prior["m_ch"], Processing())


def random_excitation(spec: StepSpec, vehicle: VehicleDescription, generator: np.random.Generator) -> Excitation:
    """A random shape as large as the limits allow: what the optimiser starts from."""
    problem = problem_of(spec, vehicle)
    shape = resting_projection(spec.harmonics) @ generator.normal(size=2 * spec.harmonics)
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    position, velocity, acceleration = (b @ shape for b in motion_basis(time, spec.period, spec.harmonics))
    factor, binding = size_within_limits((position, velocity, acceleration), problem)
    return Excitation(series_of(factor * shape, spec.period), float("nan"), binding)


@pytest.fixture(scope="session")
def plan(vehicle: VehicleDescription) -> Plan:
    """A plan with random instead of optimised excitation, which takes no time."""
    generator = np.random.default_rng(0)
    excitations = {step: random_excitation(spec, vehicle, generator) for step, spec in EXCITATIONS.items()}
    return assemble_plan(vehicle, excitations, steps=ORDER, periods=PERIODS, cycle=CYCLE)


@pytest.fixture(scope="session")
def references(plan: Plan) -> dict[Step, Reference]:
    """The references of all its steps."""
    return {step: plan.reference(step, plan.vehicle.prior) for step in plan.steps}
