"""Where the rows of an axis begin and end, in time and in frequency: noise of its position is no law of its effort."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hil.exam.sources.axes import Lacking, draw_axis
from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.diagnose import diagnose_axis, pose_axis
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.problem import Problem
from ident.errors import EstimationError

Make = Callable[..., Any]


@pytest.fixture
def coarse(machine: Make) -> Machine:
    """Heavy, with little noise of the effort and much of the position."""
    made: Machine = machine(
        mass=50.0, coulomb=16.0, viscous=33.0, noise=0.095, encoder=2.7e-6, rate=500.0, substeps=8, repeats=1,
        duration=32.0, strokes=24, speeds=(0.06, 0.13, 0.19, 0.26, 0.32),
    )  # fmt: skip
    return made


def _problems(machine: Machine, seed: int) -> tuple[Problem, Problem, float]:
    records = [machine.drive(seed), machine.drive(seed + 1)]
    reference = axis_reference(records[:1], None, records[1:])
    return *pose_axis(records[:1], records[1:], reference), reference.bandwidth


@pytest.mark.parametrize("seed", [71, 81])
def test_the_noise_of_a_position_is_no_law_of_the_acceleration(coarse: Machine, seed: int) -> None:
    assert diagnose_axis([coarse.drive(seed)], [coarse.drive(seed + 1)], seed=1).verdict is Verdict.NONE


def test_rows_end_where_the_noise_of_the_acceleration_could_be_taken_for_an_effect(coarse: Machine) -> None:
    """ln(1 + N/E) of all frequencies of the record is 3: with N / E = (f / f₀)⁴, f⁵ = 15 f₀⁴ / T where N is small.

    Or somewhat beyond: what the effort's noise is taken from holds some of that of the acceleration.
    """
    *_, bandwidth = _problems(coarse, 71)
    as_much = math.sqrt(coarse.noise / (coarse.mass * coarse.encoder)) / (2 * math.pi)
    wanted = 2 * math.pi * (15 * as_much**4 / (coarse.duration * coarse.repeats)) ** 0.2
    assert 0.95 * wanted < bandwidth < 1.5 * wanted


@pytest.mark.parametrize("mixed", [False, True])
def test_rows_end_there_for_the_record_that_confirms_too(coarse: Machine, mixed: bool) -> None:
    """A quarter of its rate: the noise of a position has four times the power per hertz."""
    fit = coarse.drive(71)
    slow = replace(coarse, rate=coarse.rate / 4, substeps=4 * coarse.substeps).drive(72)
    bandwidth = axis_reference([fit], None, [slow] if mixed else [coarse.drive(72)]).bandwidth
    alone = axis_reference([fit], None, []).bandwidth
    assert (bandwidth < 0.85 * alone) is mixed


def test_a_record_of_which_noise_leaves_nothing_is_refused_with_the_reason(machine: Make) -> None:
    """Two seconds of a heavy carriage whose scale reads to 3 μm: up to 7 Hz, 42 rows."""
    coarse = machine(mass=20.0, noise=0.07, encoder=2.7e-6, repeats=1, strokes=2, duration=2.0)
    with pytest.raises(EstimationError, match=r"(?s)above 7 Hz.*2\.7e-06 m of noise.*Record longer, or measure"):
        diagnose_axis([coarse.drive(5)], [], seed=1)


@pytest.mark.parametrize("seed", [9023, 9035, 9055])
def test_rows_at_the_ends_of_a_record_are_as_near_to_the_model_as_all_others(seed: int) -> None:
    """Machines whose records begin in mid-motion, their true parameters given."""
    machine = draw_axis(seed, Lacking.NOTHING).machine
    for problem in _problems(machine, seed)[:2]:
        (block,) = problem.blocks
        true = np.array([machine.mass, machine.viscous, machine.coulomb, machine.offset])
        lag = block.baseline[block.moving, 4:]
        left = (block.target - block.baseline[:, :4] @ true)[block.moving]
        left = left - lag @ np.linalg.lstsq(lag, left, rcond=None)[0]
        first = np.flatnonzero(block.moving) * block.sample_time
        near = (first < 1.0) | (first > first[-1] - 1.0)
        assert math.sqrt(np.mean(left[near] ** 2)) < 2 * math.sqrt(np.mean(left[~near] ** 2))


@pytest.mark.parametrize("seed", [91, 93, 95, 97])
def test_a_small_cause_is_named_where_the_gap_alone_would_be_called_noise(machine: Make, seed: int) -> None:
    """Viscous friction of 60 N s/m that differs by 0.15 from one way to the other."""
    made = machine(asymmetry=0.15, repeats=1, strokes=24, duration=16.0)
    findings = diagnose_axis([made.drive(seed)], [made.drive(seed + 1)], seed=1)
    assert findings.gap.before < 1.15
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["asymmetric_viscous"]
    assert findings.verdict is Verdict.EFFECT


@pytest.mark.parametrize("factor", [2, 4])
def test_a_position_may_be_read_at_another_part_of_the_interval_where_the_rate_is_another(
    machine: Make, factor: int
) -> None:
    """The same machine, the position read at the beginning of an interval, and at three quarters of a longer one."""
    fast = machine(mass=43.0, encoder=7e-7, rate=2000.0, substeps=4, read=0.0, repeats=1, strokes=8, duration=6.0)
    slow = replace(fast, rate=fast.rate / factor, substeps=4 * factor, read=0.75)
    findings = diagnose_axis([fast.drive(61)], [slow.drive(62)], seed=1)
    assert findings.verdict is Verdict.NONE
    assert findings.gap.before < 1.05


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_record_of_one_speed_says_nothing_of_another_and_that_is_no_gap(machine: Make, seed: int) -> None:
    """Of viscous and dry friction only the sum is told; the record that confirms splits them."""
    fit = machine(speeds=(0.1,), repeats=1, duration=8.0)
    confirm = replace(fit, speeds=(0.05, 0.1, 0.2))
    plain = diagnose_axis([fit.drive(seed)], [confirm.drive(seed + 1)], seed=1)
    assert plain.verdict is Verdict.NONE
    assert plain.gap.before < 1.2
    lacking = [replace(one, asymmetry=4.0).drive(seed + place) for place, one in enumerate((fit, confirm))]
    assert diagnose_axis(lacking[:1], lacking[1:], seed=1).verdict is not Verdict.NONE
