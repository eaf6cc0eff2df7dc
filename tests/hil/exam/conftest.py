"""A table of sizes, cases drawn from it, and answers to them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hil.exam.cases import Case, Composition, draw_cases
from hil.exam.scoring import Answer
from hil.exam.sizes import SizeTable, load_sizes


@pytest.fixture(scope="session")
def table() -> SizeTable:
    return load_sizes()


@pytest.fixture(scope="session")
def cases(table: SizeTable) -> list[Case]:
    return draw_cases(table, Composition(), 500_001, np.random.default_rng(5))


@pytest.fixture(scope="session")
def truthful() -> Callable[[Case], Answer]:
    """The answer of someone who knows."""

    def answer(case: Case) -> Answer:
        known = case.kind in ("effect", "pair")
        effects = tuple(
            {
                "name": effect.name,
                "where": effect.where,
                "parameters": {effect.parameter: {"value": effect.size * 1.01, "std": abs(effect.size) * 0.02}},
                "probability": 0.98,
                "ambiguity_set": [effect.name],
                "gap_closed_held_out": 0.95,
            }
            for effect in case.effects
            if known
        )
        verdict = "effect" if known else "unknown" if case.kind == "unknown" else "none"
        invisible = tuple(effect.name for effect in case.effects if case.kind == "invisible")
        return Answer(case, verdict, effects, invisible, 0.95, 3.0)

    return answer
