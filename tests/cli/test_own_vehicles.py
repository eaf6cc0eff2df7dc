"""A vehicle that nobody here has seen, described by its measures alone, is rehearsed and identified."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.bench.truth import truth_of
from hil.campaign.folder import open_run
from hil.campaign.reading import read_run
from ident.estimate.identify import identify
from ident.vehicle.parameters import PARAMETER_NAMES

OF_THE_README = {
    "wheelbase": 1.6,
    "track_width": 1.0,
    "wheel_offset": 0.10,
    "wheel_radius": 0.15,
    "gear_ratio": 25.0,
    "mass": 1500.0,
    "rated_torque": 1.27,
}

SEEDS = (0, 1, 2, 3)
"""Of vehicles that are drawn; 0 is that of the README."""


def options(given: dict[str, float]) -> list[str]:
    """For the command line."""
    return [word for name, value in given.items() for word in (f"--{name.replace('_', '-')}", str(value))]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_an_own_vehicle_is_described_rehearsed_and_identified(
    quasi: Callable[..., Any], draw_measures: Callable[[int], dict[str, float]], tmp_path: Path, seed: int
) -> None:
    given = draw_measures(seed) if seed else OF_THE_README
    vehicle, run = tmp_path / "mine.toml", tmp_path / "run"
    assert quasi("init", vehicle, *options(given)).code == 0
    assert quasi("check", vehicle).code == 0
    assert quasi("campaign", "--vehicle", vehicle, "--out", run).code == 0
    assert quasi("check", run).code == 0
    result = identify(read_run(run), open_run(run).plan.vehicle.geometry)
    truth = truth_of(str(vehicle))
    errors = {one.name: (one.value - truth[one.name]) / one.std for one in result.estimates}
    assert errors.keys() == set(PARAMETER_NAMES)
    assert max(map(abs, errors.values())) < 4, errors
