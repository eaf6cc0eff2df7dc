"""Records of a perfect vehicle, flawed by hand: nothing here comes from the candidates' formulas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.gap.vehicle.ideal import FOUR, Drive, ideal_record
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription, load_vehicle

Array = NDArray[np.float64]
Flaw = Callable[[Segment], Segment]


@pytest.fixture(scope="session")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


def with_torques(segment: Segment, change: Array) -> Segment:
    return replace(segment, motor_torques=segment.motor_torques + change)


def rate(values: Array, segment: Segment) -> Array:
    return np.gradient(values, segment.sample_time, axis=0)


def noisy(record: Record, seed: int, load: float = 0.01) -> Record:
    """Torques under slow changes of the load (0.1 s), shared by the motors as the load itself is, and reading noise.

    Args:
        record: without noise.
        seed: of the noise.
        load: rms of the changes [Nm at the shafts].
    """
    generator = np.random.default_rng(seed)
    segments = []
    for segment in record.segments:
        memory = np.exp(-segment.sample_time / 0.1)
        slow = signal.lfilter([np.sqrt(1 - memory**2)], [1, -memory], generator.normal(size=len(segment)))
        shared = np.linalg.svd(segment.motor_torques, full_matrices=False)[2][0]
        reading = 0.002 * generator.normal(size=segment.motor_torques.shape)
        segments.append(with_torques(segment, 2 * load * slow[:, None] * shared + reading))
    return replace(record, segments=segments)


def flawed(record: Record, flaw: Flaw) -> Record:
    return replace(record, segments=[flaw(segment) for segment in record.segments])


@pytest.fixture(scope="session")
def drives() -> Callable[..., tuple[Record, Record]]:
    """A noisy record to fit and one to confirm, of another excitation and other noise, both with the flaw."""

    def make(vehicle: VehicleDescription, flaw: Flaw, extra: tuple[Drive, ...] = ()) -> tuple[Record, Record]:
        return tuple(  # type: ignore[return-value]
            replace(noisy(flawed(ideal_record([*FOUR, *extra], vehicle, seed), flaw), 10 + seed), source=f"run {seed}")
            for seed in (1, 2)
        )

    return make
