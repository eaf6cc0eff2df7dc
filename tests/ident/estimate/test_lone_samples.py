"""A sample that was damaged is refused, or too small to change a parameter by more than its interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.estimate.identify import identify
from ident.records.record import Record, Segment, make_segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

TORQUE_NOISE, WHEEL_NOISE, STEERING_NOISE = 0.01, 3e-6, 2e-5
"""[Nm], [rad], [rad]; of the size of the prototype's drives and encoders."""
CHANNELS = ("motor_torques", "wheel_angles", "steering_angles")


@pytest.fixture(scope="module")
def noisy(record_of: Callable[..., Record], vehicle: VehicleDescription, truth: Parameters) -> Record:
    rng = np.random.default_rng(5)

    def with_noise(segment: Segment) -> Segment:
        noise = {
            name: getattr(segment, name) + size * rng.normal(size=getattr(segment, name).shape)
            for name, size in zip(CHANNELS, (TORQUE_NOISE, WHEEL_NOISE, STEERING_NOISE), strict=True)
        }
        return make_segment(replace(segment, **noise), "noisy")

    return Record([with_noise(segment) for segment in record_of(vehicle, truth).segments], "noisy")


def damaged(record: Record, segment: int, name: str, sample: int, column: int, size: float) -> Record:
    """One sample off by `size`; refused by an error, or as it would be identified."""
    part = record.segments[segment]
    values = getattr(part, name).copy()
    values[sample, column] += size
    parts = list(record.segments)
    parts[segment] = make_segment(replace(part, **{name: values}), "damaged")
    return replace(record, segments=parts)


def largest_accepted(record: Record, segment: int, name: str, sample: int, column: int) -> Record:
    """The record with the largest damage at that place that is not refused, within 5 %."""
    accepted, size = record, 1e-7
    while size < 10.0:
        try:
            accepted = damaged(record, segment, name, sample, column, size)
        except RecordError:
            break
        size *= 1.05
    return accepted


def assert_unharmed(record: Record, places: int, seed: int, vehicle: VehicleDescription, truth: Parameters) -> None:
    rng = np.random.default_rng(seed)
    sound = identify(record, vehicle.geometry)
    for _ in range(places):
        segment = int(rng.integers(len(record.segments)))
        sample = int(rng.choice([0, -1, rng.integers(len(record.segments[segment]))], p=[0.25, 0.25, 0.5]))
        name = CHANNELS[int(rng.integers(3))]
        column = int(rng.integers(getattr(record.segments[segment], name).shape[1]))
        found = identify(largest_accepted(record, segment, name, sample, column), vehicle.geometry)
        std = np.array([estimate.std for estimate in found.estimates])
        place = (segment, sample, name, column)
        assert np.max(np.abs(found.values - sound.values) / std) < 1.0, place
        assert np.max(np.abs(found.values - truth.values) / std) < 4.0, place


def test_the_largest_damage_that_is_not_refused_leaves_the_parameters_within_their_intervals(
    noisy: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    assert_unharmed(noisy, 1, 1, vehicle, truth)


@pytest.mark.slow
def test_the_largest_damage_at_many_places_leaves_the_parameters_within_their_intervals(
    noisy: Record, vehicle: VehicleDescription, truth: Parameters
) -> None:
    assert_unharmed(noisy, 20, 2, vehicle, truth)


@pytest.mark.parametrize("name", CHANNELS)
def test_a_damaged_sample_is_named_by_channel_and_number(noisy: Record, name: str) -> None:
    channel = {"motor_torques": "torque_rl", "wheel_angles": "beta_rl", "steering_angles": "alpha_r"}[name]
    with pytest.raises(RecordError, match=f"channel {channel} at sample 1234 is .* no motion"):
        damaged(noisy, 3, name, 1234, 1, 0.5)


RNG = np.random.default_rng(0)
MOTIONS: dict[str, Array] = {
    "white noise": RNG.normal(size=100_000),
    "noise with rare large samples": RNG.standard_t(3, size=20_000),
    "steps": np.repeat([0.0, 1.0, -2.0, 5.0, 0.0], 400) + 1e-3 * RNG.normal(size=2000),
    "kinks": np.cumsum(np.repeat([0.0, 0.01, -0.02, 0.05, 0.0], 400)) + 1e-5 * RNG.normal(size=2000),
    "one impact that rings": np.concatenate([np.zeros(500), np.exp(-np.arange(500) / 4) * np.cos(2.0 * np.arange(500))])
    + 1e-3 * RNG.normal(size=1000),
    "rattling": np.where(RNG.random(3000) < 0.02, RNG.normal(size=3000), 1e-3 * RNG.normal(size=3000)),
    "rest, and counts that move by one": np.repeat([0.0, 1.0, 0.0, -1.0], 500),
    "a pulse of four samples": np.concatenate([np.zeros(300), np.full(4, 3.0), np.zeros(300)])
    + 1e-3 * RNG.normal(size=604),
    "nothing": np.zeros(100),
    "nothing asked for at first": np.concatenate([np.zeros(1), np.full(400, 2.0)]) + 1e-3 * RNG.normal(size=401),
}


@pytest.mark.parametrize("values", MOTIONS.values(), ids=MOTIONS)
def test_what_noise_forces_and_impacts_do_is_not_refused(values: Array) -> None:
    samples = len(values)
    time = 0.002 * np.arange(samples)
    still = np.zeros((samples, 4))
    torques = still + values[:, None]
    make_segment(Segment("straight", 0.0, time, torques, still, still[:, :2], np.full(samples, -1)), "sound")
