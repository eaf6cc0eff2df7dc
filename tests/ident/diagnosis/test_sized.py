"""A cause has a size that is surely not zero, by itself or with what comes along."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.limits import Limits
from ident.diagnosis.problem import Candidate, Variant
from ident.diagnosis.refit import Part
from ident.diagnosis.sized import is_nothing, is_sizeless
from ident.effects import EffectParameter

SPRING = Candidate(
    "spring",
    "place",
    (EffectParameter("compliance", "rad/Nm", "what it yields"),),
    (Variant(()),),
    contribution=lambda *_: [],
)


def part(numbers: tuple[float, ...], scatter: tuple[float, ...]) -> Part:
    first = slice(0, 1)
    found, spread = np.array(numbers), np.array(scatter)
    return Part("spring@place", found[first], spread[first], found, spread, ())


@pytest.mark.parametrize(
    ("numbers", "scatter", "nothing", "sizeless"),
    [
        ((1.0,), (0.1,), False, False),
        ((0.1,), (0.1,), True, False),
        ((1.0, 0.0), (0.1, 1.0), False, False),
        ((0.1, 0.0), (1.5, 1.0), True, False),
        ((0.1, 5.0), (1.5, 1.0), False, True),
        ((9.0, 5.0), (1.5, 1.0), False, False),
    ],
    ids=["sure", "unsure", "sure beside nothing", "both unsure", "what comes along alone", "both sure"],
)
def test_what_may_be_zero_is_nothing_and_what_only_comes_along_has_no_size(
    numbers: tuple[float, ...], scatter: tuple[float, ...], nothing: bool, sizeless: bool
) -> None:
    found = part(numbers, scatter)
    assert is_nothing(SPRING, found, Limits()) is nothing
    assert is_sizeless(SPRING, found, Limits()) is sizeless
