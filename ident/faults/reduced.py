"""A record without what is too fast to matter, at a rate that this needs, so that hundreds of questions are cheap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.filters import zero_phase
from ident.records.record import Segment

Array = NDArray[np.float64]

CUTOFF: Final = 40.0
"""Of the filter [rad/s], as of the estimate."""

INTERVAL: Final = 0.01
"""Sample time that is left [s]: the filter leaves a thousandth at its Nyquist frequency."""

SHORTEST: Final = 20
"""Samples below which a segment tells nothing."""

MARGIN: Final = 0.8
"""Largest cutoff over the Nyquist frequency."""


def reduced(segments: Sequence[Segment]) -> list[tuple[Segment, Segment]]:
    """All segments that are long enough, each with itself filtered without phase and decimated."""
    pairs = [(segment, _reduced(segment)) for segment in segments if len(segment) > SHORTEST]
    return [(segment, small) for segment, small in pairs if len(small) > SHORTEST]


def _reduced(segment: Segment) -> Segment:
    dt = segment.sample_time
    factor = max(1, round(INTERVAL / dt))
    cutoff = min(CUTOFF, MARGIN * np.pi / dt)

    def smooth(values: Array) -> Array:
        return zero_phase(values, cutoff, dt)[::factor]

    return replace(
        segment,
        sample_time=factor * dt,
        time=segment.time[::factor],
        motor_torques=smooth(segment.motor_torques),
        wheel_angles=smooth(segment.wheel_angles),
        steering_angles=smooth(segment.steering_angles),
        period=segment.period[::factor],
        command_torques=None if segment.command_torques is None else smooth(segment.command_torques),
        extra={name: values[::factor] for name, values in segment.extra.items()},
    )
