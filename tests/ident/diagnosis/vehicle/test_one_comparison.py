"""The posterior names flaws of a vehicle that nothing of its candidates has made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.experiment.ideal import Drive
from ident.effects.extended import ExtendedModel
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription
from tests.ident.diagnosis.vehicle.flaws import rippled, rippled_alike, sticky

Drives = Callable[..., tuple[Record, Record]]

SLOWLY = (Drive(Step.STEERING_RIGHT, "slow"),)
"""Amplitude and speed of a Stribeck friction trade: the four steps alone tell each to a fifth."""


def plain(segment: Segment, vehicle: VehicleDescription) -> Segment:
    del vehicle
    return segment


def judged(drives: Drives, flaw: Callable[..., Segment], vehicle: VehicleDescription) -> Findings:
    fit, confirm = drives(vehicle, lambda segment: flaw(segment, vehicle), SLOWLY)
    model = ExtendedModel(replace(vehicle.prior, std=0.005 * vehicle.prior.values))
    return diagnose_vehicle([fit], [confirm], vehicle, model).findings


@pytest.mark.parametrize(
    ("flaw", "key", "sizes"),
    [
        (partial(sticky, friction=3.0, fall=0.25), "stribeck@steering_right", (3.0, 0.25)),
        (partial(rippled, amplitude=0.1), "torque_ripple@drive_fr", (0.1, 2.0, 0.4)),
        (partial(rippled_alike, amplitude=0.05), "torque_ripple@drives", (0.05, 2.0, 0.4)),
    ],
)
def test_a_flaw_is_named_with_its_size(
    flaw: Callable[..., Segment],
    key: str,
    sizes: tuple[float, ...],
    drives: Drives,
    prototype: VehicleDescription,
) -> None:
    findings = judged(drives, flaw, prototype)
    (cause,) = findings.causes
    assert cause.candidate.key == key
    assert cause.part.values == pytest.approx(sizes, rel=0.1)
    assert cause.closed > 0.7


def test_the_model_itself_lacks_nothing(drives: Drives, prototype: VehicleDescription) -> None:
    assert judged(drives, plain, prototype).verdict is Verdict.NONE
