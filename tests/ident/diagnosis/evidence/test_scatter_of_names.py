"""Noise is what it is said to be: along every name of a world without any, chance has a square of one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from examples.scatter_along_names import report, told_by
from ident.diagnosis.search.asked import asked_of


def test_of_a_world_of_white_noise_the_report_says_so(world: type[Any]) -> None:
    worlds = [world(seed=seed) for seed in range(12)]
    told = [one for each in worlds for one in told_by(asked_of((each.problem(0), each.problem(1))))]
    assert np.mean([one.square for one in told]) == pytest.approx(1.0, abs=0.35)
    assert next(report(told)).startswith(f"forces: {len(told)} squares, mean ")
