"""What a diagnosis costs, in units of work done in the same run: machines differ, and differ from minute to minute."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
import pytest

from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.estimate.filters import zero_phase
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription

pytestmark = pytest.mark.bench

LIMIT = 120.0
"""A diagnosis may cost this many times the filtering of `CHANNELS` channels as long as the records, at `RATE`."""
CHANNELS = 40
RATE = 500.0


def cpu_seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def test_a_diagnosis_costs_at_most_filtering_forty_channels_of_the_records_120_times(
    prototype: VehicleDescription,
    drives: Callable[..., tuple[Record, Record]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    fit, confirm = drives(prototype, lambda segment: segment)
    seconds = sum(len(segment) * segment.sample_time for record in (fit, confirm) for segment in record.segments)
    noise = np.random.default_rng(1).normal(size=(round(seconds * RATE), CHANNELS))
    filtering = statistics.median(cpu_seconds(lambda: zero_phase(noise, 40.0, 1 / RATE)) for _ in range(5))
    diagnosis = cpu_seconds(lambda: diagnose_vehicle([fit], [confirm], prototype))
    with capsys.disabled():
        print(f"\n{seconds:.0f} s of records: diagnosis {diagnosis:.1f} s, {diagnosis / filtering:.0f} times filtering")
    assert diagnosis < LIMIT * filtering
