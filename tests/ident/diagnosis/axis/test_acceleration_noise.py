"""What the noise of an acceleration may bring as evidence is exceeded by one record in twenty."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.axis.acceleration_noise import AccelerationNoise, acceleration_noise, at_most
from ident.diagnosis.observations.rows import ROWS_PER_CUTOFF
from ident.records.axis_record import AxisKind, AxisRecord, AxisSignals

DT, DURATION, INERTIA = 0.01, 60.0, 20.0
POSITION_NOISE, EFFORT_NOISE = 1e-5, 2.0


def noise_of(seed: int) -> AccelerationNoise:
    """Of an axis of which nothing but noise was measured."""
    generator = np.random.default_rng(seed)
    time = np.arange(0, DURATION, DT)
    position, effort = (size * generator.normal(size=len(time)) for size in (POSITION_NOISE, EFFORT_NOISE))
    axis = AxisSignals("", AxisKind.LINEAR, position, effort)
    record = AxisRecord((axis,), DT, time, np.full(len(time), -1))
    return acceleration_noise(record, axis, INERTIA, left=2 * EFFORT_NOISE**2 * DT, moving=1.0)


def evidence(generator: np.random.Generator, ratio: np.ndarray) -> float:
    """Log likelihood ratio of rows without a noise of so many times the power of the rest to rows with it."""
    own, added = (
        size * (generator.normal(size=len(ratio)) + 1j * generator.normal(size=len(ratio))) / np.sqrt(2)
        for size in (np.ones(len(ratio)), np.sqrt(ratio))
    )
    before, after = np.abs(own + added) ** 2 / (1 + ratio), np.abs(own) ** 2
    return float(np.sum(np.log1p(ratio) + before - after))


@pytest.mark.parametrize(("hertz", "records"), [(6.0, 1), (8.0, 1), (10.0, 1), (8.0, 6)])
def test_one_set_of_records_in_twenty_brings_more_than_is_asked(hertz: float, records: int) -> None:
    noise, generator = noise_of(1), np.random.default_rng(1)
    shown = noise.frequency <= ROWS_PER_CUTOFF / 2 * hertz
    ratio = np.tile(np.expm1(np.diff(noise.gained[shown], prepend=0.0)), records)
    brought = np.array([evidence(generator, ratio) for _ in range(4000)])
    assert np.mean(brought > at_most([noise] * records, 2 * np.pi * hertz)) == pytest.approx(0.05, abs=0.015)
    assert np.mean(brought) == pytest.approx(records * noise.gained[shown][-1], rel=0.02)


def test_the_noise_of_an_acceleration_grows_with_the_fourth_power_of_the_frequency() -> None:
    noise = noise_of(1)
    ratio = np.expm1(np.diff(noise.gained, prepend=0.0))
    at = np.searchsorted(noise.frequency, [10.0, 20.0])
    assert ratio[at[1]] / ratio[at[0]] == pytest.approx(16.0)
    truth = (INERTIA * POSITION_NOISE * (2 * np.pi * 10.0) ** 2 / EFFORT_NOISE) ** 2
    assert ratio[at[0]] == pytest.approx(truth, rel=0.3)
