"""The two short campaigns of an exam case: one to fit, and another to confirm."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from hil.campaign.folder import excitation_entry, excitation_of
from ident.campaign.plan import Plan, assemble_plan, make_plan
from ident.campaign.steps import EXCITATIONS, PERIODS, StepSpec
from ident.records.record import FOUR_STEPS, Step
from ident.vehicle.description import VehicleDescription


def _shortened(periods: Mapping[Step, float]) -> Mapping[str, StepSpec]:
    """The campaign's steps with other periods [s], four of each."""
    return MappingProxyType(
        {step: replace(EXCITATIONS[step], period=period, repeats=1.0) for step, period in periods.items()}
    )


FITTING: Final = _shortened({Step.STEERING_LEFT: 3.5, Step.STEERING_RIGHT: 3.5, Step.STRAIGHT: 5.5, Step.ROTATION: 5.5})
"""80 s with the standstill around the steps."""

CONFIRMING: Final = _shortened(
    {Step.STEERING_LEFT: 2.5, Step.STEERING_RIGHT: 2.5, Step.STRAIGHT: 4.25, Step.ROTATION: 4.25}
)
"""62 s."""


@dataclass(frozen=True)
class ExamPlans:
    """What a case of an exam drives.

    Attributes:
        fit: the campaign that the diagnosis fits.
        confirm: the campaign with another excitation, on which it has to hold.
    """

    fit: Plan
    confirm: Plan

    @property
    def driven(self) -> tuple[Plan, Plan]:
        """Both with a lane change at the end, which nothing is fitted to: what is found has to hold there too."""
        fit, confirm = (replace(plan, steps=(*plan.steps, Step.LANE_CHANGE)) for plan in (self.fit, self.confirm))
        return fit, confirm


def plans_text(plans: ExamPlans) -> str:
    """Both plans as JSON; all that the seed decides."""
    both = {"fit": plans.fit, "confirm": plans.confirm}
    return json.dumps(
        {
            name: {step: excitation_entry(excitation) for step, excitation in plan.excitations.items()}
            for name, plan in both.items()
        }
    )


def plans_from_text(text: str, vehicle: VehicleDescription, cycle: float) -> ExamPlans:
    """The plans of `plans_text` for a vehicle and a cycle T_s [s]."""
    document = json.loads(text)
    fit, confirm = (
        assemble_plan(
            vehicle,
            {Step(step): excitation_of(entry) for step, entry in document[name].items()},
            steps=FOUR_STEPS,
            periods=PERIODS,
            cycle=cycle,
            specs=specs,
        )
        for name, specs in (("fit", FITTING), ("confirm", CONFIRMING))
    )
    return ExamPlans(fit, confirm)


def plan_exam(vehicle: VehicleDescription, seed: int, cycle: float) -> ExamPlans:
    """Optimise both excitations.

    Args:
        vehicle: what is known of it.
        seed: of the random starts.
        cycle: T_s [s].
    """
    generators = [np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(2)]
    fit, confirm = (
        make_plan(vehicle, generator, steps=FOUR_STEPS, periods=PERIODS, cycle=cycle, specs=specs)
        for generator, specs in zip(generators, (FITTING, CONFIRMING), strict=True)
    )
    return ExamPlans(fit, confirm)
