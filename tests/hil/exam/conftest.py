"""A table of sizes, cases drawn from it, and answers to them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hil.exam.answers import Answer
from hil.exam.cases import Case, Kind
from hil.exam.drawing import Composition, draw_cases
from hil.exam.identity import Identity
from hil.exam.said import Alone, Said
from hil.exam.sizes import SizeTable, load_sizes
from hil.exam.worlds import world_of

PROTOTYPE = world_of("prototype", None)


@pytest.fixture(scope="session")
def table() -> SizeTable:
    return load_sizes(PROTOTYPE.sizes_file)


@pytest.fixture(scope="session")
def cases(table: SizeTable) -> list[Case]:
    return draw_cases(table, Composition(), lambda case: 500_001 + 2 * case, np.random.default_rng(5))


@pytest.fixture(scope="session")
def truthful() -> Callable[[Case], Answer]:
    """The answer of someone who knows, in a world where everything can be told apart."""

    def answer(case: Case) -> Answer:
        known = case.kind in (Kind.EFFECT, Kind.PAIR)
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
        if case.kind is Kind.LAW:
            effects = tuple(law_entry(effect.name, effect.where) for effect in case.effects)
        faults = tuple(frozenset({f"{one.name}@{one.where}"}) for one in case.effects if case.kind is Kind.FAULT)
        said = Said(
            verdict=VERDICTS[case.kind],
            effects=effects,
            invisible=tuple(effect.name for effect in case.effects if case.kind is Kind.INVISIBLE),
            closed=0.95,
            seconds=3.0,
            faults=faults,
            alone=(*(Alone(effect.name, 0.95, 0.95) for effect in case.effects), Alone("another", 0.05, 0.1)),
        )
        return Answer(case, said, tuple(identity_of(effect.name, effect.where) for effect in case.effects))

    return answer


VERDICTS = {
    Kind.EFFECT: "effect",
    Kind.PAIR: "effect",
    Kind.NONE: "none",
    Kind.INVISIBLE: "none",
    Kind.UNKNOWN: "unknown",
    Kind.LAW: "law",
    Kind.FAULT: "fault",
}


def law_entry(name: str, where: str) -> dict[str, Any]:
    """A law of a diagnosis that depends on what a drawn one does."""
    return {
        "name": "law",
        "where": where,
        "parameters": {},
        "probability": 0.98,
        "ambiguity_set": ["law"],
        "gap_closed_held_out": 0.95,
        "alternatives": [],
        "law": {"variable": name.split("_")[1]},
    }


def identity_of(name: str, where: str) -> Identity:
    return Identity(frozenset({name}), frozenset({where}))
