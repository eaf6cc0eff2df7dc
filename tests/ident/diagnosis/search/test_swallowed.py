"""Noise without repeats does not swallow a law of the motion, whose name is missing; and noise alone is no law."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.diagnose import diagnose_axis, pose_axis
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.observations.whitening import Left
from ident.diagnosis.search.asked import Asked, asked_beside_a_law, asked_of
from ident.diagnosis.search.swallowed import beside_a_law
from ident.records.axis_record import AxisRecord

Make = Callable[..., Machine]
Force = Callable[[float, float, float], float]

TRAVEL = 0.25
"""[m]"""

PERIODS = 12


def ripple(_time: float, x: float, _v: float) -> float:
    """0.5 N; it changes within a twelfth of the travel."""
    return 0.5 * math.sin(2 * math.pi * PERIODS / TRAVEL * x)


def drives(machine: Make, law: Force | None, repeats: int = 1) -> Sequence[AxisRecord]:
    made = machine(travel=TRAVEL, **({} if law is None else {"law": law}))
    once = replace(made, repeats=repeats, strokes=24, duration=16.0)
    return [once.drive(31), once.drive(32)]


def asked(records: Sequence[AxisRecord]) -> Asked:
    fit, confirm = list(records[:1]), list(records[1:])
    return asked_of(pose_axis(fit, confirm, axis_reference(fit, None, confirm), ("torque_ripple",)))


def beside(made: Asked, left: Left) -> Left:
    found = beside_a_law(made.problems[0], made.regression.rows, made.designs, left)
    assert found is not None
    return found


def power(series: NDArray[np.float64]) -> float:
    return float(np.mean(series**2))


def test_a_ripple_without_a_name_is_a_law_of_the_position(machine: Make) -> None:
    fit, confirm = drives(machine, ripple)
    found = diagnose_axis([fit], [confirm], seed=1, lacking=("torque_ripple",)).diagnosis()
    assert found.verdict is Verdict.LAW
    (effect,) = found.effects
    assert effect.law is not None
    assert (effect.law.variable, effect.law.partner) == ("angle", "")
    x, y, _std = effect.law.curve.T
    assert y == pytest.approx([ripple(0.0, at, 0.0) for at in x], abs=0.2)


def test_what_the_ripple_does_is_taken_off_what_is_left(machine: Make) -> None:
    """By a function of two dozen numbers or so, which count as fitted ones."""
    made = asked(drives(machine, ripple))
    left = made.fitter.left(made.fitter.nothing)
    found = beside(made, left)
    assert power(found.residual) < 0.5 * power(left.residual)
    assert 10 < found.fitted - left.fitted < 60


def test_of_noise_alone_nothing_but_the_share_of_those_numbers_is_taken(machine: Make) -> None:
    made = asked(drives(machine, None))
    white = np.random.default_rng(4).normal(size=len(made.regression.rows))
    found = beside(made, Left(white, 0.0))
    share = found.fitted / len(white)
    assert power(found.residual) == pytest.approx(1 - share, abs=4 * share)


def test_a_law_of_the_load_is_not_looked_for(machine: Make) -> None:
    """It is made of measured accelerations, and has the noise of the rows in it."""
    made = asked(drives(machine, None))
    noisy = tuple(one for one in made.problems[0].dependences if one.is_noisy)
    assert noisy
    number = made.problems[0].dependences.index(noisy[0])
    assert made.designs.knots(number) is not None
    only = replace(made.problems[0], dependences=noisy)
    assert beside_a_law(only, made.regression.rows, made.designs, made.fitter.left(made.fitter.nothing)) is None


def test_where_repeats_tell_the_noise_nothing_can_be_swallowed(machine: Make) -> None:
    made = asked(drives(machine, ripple, repeats=2))
    assert asked_beside_a_law(made, made.fitter.nothing) is None
