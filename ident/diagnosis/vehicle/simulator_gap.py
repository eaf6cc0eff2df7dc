"""By how much the gap of a simulator shrinks: two simulators against one record, in units of its noise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.diagnosis.diagnosis import Gap
from ident.diagnosis.vehicle.records.following import Difference


@dataclass(frozen=True, eq=False)
class StepGap:
    """Of one coordinate of one step.

    Attributes:
        step, coordinate, unit: which.
        gap: rms of what the simulators lack of the recorded torque, and of the noise, in that unit; a floor of NaN
            where the step does not repeat.
        share: of the power of the whole gap above the noise, before [-]; 0 where no noise is known.
        before, after: differences of its segments.
    """

    step: str
    coordinate: str
    unit: str
    gap: Gap
    share: float
    before: Sequence[Difference]
    after: Sequence[Difference]

    @property
    def repeats(self) -> bool:
        """Whether the record says how large its noise is."""
        return self.gap.floor > 0

    @property
    def in_noise(self) -> Gap:
        """The gap in units of the noise; NaN where it is not known."""
        floor = self.gap.floor
        return Gap(self.gap.before / floor, self.gap.after / floor, 1.0)

    @property
    def closed(self) -> float:
        """Share of what is above the noise that is gone; where no noise is known, as if there were none."""
        gap = self.gap
        return (gap if self.repeats else Gap(gap.before, gap.after, 0.0)).closed


@dataclass(frozen=True)
class SimulatorGap:
    """Of a record.

    Attributes:
        steps: one a step and coordinate, in the order driven.
        total: of all of them in units of the noise.
    """

    steps: Sequence[StepGap]
    total: Gap

    def as_json(self) -> dict[str, Any]:
        """Plain values, numbers that JSON can hold."""
        return {
            "total": _gap_json(self.total),
            "steps": [
                {
                    "step": one.step,
                    "coordinate": one.coordinate,
                    "unit": one.unit,
                    "share": _number(one.share),
                    **_gap_json(one.gap),
                    "closed": _number(one.closed),
                }
                for one in self.steps
            ],
        }


def simulator_gap(before: Sequence[Difference], after: Sequence[Difference]) -> SimulatorGap:
    """The gap of two simulators on the same record.

    Args:
        before, after: what they lack, in the same order.
    """
    floors = _floors(after)
    pairs: dict[tuple[str, str], list[tuple[Difference, Difference]]] = {}
    for first, second in zip(before, after, strict=True):
        pairs.setdefault((first.step, first.coordinate), []).append((first, second))
    gaps = {key: _gap(own, floors.get(key, math.nan)) for key, own in pairs.items()}
    powers = {key: _power(gaps[key], own) for key, own in pairs.items()}
    whole = sum(powers.values())
    steps = [
        StepGap(
            *key,
            own[0][0].unit,
            gaps[key],
            powers[key] / whole if whole > 0 else 0.0,
            [first for first, _ in own],
            [second for _, second in own],
        )
        for key, own in pairs.items()
    ]
    return SimulatorGap(steps, _total([(gaps[key], _samples(own)) for key, own in pairs.items()]))


def _floors(differences: Sequence[Difference]) -> Mapping[tuple[str, str], float]:
    """Rms of what differs between repeats, by step and coordinate, pooled over segments; none of what does not repeat.

    Another step does not say it: the load of a lane change's wheels is not that of driving straight.
    """
    pooled: dict[tuple[str, str], list[float]] = {}
    for one in differences:
        if len(one.off) > 1:
            variance = float(one.off.var(axis=0, ddof=1).mean())
            pooled.setdefault((one.step, one.coordinate), []).append(variance)
    return {key: math.sqrt(float(np.mean(variances))) for key, variances in pooled.items()}


def _gap(pairs: Sequence[tuple[Difference, Difference]], floor: float) -> Gap:
    first, second = (np.concatenate([one.off.ravel() for one in own]) for own in zip(*pairs, strict=True))
    return Gap(_rms(first), _rms(second), floor)


def _samples(pairs: Sequence[tuple[Difference, Difference]]) -> int:
    return sum(first.recorded.size for first, _ in pairs)


def _power(gap: Gap, pairs: Sequence[tuple[Difference, Difference]]) -> float:
    """Above the noise, in units of it, times samples."""
    if not gap.floor > 0:
        return 0.0
    return max(0.0, (gap.before / gap.floor) ** 2 - 1) * _samples(pairs)


def _total(gaps: Sequence[tuple[Gap, int]]) -> Gap:
    known = [(gap, samples) for gap, samples in gaps if gap.floor > 0]
    count = sum(samples for _, samples in known)
    if not count:
        return Gap(math.nan, math.nan, math.nan)
    before, after = (
        math.sqrt(sum(samples * (getattr(gap, name) / gap.floor) ** 2 for gap, samples in known) / count)
        for name in ("before", "after")
    )
    return Gap(before, after, 1.0)


def _rms(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _gap_json(gap: Gap) -> dict[str, float | None]:
    return {name: _number(getattr(gap, name)) for name in ("before", "after", "floor", "closed")}


def _number(value: float) -> float | None:
    """JSON has no NaN and no infinity."""
    return float(value) if math.isfinite(value) else None
