"""Campaigns of the independent vehicle: the plan, the references and the controller of a campaign, all steps side by
side, each from wheels that an alignment has left a little askew."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hil.exam.sources.independent import Plant
from hil.exam.sources.lacking import Built
from hil.exam.sources.recording import run
from ident.campaign.controller import Controller
from ident.campaign.plan import Plan
from ident.campaign.reference import Reference, sample_times
from ident.effects import Effect
from ident.records.record import Record, Segment

Array = NDArray[np.float64]

TURNED, APART = 5e-5, 2e-5
"""Rms of what alignments leave of the steering angles: of both sides together, and of their difference [rad]."""

SOURCE = "record"


def drive_campaign(plan: Plan, seed: int, effects: Sequence[Effect], noise: float = 1.0) -> Record:
    """Record of a plan driven by the independent vehicle.

    Args:
        plan: the campaign.
        seed: of everything random.
        effects: that the vehicle has.
        noise: factor on everything random.

    Raises:
        UserError: the vehicle cannot have the effects, or leaves its reference.
    """
    built, generator = Built().having(list(effects)), np.random.default_rng(seed)
    references = [plan.reference(step, plan.vehicle.prior) for step in plan.steps]
    askew = noise * np.stack([_askew(generator) for _ in references])
    start = np.stack([plan.posture(step) for step in plan.steps]) + askew - np.array(built.flaws.offset)
    plant = Plant(built.truth, plan.vehicle, start)
    drivers = [_Driver(plan, reference) for reference in references]

    def follow(sample: int, motors: Array, steering: Array) -> Array:
        pairs = zip(drivers, motors.tolist(), steering.tolist(), strict=True)
        return np.array([driver.torques(sample, *angles) for driver, *angles in pairs])

    samples = max(map(len, references))
    signals = run(plant, built.flaws, follow, samples, generator, noise)
    return Record(
        [
            _segment(reference, plan.cycle, *(series[: len(reference), index] for series in vars(signals).values()))
            for index, reference in enumerate(references)
        ],
        SOURCE,
    )


def _askew(generator: np.random.Generator) -> Array:
    turned, apart = generator.normal(size=2) * (TURNED, APART)
    return np.array([turned + apart / 2, turned - apart / 2])


class _Driver:
    """The controller of one step, at rest after its end."""

    def __init__(self, plan: Plan, reference: Reference) -> None:
        limits = plan.vehicle.limits
        self._length = len(reference)
        self._controller = Controller(
            reference,
            plan.designs,
            plan.limits,
            gear_ratio=plan.vehicle.geometry.gear_ratio,
            peak_torque=limits.peak_torque,
        )

    def torques(self, sample: int, motors: Sequence[float], steering: Sequence[float]) -> list[float]:
        if sample >= self._length:
            return [0.0] * 4
        return self._controller.torques(sample, motors, steering)


def _segment(reference: Reference, cycle: float, torques: Array, motors: Array, steering: Array) -> Segment:
    time = sample_times(len(reference), cycle)
    return Segment(reference.step, cycle, time, torques, motors, steering, reference.period)
