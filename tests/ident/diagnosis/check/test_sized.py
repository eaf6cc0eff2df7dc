"""Whether an effect has a size of its own."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.check.refit import Part
from ident.diagnosis.check.sized import is_sizeless
from ident.diagnosis.problem import Candidate, Variant
from ident.effects import EffectParameter


@pytest.mark.parametrize(
    ("size", "along", "sizeless"),
    [(0.5, 0.5, True), (2.5, 0.5, False), (2.5, 3.0, True), (3.5, 3.0, False), (0.5, 3.0, True)],
)
def test_what_comes_along_with_an_effect_is_no_reason_for_one_of_no_size(
    size: float, along: float, sizeless: bool
) -> None:
    candidate = Candidate("a", "place", (EffectParameter("size", "Nm", ""),), (Variant((None,)),))
    part = Part(
        key="a@place",
        numbers=np.array([size, along]),
        values=np.array([size]),
        std=np.ones(1),
        scatter=np.ones(2),
        added=(None,),
    )
    assert is_sizeless(candidate, part) is sizeless
