"""Accuracy and coverage over many seeds; each is a whole campaign, so these are slow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hil.bench.truth import truth_of
from hil.campaign.folder import Run
from hil.campaign.reading import read_run
from hil.campaign.study import TOLERANCES, Outcome, accuracy, coverage, outcome_of
from ident.campaign.steps import ORDER
from ident.estimate.identify import identify
from ident.records.record import Step

STEPS = tuple(step for step in ORDER if step is not Step.LATERAL)

pytestmark = pytest.mark.slow


def outcomes(drive: Callable[..., Run], folder: Path, vehicle: str, seeds: range) -> list[Outcome]:
    found = []
    for seed in seeds:
        run = drive(folder / str(seed), STEPS, vehicle=vehicle, seed=seed)
        found.append(outcome_of(seed, identify(read_run(run.folder.path), run.plan.vehicle.geometry)))
    return found


@pytest.mark.parametrize("vehicle", ["prototype", "compact"])
def test_twenty_seeds_keep_the_tolerances_and_the_intervals_their_word(
    drive: Callable[..., Run], tmp_path: Path, vehicle: str
) -> None:
    rows = accuracy(outcomes(drive, tmp_path, vehicle, range(1000, 1020)), truth_of(vehicle))
    for row in rows:
        assert row.median_error < TOLERANCES[row.name], row
        assert row.half_width <= TOLERANCES[row.name], row
    assert 0.92 <= coverage(rows) <= 0.98


def test_a_sample_of_seeds_keeps_the_tolerances(drive: Callable[..., Run], tmp_path: Path) -> None:
    rows = accuracy(outcomes(drive, tmp_path, "prototype", range(1020, 1023)), truth_of("prototype"))
    for row in rows:
        assert row.median_error < TOLERANCES[row.name], row
    assert coverage(rows) >= 0.8
