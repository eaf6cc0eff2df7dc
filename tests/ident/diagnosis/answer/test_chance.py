"""Whether something repeats or is noise: a few rows seldom say so by chance, and many say it where it is there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.judge import judge
from ident.diagnosis.diagnosis import Verdict


def _wave(length: int, samples: int, size: float) -> NDArray[np.float64]:
    return np.asarray(size * np.sqrt(2) * np.sin(np.arange(length) % samples * 0.7))


def test_noise_in_a_handful_of_rows_is_nothing_unknown(world: type[Any]) -> None:
    def verdict(seed: int) -> Verdict:
        made = world(seed=seed, repeats=2, samples=40)
        return judge(made.problem(0), made.problem(1), seed=1).verdict

    assert sum(verdict(seed) is not Verdict.NONE for seed in range(40)) <= 2


def test_what_repeats_in_many_rows_without_a_name_is_unknown(world: type[Any]) -> None:
    made = world(seed=3, repeats=2)
    problems = [made.problem(part) for part in (0, 1)]
    for problem in problems:
        for block in problem.blocks:
            block.target[:] += _wave(len(block.target), made.samples, 0.7)
    assert judge(*problems, seed=1).verdict is Verdict.UNKNOWN
