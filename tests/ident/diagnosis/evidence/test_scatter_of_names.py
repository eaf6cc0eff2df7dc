"""Noise is what it is said to be: along every name of a world without any, chance has a square of one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from examples.scatter_along_names import report, told_by
from ident.diagnosis.search.asked import Asked, asked_of
from ident.errors import UserError


def asked_about(world: type[Any], **truth: Any) -> list[Asked]:
    """Of twelve worlds."""
    worlds = [world(seed=seed, **truth) for seed in range(12)]
    return [asked_of((one.problem(0), one.problem(1))) for one in worlds]


def test_of_a_world_of_white_noise_the_report_says_so(world: type[Any]) -> None:
    told = [one for asked in asked_about(world) for one in told_by(asked)]
    assert np.mean([one.square for one in told]) == pytest.approx(1.0, abs=0.35)
    assert next(report(told)).startswith(f"forces: {len(told)} squares, mean ")


def test_beside_what_is_there_the_other_names_have_the_squares_of_chance(world: type[Any]) -> None:
    worlds = asked_about(world, true={"a": 3.0})
    told = [one for asked in worlds for one in told_by(asked, ["a@place"])]
    assert np.mean([one.square for one in told]) == pytest.approx(1.0, abs=0.35)
    assert len(told) == 12 * 5
    assert max(one.square for asked in worlds for one in told_by(asked)) > 100


def test_what_is_there_and_no_candidate_is_refused(world: type[Any]) -> None:
    with pytest.raises(UserError, match="z@place does not show"):
        list(told_by(asked_about(world)[0], ["z@place"]))
