"""The cutoff of the position filter lies between the motion of an axis and the noise of its position."""

import numpy as np
import pytest

from ident.estimate.axis.cutoff import position_cutoff
from ident.records.axis_record import AxisKind, AxisRecord, AxisSignals

_INTERVAL = 0.01
_DURATION = 30.0


def _record(position: np.ndarray) -> AxisRecord:
    time = np.arange(len(position)) * _INTERVAL
    axis = AxisSignals("", AxisKind.LINEAR, position, np.ones(len(position)))
    return AxisRecord((axis,), _INTERVAL, time, np.full(len(time), -1))


def _swept(lowest: float, highest: float) -> np.ndarray:
    """A sine of 5 mm swept from one frequency to another [Hz], read to 1 micrometre."""
    time = np.arange(0.0, _DURATION, _INTERVAL)
    phase = 2 * np.pi * (lowest * time + (highest - lowest) / (2 * _DURATION) * time**2)
    noise = np.random.default_rng(1).normal(scale=1e-6, size=len(time))
    return np.asarray(0.005 * np.sin(phase) + noise)


@pytest.mark.parametrize(("lowest", "highest"), [(0.1, 1.0), (0.5, 5.0), (3.0, 6.0)])
def test_a_motion_without_slow_parts_is_not_cut_off(lowest: float, highest: float) -> None:
    """Below the slowest oscillation there is as little acceleration as between motion and noise."""
    assert position_cutoff(_record(_swept(lowest, highest)), 1.0) > 2 * np.pi * highest
