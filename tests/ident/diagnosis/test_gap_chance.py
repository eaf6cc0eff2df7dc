"""Whether something repeats or is noise: as often by chance as stated, and seldom missed where it is there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.chance import chances
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.judge import judge
from ident.diagnosis.limits import Limits
from ident.diagnosis.remainder import noise_floors
from ident.diagnosis.rows import make_rows

TRUE = np.array([1.0, -2.0, 0.5])


def stated(world: Any, repeated: float = 0.0) -> list[float]:
    """Chances of both coordinates, in which something repeats that is so many times the noise."""
    problems = [world.problem(part) for part in (0, 1)]
    rows = make_rows(*problems)
    models = [block.baseline @ TRUE - _wave(len(block.target), world.samples, repeated) for block, _ in rows.blocks]
    floors = noise_floors(rows, models, np.zeros(len(rows)))
    return list(chances(rows, floors, models).values())


def _wave(length: int, samples: int, size: float) -> NDArray[np.float64]:
    return np.asarray(size * np.sqrt(2) * np.sin(np.arange(length) % samples * 0.7))


@pytest.mark.parametrize("repeats", [2, 4])
def test_noise_repeats_as_often_by_chance_as_is_stated(world: type[Any], repeats: int) -> None:
    """Of few rows with a memory: a tenth of them below a tenth, and hardly any below a thousandth."""
    found = [p for seed in range(200) for p in stated(world(seed=seed, repeats=repeats, samples=60))]
    assert 0.05 < np.mean(np.array(found) < 0.1) < 0.2
    assert np.mean(np.array(found) < 1e-3) < 0.01


def test_what_repeats_in_many_rows_is_no_chance(world: type[Any]) -> None:
    assert max(p for seed in range(10) for p in stated(world(seed=seed), repeated=0.5)) < 1e-6


def test_noise_in_a_handful_of_rows_is_nothing_unknown(world: type[Any]) -> None:
    """By its size alone it would be, every so often."""

    def unknown(seed: int, limits: Limits) -> bool:
        made = world(seed=seed, repeats=2, samples=40)
        findings = judge(made.problem(0), made.problem(1), seed=1, limits=limits)
        return not findings.causes and findings.verdict is Verdict.UNKNOWN

    by_size = [seed for seed in range(40) if unknown(seed, Limits(chance=np.inf))]
    assert len(by_size) >= 4
    assert sum(unknown(seed, Limits()) for seed in by_size) <= 2


def test_what_repeats_in_many_rows_without_a_name_is_unknown(world: type[Any]) -> None:
    made = world(seed=3, repeats=2)
    problems = [made.problem(part) for part in (0, 1)]
    for problem in problems:
        for block in problem.blocks:
            block.target[:] += _wave(len(block.target), made.samples, 0.7)
    assert judge(*problems, seed=1).verdict is Verdict.UNKNOWN
