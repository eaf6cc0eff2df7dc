"""A cause whose name is missing is a law of what it depends on, also where nothing that is named comes near it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import NamedEffect, Verdict

Make = Callable[..., Any]

TRAVEL = 0.25
"""[m]"""


def _said(machine: Machine, lacking: str) -> NamedEffect:
    """The one law that is found in a record to fit and one to confirm, without repeats."""
    once = replace(machine, repeats=1, strokes=24, duration=16.0)
    answer = diagnose_axis([once.drive(31)], [once.drive(32)], seed=1, lacking=(lacking,)).diagnosis()
    assert answer.verdict is Verdict.LAW
    (effect,) = answer.effects
    return effect


@pytest.mark.parametrize("periods", [3, 7, 12])
def test_a_ripple_is_a_law_of_the_position_that_has_all_of_its_periods(machine: Make, periods: int) -> None:
    turn = 2 * math.pi * periods / TRAVEL
    law = _said(machine(travel=TRAVEL, law=lambda _t, x, _v: 0.5 * math.sin(turn * x)), "torque_ripple").law
    assert law is not None
    assert (law.variable, law.partner) == ("angle", "")
    x, y, _std = law.curve.T
    true = [0.5 * math.sin(turn * at) for at in x]
    assert max(abs(got - want) for got, want in zip(y, true, strict=True)) < 0.2


def test_a_spring_is_a_law_of_the_second_rate_of_its_load(machine: Make) -> None:
    law = _said(machine(compliance=2e-6), "elasticity").law
    assert law is not None
    assert law.variable == "load_second_rate"
