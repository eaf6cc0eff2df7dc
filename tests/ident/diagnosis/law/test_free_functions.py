"""A name is right where no free function of its variable does better, and a small cause where other rows say so."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from hil.exam.sources.axes import Lacking, draw_axis
from hil.exam.sources.machine import Machine
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.names import LAW

Make = Callable[..., Any]


def _diagnosed(machine: Machine, seed: int = 31, lacking: tuple[str, ...] = ()) -> Findings:
    """Of one record to fit and one to confirm, neither with repeats."""
    once = replace(machine, repeats=1, strokes=24, duration=16.0)
    return diagnose_axis([once.drive(seed)], [once.drive(seed + 1)], seed=1, lacking=lacking)


def _falling(_time: float, _position: float, velocity: float) -> float:
    return 3.0 * math.copysign(math.exp(-abs(velocity) / 0.03), velocity) if velocity else 0.0


def _drag(_time: float, _position: float, velocity: float) -> float:
    return 60.0 * velocity * abs(velocity)


def test_friction_that_falls_with_speed_is_not_said_to_be_drag_alone_where_its_name_is_missing(machine: Make) -> None:
    findings = _diagnosed(machine(law=_falling), lacking=("stribeck",))
    effects = findings.diagnosis().effects
    assert effects
    assert all(LAW in effect.ambiguity_set for effect in effects if effect.name in ("quadratic_drag", LAW))


def test_a_family_that_fits_its_curve_stands_without_a_law_beside_it(machine: Make) -> None:
    findings = _diagnosed(machine(law=_drag))
    (effect,) = findings.diagnosis().effects
    assert effect.name == "quadratic_drag"
    assert LAW not in effect.ambiguity_set


@pytest.mark.parametrize("seed", [41, 51, 61])
def test_a_drag_below_the_noise_is_named_where_the_confirming_record_speaks_for_it(machine: Make, seed: int) -> None:
    """Nothing repeats, so the noise is not known: the gap itself is no larger than one takes the noise for."""
    findings = _diagnosed(machine(law=lambda time, x, v: 0.12 * _drag(time, x, v)), seed)
    (effect,) = findings.diagnosis().effects
    assert "quadratic_drag" in effect.ambiguity_set
    assert findings.causes[0].log_odds > 2.5


def test_of_machines_that_are_their_model_at_most_one_in_eight_is_named_without_repeats() -> None:
    found = [_of_the_model(draw_axis(seed, Lacking.NOTHING).machine, seed) for seed in range(5001, 5009)]
    assert sum(verdict is not Verdict.NONE for verdict in found) <= 1


def _of_the_model(machine: Machine, seed: int) -> Verdict:
    return diagnose_axis([machine.drive(seed)], [machine.drive(seed + 1)], seed=1).verdict


def test_a_ripple_beside_a_long_delay_is_found_at_its_order(machine: Make) -> None:
    """In what the parameters leave, the delay hides every order of the ripple."""
    findings = _diagnosed(machine(delay=6e-3, law=lambda _t, x, _v: 0.5 * math.sin(90 * x)))
    assert {str(cause.candidate.effect) for cause in findings.causes} == {"time_delay", "torque_ripple"}
    ripple = next(cause for cause in findings.causes if cause.candidate.effect == "torque_ripple")
    order = next(one for name, one in ripple.quantities.items() if "order" in name)
    assert order.value == pytest.approx(90 / (2 * math.pi), rel=0.01)
