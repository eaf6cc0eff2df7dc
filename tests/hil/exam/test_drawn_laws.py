"""Laws that an exam draws: of the size that is asked for, at every place and of every variable, no two alike."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.interpolate import BSpline

from emulator.effects import inject
from emulator.effects.measured import Table
from emulator.prototype import load_prototype
from hil.exam.cases import Kind
from hil.exam.drawing import Composition, draw_cases
from hil.exam.drawn_laws import DRAWN, draw_laws, law_effect
from hil.exam.identity import planned_record
from hil.exam.plans import CONFIRMING
from hil.exam.sizes import SizeTable
from ident.campaign.plan import make_plan
from ident.campaign.steps import PERIODS
from ident.effects.laws import COUNT, coefficient
from ident.records.record import FOUR_STEPS, Record
from ident.vehicle.description import load_vehicle


@pytest.fixture(scope="module")
def planned() -> Record:
    vehicle = load_vehicle("prototype")
    plan = make_plan(
        vehicle, np.random.default_rng(3), steps=FOUR_STEPS, periods=PERIODS, cycle=0.002, specs=CONFIRMING
    )
    return planned_record(plan, vehicle.prior)


def test_what_the_model_leaves_of_a_law_is_as_large_as_asked(table: SizeTable, planned: Record) -> None:
    """Friction over the steering angle, by the emulator's own reading of its coefficients."""
    law, *_ = (
        one
        for one in draw_laws(table, [1.5] * 40, np.random.default_rng(1))
        if str(one.where) == "steering_left" and one.name == "law_angle_direction"
    )
    effect = law_effect(law, planned)
    coefficients = tuple(effect["scale"] * effect[coefficient(index)] for index in range(COUNT))
    curve = Table(effect["start"], effect["step"], effect["period"], coefficients)
    (segment,) = [one for one in planned.segments if one.step == "steering_left"]
    angle = segment.steering_angles[:, 0]
    rate = np.gradient(angle, segment.sample_time)
    moving = np.abs(rate) > 0.02 * np.abs(rate).max()
    torque = np.array([curve(x) for x in angle[moving]]) * np.sign(rate[moving])
    baseline = np.stack([np.sign(rate), rate, np.gradient(rate, segment.sample_time)], axis=1)[moving]
    left = torque - baseline @ np.linalg.lstsq(baseline, torque, rcond=None)[0]
    (row,) = [one for one in table.visible if (one.name, one.where) == ("asymmetric_coulomb", "steering_left")]
    assert np.sqrt(np.mean(left**2)) == pytest.approx(1.5 * row.physical(1.0), rel=0.02)


@pytest.mark.parametrize("name", ["law_rate", "law_angle"])
def test_a_law_is_the_curve_that_was_drawn(table: SizeTable, planned: Record, name: str) -> None:
    """By SciPy's splines on the points as they were drawn; of a wheel's angle it comes around."""
    law = next(
        one
        for one in draw_laws(table, [1.5] * 40, np.random.default_rng(1))
        if one.name == name and str(one.where).startswith("wheel_")
    )
    effect = law_effect(law, planned)
    coefficients = tuple(effect[coefficient(index)] for index in range(COUNT))
    curve = Table(effect["start"], effect["step"], effect["period"], coefficients)
    points = np.array([law.values[coefficient(index)] for index in range(DRAWN)])
    step = 2 * effect["step"]
    if effect["period"]:
        points = np.concatenate([points[-1:], points, points[:2]])
    first = -step if effect["period"] else effect["start"] - effect["step"]
    drawn = BSpline(first + step * np.arange(-2, len(points) + 2), points, 3)
    for x in np.linspace(first + step, first + step * (len(points) - 2), 101):
        assert curve(x) == pytest.approx(float(drawn(x)), abs=1e-9)


def test_laws_are_of_every_name_at_many_places_and_no_two_alike(table: SizeTable) -> None:
    laws = draw_laws(table, [1.0] * 64, np.random.default_rng(2))
    assert set(Counter(law.name for law in laws).values()) == {16}
    assert len({(law.name, law.where) for law in laws}) > 12
    shapes = {tuple(law.values[coefficient(index)] for index in range(DRAWN)) for law in laws}
    assert len(shapes) == len(laws)


def test_the_emulated_vehicle_can_have_every_law_that_is_drawn(table: SizeTable, planned: Record) -> None:
    for law in draw_laws(table, [2.0] * 32, np.random.default_rng(4)):
        inject(load_prototype(), [law_effect(law, planned)], 1e-3)


def test_a_case_with_a_law_fits_the_sealed_answer(table: SizeTable) -> None:
    """What is sealed is padded to a length that the number of cases decides."""
    import json

    from hil.exam.answer_file import PADDING

    few = Composition(effects=0, pairs=0, none=0, unknown=0, invisible=0, laws=16, faults=0)
    cases = draw_cases(table, few, range(99).__getitem__, np.random.default_rng(5))
    assert all(case.kind is Kind.LAW for case in cases)
    assert max(len(json.dumps(case.as_json())) for case in cases) < PADDING
