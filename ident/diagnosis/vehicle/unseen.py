"""How far the gap shrinks in all three channels, on what took no part in the fit: other records, a part of the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.diagnosis import Unseen
from ident.diagnosis.observations.split import guard_of, part_of
from ident.diagnosis.vehicle.closing import compared, extended_model, plain_model
from ident.diagnosis.vehicle.records.sources import Source
from ident.effects import Effect
from ident.estimate.filters import Processing
from ident.records.record import Record, Step, base_step
from ident.vehicle.description import VehicleDescription

REPEATED: Final = "repeated"
LANE_CHANGE: Final = "lane_change"
"""The steps that a diagnosis compares, and those in which nothing repeats."""


def unseen_gaps(
    findings: Findings,
    fit: Sequence[Record],
    confirm: Sequence[Record],
    vehicle: VehicleDescription,
    given: Sequence[Effect] = (),
) -> tuple[Unseen, ...]:
    """Gap by channel without and with the causes, both models fitted to `fit` alone, or to its fitted part.

    Channels are left out in which nothing repeats that would measure the noise. Lane changes stand by themselves:
    nothing repeats in them, and in their curves wheels creep as no model here does.

    Args:
        findings: of the diagnosis.
        fit: records that it fitted.
        confirm: those that confirmed; none: the part of `fit` that did, and lane changes in it.
        vehicle: of the records.
        given: effects of the model that was judged.

    Raises:
        RecordError: a record has no step that the model describes.
    """
    plain = plain_model(findings, vehicle.prior, given=given, held_out=True)
    extended = extended_model(findings, vehicle.prior, given=given, held_out=True) if findings.causes else plain
    part = None if confirm else later_part
    found = compared(confirm or fit, vehicle, plain, extended, part=part, repeated=fit)
    return tuple(
        Unseen(name, str(channel), gap)
        for name, chosen in _CHOSEN.items()
        for channel, gap in found.gaps(chosen).items()
        if np.isfinite(gap.before)
    )


def later_part(source: Source) -> Source:
    """What a diagnosis of one record alone does not fit: lane changes, and of all other steps the later repeats.

    The rows before that go on being simulated: what an effect remembers, and where the vehicle heads, is told by them.
    """
    if _changes_lane(source.step):
        return source
    guard = guard_of(Processing().cutoff, source.sample_time)
    parts = [part_of(moving, source.period, guard, confirming=True) for moving in source.moving]
    return replace(source, moving=tuple(moving for moving, _ in parts), period=parts[0][1])


def _changes_lane(step: str) -> bool:
    return base_step(step) is Step.LANE_CHANGE


_CHOSEN: Final[Mapping[str, Callable[[str], bool]]] = MappingProxyType(
    {REPEATED: lambda step: not _changes_lane(step), LANE_CHANGE: _changes_lane}
)
