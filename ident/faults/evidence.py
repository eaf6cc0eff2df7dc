"""How likely a record is: rolling and balance of forces together, with and without a fault."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.filters import Processing
from ident.faults.balance import UNMODELLED, Balance, Fit, balances_of, fit_balances
from ident.faults.channels import BETA
from ident.faults.hypothesis import Hypothesis, of_torques
from ident.faults.rolling import SLIDING, Rolling, rolling_of, rolls
from ident.records.record import Segment
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

TOLERANCE: Final = 3.0
"""A record fits where no step is further off than so many times what a sound vehicle may show."""

AS_IS: Final = np.eye(4)
"""Channels that nothing happened to."""


@dataclass(frozen=True)
class Evidence:
    """A smooth record and what is known of its vehicle.

    Attributes:
        segments: smooth and decimated.
        vehicle: geometry and priors.
    """

    segments: Sequence[Segment]
    vehicle: VehicleDescription

    @cached_property
    def rollings(self) -> list[Rolling]:
        """Of the segments on the floor."""
        return [rolling_of(segment, self.vehicle.geometry) for segment in self.segments if rolls(segment)]

    @cached_property
    def balances(self) -> list[Balance]:
        """Of the steps that the estimator knows."""
        return balances_of(self.segments, self.vehicle.geometry, Processing())

    @cached_property
    def rolling_loss(self) -> float:
        """Negative log likelihood of the encoders."""
        return sum(rolling.loss(AS_IS) for rolling in self.rollings)

    @cached_property
    def fit(self) -> Fit:
        """Of the torques as they are."""
        return self.fit_with(None)

    @property
    def loss(self) -> float:
        """Negative log likelihood of everything."""
        return self.rolling_loss + self.fit.loss

    @property
    def fits(self) -> bool:
        """Whether everything is as a sound vehicle may be."""
        slid = max((rolling.misfit(AS_IS) * min(rolling.weight, 1.0) for rolling in self.rollings), default=0.0)
        posture = max((rolling.posture for rolling in self.rollings), default=0.0)
        limits = TOLERANCE * SLIDING, 1.0, TOLERANCE * UNMODELLED
        return slid <= limits[0] ** 2 and posture <= limits[1] and self.fit.misfit <= limits[2]

    def fit_with(self, hypothesis: Hypothesis | None) -> Fit:
        """Fit of the torques with a fault of theirs, or of time, undone."""
        mixings = [AS_IS if hypothesis is None else hypothesis.mixing(balance.step) for balance in self.balances]
        stretch = hypothesis.value if hypothesis is not None and hypothesis.place is None else 1.0
        return fit_balances(self.balances, self.vehicle.prior, mixings, stretch=stretch)

    def rolling_with(self, hypothesis: Hypothesis) -> float:
        """Loss of the encoders with a fault of the wheels undone."""
        return sum(rolling.loss(hypothesis.mixing(rolling.step)) for rolling in self.rollings)

    def without(self, hypothesis: Hypothesis) -> Evidence:
        """The record with a fault undone."""
        after = Evidence(hypothesis.undone(self.segments), self.vehicle)
        if of_torques(hypothesis):
            after.__dict__["rollings"] = self.rollings
        return after

    def loss_without(self, hypothesis: Hypothesis) -> float:
        """Loss with a fault undone."""
        if hypothesis.place is None or of_torques(hypothesis):
            return self.rolling_loss + self.fit_with(hypothesis).loss
        after = self.without(hypothesis)
        kept = {(balance.step, balance.coordinate) for balance in after.balances}
        stopped = [each for each in self.balances if (each.step, each.coordinate) not in kept]
        # What no longer moves explains nothing of its torques.
        return after.loss + sum(each.weight / 2 * math.log1p(1 / UNMODELLED**2) for each in stopped)

    def partial_loss(self, hypothesis: Hypothesis) -> float:
        """The same, of wheels and steering by the encoders alone, where their faults show."""
        if hypothesis.place is None or of_torques(hypothesis):
            return self.loss_without(hypothesis)
        if hypothesis.place.group is BETA:
            return self.rolling_with(hypothesis) + self.fit.loss
        geometry = self.vehicle.geometry
        touched = [rolls(segment) and hypothesis.holds_in(segment.step) for segment in self.segments]
        changed = [segment for segment, touch in zip(self.segments, touched, strict=True) if touch]
        kept = sum(rolling.loss(AS_IS) for rolling in self.rollings if not hypothesis.holds_in(rolling.step))
        undone = hypothesis.undone(changed)
        return kept + sum(rolling_of(segment, geometry).loss(AS_IS) for segment in undone) + self.fit.loss
