"""Evidence is what the equations say: the density of the rows, everything that is not known integrated."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from hil.exam.sources.machine import Machine
from ident.diagnosis.core.design import Design
from ident.diagnosis.core.evidence import Evidence, Member
from ident.diagnosis.core.hypotheses import hypotheses
from ident.diagnosis.core.noise import NONE, Colours, Whitener
from ident.diagnosis.core.observations import Observation, observe
from ident.diagnosis.names import EffectName

Array = NDArray[np.float64]


@pytest.fixture
def observations(carriage: Machine) -> tuple[Observation, ...]:
    return observe([carriage.drive(1)], [carriage.drive(2)])[0]


@pytest.fixture
def evidence(observations: tuple[Observation, ...]) -> Evidence:
    design = Design(observations, hypotheses(observations))
    whiteners = []
    for one in observations:
        level = float(np.var(one.target - one.plant @ np.linalg.lstsq(one.plant, one.target, rcond=None)[0]))
        factor = np.linalg.cholesky(Colours(one).covariance(NONE, level))
        whiteners.append(Whitener(factor, level, NONE))
    return Evidence(design, whiteners)


def test_a_name_is_as_likely_as_the_density_of_the_rows_with_its_prior(evidence: Evidence) -> None:
    """Restricted to what the plant does not absorb, by the density of a normal distribution."""
    design = evidence.design
    index = next(i for i, one in enumerate(design.hypotheses) if one.name == EffectName.QUADRATIC_DRAG)
    (block,) = design.of(index)
    member = Member(block, float(evidence.scales[3]))
    white, width = evidence.white, design.width
    basis = np.linalg.svd(white[:, :width])[0][:, width:]
    column = basis.T @ white[:, width:-1][:, design.blocks[block].place]
    target = basis.T @ white[:, -1]
    with_it = np.eye(len(target)) + member.scale**2 * column @ column.T
    zero = np.zeros(len(target))
    gained = stats.multivariate_normal.logpdf(target, zero, with_it) - stats.multivariate_normal.logpdf(target, zero)
    assert evidence.log_likelihood({index: member}) == pytest.approx(gained, abs=1e-6)
    assert evidence.table(index, {}).logs[0, 3] == pytest.approx(gained, abs=1e-6)


def test_what_is_taken_explains_nothing_twice(evidence: Evidence) -> None:
    """Log evidence of two is that of one, and of the other beside it."""
    first, second = 1, 2
    members = {i: Member(evidence.design.of(i)[0], float(evidence.scales[4])) for i in (first, second)}
    beside = evidence.table(second, {first: members[first]}).logs[0, 4]
    both = evidence.log_likelihood(members)
    assert both == pytest.approx(evidence.log_likelihood({first: members[first]}) + float(beside), abs=1e-6)


def test_every_scale_and_number_is_as_likely_before_the_rows(evidence: Evidence) -> None:
    table = evidence.table(0, {})
    assert table.total == pytest.approx(math.log(np.mean(np.exp(table.logs))), abs=1e-9)


def test_noise_is_what_the_sensors_have(carriage: Machine, observations: tuple[Observation, ...]) -> None:
    for one in observations:
        assert one.encoder == pytest.approx(carriage.encoder, rel=0.15)


def test_a_lag_is_found_to_a_fiftieth_of_a_sample(carriage: Machine) -> None:
    """The effort is held over an interval and the position read in its middle: no lag; of a delay all."""
    late = Machine(**{**vars(carriage), "delay": 0.0045})
    for machine, lag in ((carriage, 0.0), (late, 0.0045)):
        for one in observe([machine.drive(1)], [machine.drive(2)])[0]:
            assert one.lag == pytest.approx(lag, abs=0.02 / machine.rate)
