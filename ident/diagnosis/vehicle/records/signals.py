"""What the rows of a segment are made of: smoothed angles, their derivatives, torques, heading."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.inputs import INPUTS, SLICES
from ident.errors import RecordError
from ident.estimate.filters import FILTER_ORDER, SEVEN, Processing, smooth
from ident.plant import kinematics
from ident.records.record import Record, Segment
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

DECIMATED: Final = 8.0
"""Rows kept per period of the filter's cutoff: what it passes has died away at half of that rate."""

PASSED: Final = 0.95
"""Largest cutoff of the smoothing filter, in units of the Nyquist frequency."""

SHORTEST: Final = 6 * (FILTER_ORDER + 1)
"""Samples that a segment must have beyond; the filter continues its ends by half as many."""


@dataclass(frozen=True)
class Signals:
    """A segment, smoothed and differentiated, at its full rate.

    Attributes:
        segment: it comes from.
        record: name of its record, for messages.
        heading: (N,) γ by odometry, from the start of the record [rad].
        alpha, alpha_rate, alpha_acceleration: (N, 2).
        beta, beta_rate, beta_acceleration: (N, 4).
        torques: (N, 4) at the motor shafts, as reported [Nm].
    """

    segment: Segment
    record: str
    heading: Array
    alpha: Array
    alpha_rate: Array
    alpha_acceleration: Array
    beta: Array
    beta_rate: Array
    beta_acceleration: Array
    torques: Array

    def as_inputs(self) -> Array:
        """(N, INPUTS), the columns of `inputs.SLICES`, each in one piece of memory; couplings are not twisted."""
        inputs = np.zeros((len(self.heading), INPUTS), order="F")
        inputs[:, SLICES["heading"]] = self.heading[:, None]
        for name in ("alpha", "beta", "alpha_rate", "beta_rate", "alpha_acceleration", "beta_acceleration", "torques"):
            inputs[:, SLICES[name]] = getattr(self, name)
        inputs[:, SLICES["motor_acceleration"]] = self.beta_acceleration
        inputs[:, SLICES["payload"]] = self.segment.payload
        return inputs

    @property
    def joint_rates(self) -> Array:
        """α̇ and β̇ (N, 6), the rates q̇ from the fourth on [rad/s]."""
        return np.hstack([self.alpha_rate, self.beta_rate])


def signals_of(record: Record, geometry: Geometry, processing: Processing) -> list[Signals]:
    """Signals of all segments; the heading goes on from segment to segment.

    Raises:
        RecordError: a segment is sampled too slowly for the filters, or too short for them.
    """
    heading, found = 0.0, []
    for segment in record.segments:
        _refuse_unfilterable(segment, record.source, processing)
        signals = _signals(segment, record.source, processing)
        turned = _turned(signals, geometry)
        found.append(replace(signals, heading=heading + turned))
        heading += float(turned[-1])
    return found


def _refuse_unfilterable(segment: Segment, source: str, processing: Processing) -> None:
    limit = PASSED * np.pi / processing.signal_cutoff
    if segment.sample_time > limit:
        raise RecordError(
            f"{source}, step {segment.step} is sampled every {segment.sample_time * 1e3:.3g} ms, too slowly to tell "
            "friction from inertia where the motion reverses.",
            f"Record at least every {limit * 1e3:.3g} ms.",
        )
    if len(segment) <= SHORTEST:
        raise RecordError(
            f"{source}, step {segment.step} has {len(segment)} samples, too few for the filters.",
            "Cut it out of the record, or record more of it.",
        )


def _signals(segment: Segment, source: str, processing: Processing) -> Signals:
    dt = segment.sample_time
    alpha, beta = (smooth(angles, processing, dt, SEVEN) for angles in (segment.steering_angles, segment.wheel_angles))
    return Signals(
        segment=segment,
        record=source,
        heading=np.zeros(len(segment)),
        alpha=alpha.angles,
        alpha_rate=alpha.rates,
        alpha_acceleration=alpha.accelerations,
        beta=beta.angles,
        beta_rate=beta.rates,
        beta_acceleration=beta.accelerations,
        torques=segment.motor_torques,
    )


def _turned(signals: Signals, geometry: Geometry) -> Array:
    """Heading from the segment's start (N,) [rad]; a lifted vehicle does not turn."""
    if signals.segment.step.startswith("wheel_lifted"):
        return np.zeros(len(signals.segment))
    twist = kinematics.odometry(signals.alpha, signals.alpha_rate, signals.beta_rate, geometry)
    return kinematics.integrate_pose(twist, signals.segment.sample_time)[:, 2]


def decimation(segment: Segment, cutoff: float) -> int:
    """Every how manieth row is kept: the filter has left nothing between them, and periods stay aligned."""
    most = max(1, int(2 * np.pi / (cutoff * DECIMATED * segment.sample_time)))
    lengths = [int(np.sum(segment.period == number)) for number in segment.periods]
    starts = [int(np.argmax(segment.period == number)) for number in segment.periods]
    gaps = [*lengths, *np.diff(starts)]
    return next(factor for factor in range(most, 0, -1) if all(gap % factor == 0 for gap in gaps))


def shifted(values: Array, delay: float, sample_time: float) -> Array:
    """Values (N, ...) as they were `delay` [s] earlier, by linear interpolation; the ends are held."""
    time = np.arange(len(values)) * sample_time
    columns = np.atleast_2d(values.T)
    moved = np.stack([np.interp(time - delay, time, column) for column in columns], axis=1)
    return moved.reshape(values.shape)
