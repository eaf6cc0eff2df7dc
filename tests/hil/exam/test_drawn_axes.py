"""Servo axes drawn at random: all of a seed, and what is missing is all that is missing."""

from __future__ import annotations

import numpy as np
import pytest

from hil.exam.sources.axes import Lacking, draw_axis
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import Verdict


@pytest.mark.parametrize("lacking", Lacking)
def test_a_seed_says_everything(lacking: Lacking) -> None:
    first, again = (draw_axis(3, lacking).record(4).axes[0] for _ in range(2))
    other = draw_axis(5, lacking).record(4).axes[0]
    assert np.array_equal(first.effort, again.effort)
    assert first.effort.shape != other.effort.shape or not np.array_equal(first.effort, other.effort)


def test_of_axes_that_lack_nothing_the_model_comes_out_and_few_are_told_to_lack_something() -> None:
    named = 0
    for seed in range(21, 41):
        drawn = draw_axis(seed, Lacking.NOTHING)
        findings = diagnose_axis([drawn.record(seed)], [], seed=1)
        found = dict(zip(findings.problem.names, findings.after.baseline, strict=True))
        assert found["M"] == pytest.approx(drawn.machine.mass, rel=0.01)
        named += findings.verdict is not Verdict.NONE
    assert named <= 4


def test_friction_over_the_position_has_a_variable_where_it_has_no_name() -> None:
    drawn = draw_axis(33, Lacking.FRICTION)
    findings = diagnose_axis([drawn.record(1)], [], seed=1)
    assert findings.verdict is Verdict.LAW
    assert findings.causes[0].candidate.effect == "law_angle_direction"
    assert findings.gap.closed > 0.9
