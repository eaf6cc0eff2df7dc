"""Hypotheses: a name, a place, a step, and how a record looks with the fault undone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.faults.channels import TORQUE, Place, whole
from ident.faults.fault import Fault, FaultName
from ident.records.record import Segment

Array = NDArray[np.float64]

TIME: Final = "time"
"""Channel that belongs to no group."""

FREE: Final[Mapping[FaultName, float]] = {FaultName.SCALED: 5.0, FaultName.LATE: 4.0}
"""What a free value costs, log of the range that it may have over the width in which it explains as much."""


@dataclass(frozen=True)
class Hypothesis:
    """What may be wrong.

    Attributes:
        name: of the fault.
        place: channels; None for time.
        step: it is confined to; empty for all.
        value: factor or lateness [s]; NaN where there is none.
        std: of the value.
    """

    name: FaultName
    place: Place | None
    step: str = ""
    value: float = math.nan
    std: float = math.nan

    @property
    def channel(self) -> str:
        """As faults name it."""
        if self.place is None:
            return TIME
        if self.name is FaultName.SWAPPED:
            return "/".join(self.place.group.members[column] for column in self.place.columns)
        return self.place.name

    @property
    def key(self) -> str:
        """As sets name it."""
        return f"{self.name}@{self.channel}" + (f" in {self.step}" if self.step else "")

    def holds_in(self, step: str) -> bool:
        """Whether it touches a step."""
        return self.step in ("", step)

    def mixing(self, step: str) -> Array:
        """True channels of its group over the recorded ones in a step, (n, n)."""
        if self.place is None:
            return np.eye(len(TORQUE.members))
        matrix = np.eye(len(self.place.group.members))
        if not self.holds_in(step):
            return matrix
        columns = list(self.place.columns)
        if self.name is FaultName.SWAPPED:
            matrix[columns] = matrix[columns[::-1]]
        elif self.name is FaultName.NEGATED:
            matrix[columns] *= -1
        elif self.name is FaultName.SCALED:
            matrix[columns] /= self.value
        return matrix

    def undone(self, segments: Sequence[Segment]) -> list[Segment]:
        """The segments as they would be without it."""
        return [self._undone(segment) if self.holds_in(segment.step) else segment for segment in segments]

    def _undone(self, segment: Segment) -> Segment:
        if self.place is None:
            time, interval = segment.time / self.value, segment.sample_time / self.value
            return replace(segment, time=time, sample_time=interval)
        if self.name is FaultName.LATE:
            return self.place.changed(segment, lambda values: _advanced(values, self.value / segment.sample_time))
        values: Array = getattr(segment, self.place.group.field) @ self.mixing(segment.step).T
        return whole(self.place.group).put(segment, values)

    def fault(self, evidence: float, fits: bool, also: Sequence[str]) -> Fault:
        """The fault that it is."""
        unit = {FaultName.SCALED: "1", FaultName.LATE: "s"}.get(self.name, "")
        return Fault(self.name, self.channel, self.value, unit, self.std, evidence, fits, tuple(also), self.step)


def of_torques(hypothesis: Hypothesis) -> bool:
    """Whether it leaves the motion alone."""
    return hypothesis.place is not None and hypothesis.place.group is TORQUE


def _advanced(values: Array, samples: float) -> Array:
    """Values (N, n) so many samples later, by straight lines; the ends repeat."""
    index = np.arange(len(values))
    return np.stack([np.interp(index + samples, index, column) for column in values.T], axis=1)
