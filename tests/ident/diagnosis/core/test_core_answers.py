"""What the core says of machines whose lack is known, and of those that have a lack that its library lacks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from hil.exam.sources.machine import Machine
from ident.diagnosis.core.answer import diagnose_by_core
from ident.diagnosis.diagnosis import Diagnosis, Verdict
from ident.diagnosis.findings import LAW
from ident.diagnosis.names import EffectName
from ident.errors import RecordError

Say = Callable[..., Diagnosis]
Law = Callable[[float, float, float], float]


def ripple(_time: float, x: float, _v: float) -> float:
    """Thirty periods a metre, 0.4 N."""
    return 0.4 * math.sin(2 * math.pi * 30 * x)


def hump(_time: float, x: float, _v: float) -> float:
    """A load in one place of the travel, of no family."""
    return 0.8 * math.exp(-(((x - 0.1) / 0.03) ** 2))


def test_nothing_is_said_of_a_machine_that_is_its_model(said: Say) -> None:
    assert said().verdict is Verdict.NONE


@pytest.mark.parametrize(
    ("name", "changed", "parameter", "true"),
    [
        (EffectName.ASYMMETRIC_VISCOUS, {"asymmetry": 2.0}, "imbalance", 2.0),
        (EffectName.TORQUE_RIPPLE, {"law": ripple}, "amplitude", 0.4),
        (EffectName.TIME_DELAY, {"delay": 0.0045}, "delay", 0.0045),
        (EffectName.ELASTICITY, {"compliance": 1e-6}, "compliance", 0.36e-6),
    ],
)
def test_what_is_missing_is_named_with_its_size(
    said: Say, name: str, changed: dict[str, object], parameter: str, true: float
) -> None:
    answer = said(**changed)
    (effect,) = answer.effects
    assert effect.name == name
    size = effect.parameters[parameter]
    assert abs(size.value) == pytest.approx(true, abs=3 * size.std)
    assert size.std < 0.2 * true
    assert effect.gap_closed_held_out > 0.9 or answer.gap.closed > 0.9


def test_without_its_name_a_ripple_is_a_law_of_the_position(said: Say) -> None:
    answer = said(EffectName.TORQUE_RIPPLE, law=ripple)
    (effect,) = answer.effects
    assert (answer.verdict, effect.name) == (Verdict.LAW, LAW)
    assert effect.law is not None
    assert effect.law.variable == "angle"
    assert answer.gap.closed > 0.9


def test_a_law_of_no_family_is_a_law_with_its_curve(said: Say) -> None:
    """The curve rises where the load stands, and nowhere else."""
    (effect,) = said(law=hump).effects
    assert effect.name == LAW
    assert effect.law is not None
    x, y, std = effect.law.curve.T
    top = int(y.argmax())
    assert x[top] == pytest.approx(0.1, abs=0.01)
    assert y[top] - y[0] == pytest.approx(0.8, abs=0.1 + 3 * std[top])


def test_two_causes_are_both_named(said: Say) -> None:
    answer = said(law=ripple, delay=0.0045)
    assert {effect.name for effect in answer.effects} == {EffectName.TORQUE_RIPPLE, EffectName.TIME_DELAY}


def test_probabilities_and_sets_are_those_of_all_that_may_stand_there(said: Say) -> None:
    """A drag of half a noise unit may be friction that falls with speed: both are in the set, and share."""
    (effect,) = said(law=lambda _t, _x, v: 3.0 * v * abs(v)).effects
    assert EffectName.QUADRATIC_DRAG in effect.ambiguity_set
    assert 0.2 < effect.probability < 0.99


def test_several_axes_are_refused(carriage: Machine) -> None:
    both = replace(carriage, follower=(1.0, 1.0)).drive(1)
    with pytest.raises(RecordError, match="several axes"):
        diagnose_by_core([both], [both])
