"""How far the gap shrinks in all three channels, on what took no part in the fit: other records, a part of the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from ident.errors import RecordError
from ident.gap.diagnosis import Unseen
from ident.gap.findings import Findings
from ident.gap.split import FITTED, fitted_repeats
from ident.gap.vehicle.closing import compared, extended_model, plain_model
from ident.gap.vehicle.signals import SHORTEST
from ident.gap.vehicle.sources import DIAGNOSED
from ident.records.record import Record, Segment, Step, base_step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.effects import Effect


def unseen_gaps(
    findings: Findings,
    fit: Sequence[Record],
    confirm: Sequence[Record],
    vehicle: VehicleDescription,
    given: Sequence[Effect] = (),
) -> tuple[Unseen, ...]:
    """Gap by channel without and with the causes, both models fitted to `fit` alone, or to its fitted part.

    Empty where every step took part, or nothing moves in those that did not. Lane changes stand by themselves: nothing
    repeats in them, and in their curves wheels creep as no model here does.

    Args:
        findings: of the diagnosis.
        fit: records that it fitted.
        confirm: those that confirmed; none: the part of `fit` that did, and lane changes in it.
        vehicle: of the records.
        given: effects of the model that was judged.
    """
    plain = plain_model(findings, vehicle.prior, given=given, held_out=True)
    extended = extended_model(findings, vehicle.prior, given=given, held_out=True) if findings.causes else plain
    unseen = list(confirm) or [part for record in fit if (part := later_part(record)) is not None]
    # Simulating takes long: the fitted part is asked for the noise only where what is held out does not repeat.
    repeated = [] if confirm or all(_repeats(record) for record in unseen) else fit
    try:
        found = compared(unseen, vehicle, plain, extended, repeated=repeated)
    except RecordError:
        # Repeats may all be in the part that is fitted; the diagnosis, which has rows to confirm, stands without this.
        return ()
    return tuple(
        Unseen(name, str(channel), gap)
        for name, chosen in _CHOSEN.items()
        for channel, gap in found.gaps(chosen).items()
        if np.isfinite(gap.before)
    )


def _repeats(record: Record) -> bool:
    return all(len(segment.periods) >= 2 for segment in record.segments if _compared(segment.step))


def _compared(step: str) -> bool:
    return base_step(step) in DIAGNOSED


def _changes_lane(step: str) -> bool:
    return base_step(step) is Step.LANE_CHANGE


_CHOSEN: Final[Mapping[str, Callable[[str], bool]]] = MappingProxyType(
    {"repeated": lambda step: not _changes_lane(step), "lane_change": _changes_lane}
)


def later_part(record: Record) -> Record | None:
    """What a diagnosis of this record alone does not fit: lane changes, and the later repeats of all other steps."""
    parts = [part for segment in record.segments if (part := _later(segment)) is not None]
    return replace(record, segments=parts) if parts else None


def _later(segment: Segment) -> Segment | None:
    if _changes_lane(segment.step):
        return segment
    repeats = np.array(segment.periods)
    if len(repeats) >= 2:
        start = int(np.argmax(np.isin(segment.period, repeats[len(fitted_repeats(repeats)) :])))
    else:
        start = int(FITTED * len(segment))
    kept = slice(start, None)
    if len(segment) - start <= SHORTEST:
        return None
    return replace(
        segment,
        time=segment.time[kept],
        motor_torques=segment.motor_torques[kept],
        wheel_angles=segment.wheel_angles[kept],
        steering_angles=segment.steering_angles[kept],
        period=segment.period[kept],
        command_torques=None if segment.command_torques is None else segment.command_torques[kept],
        extra={name: values[kept] for name, values in segment.extra.items()},
    )
