"""Curves, rivals and judged steps of the page of a diagnosis: what is drawn is what was found."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.dependence import Basis, Dependence, Partner, Variable
from ident.diagnosis.diagnosis import Diagnosis, Gap, Unseen, Verdict
from ident.diagnosis.problem import Block, Candidate, Channel, Problem, Variant
from ident.diagnosis.vehicle.unseen import LANE_CHANGE, REPEATED
from ident.effects import EffectParameter
from ident.report.curves import cause_curves, law_figure
from ident.report.judged import judged_steps, scale_ticks
from ident.report.partial import effect_points, law_points
from ident.report.rivals import NOTHING, PROBABILITY, Standing, rival_charts

Array = NDArray[np.float64]

SAMPLES, REPEATS, NOISE = 400, 4, 0.1
LEVER = -2.0


def _motion(part: int) -> Array:
    return np.tile(3 * np.sin(np.linspace(0.0, 40.0 + part, SAMPLES)), REPEATS)


def _problem(part: int, law: Any, named: bool) -> Problem:
    """A joint whose torque f(x) stands in the rows with a lever; an effect drag may have that form."""
    generator = np.random.default_rng([7, part])
    x = _motion(part)
    inertia = np.tile(generator.normal(size=SAMPLES), REPEATS)
    baseline = np.stack([inertia, x], axis=1)
    target = baseline @ np.array([5.0, 1.0]) + LEVER * law(x) + NOISE * generator.normal(size=len(x))
    block = Block(
        record="made up",
        channel=Channel.DYNAMIC,
        step="steering_left",
        coordinate="alpha_l",
        unit="Nm",
        sample_time=0.02,
        bandwidth=100.0,
        target=target,
        baseline=baseline,
        moving=np.ones(len(x), dtype=bool),
        period=np.repeat(np.arange(REPEATS), SAMPLES),
        features=x[:, None],
    )

    def design(basis: Basis, *, apart: bool = False) -> list[Array | None]:
        return [LEVER * basis(x[:, None])[:, 0]]

    columns = [("quadratic_drag", x * np.abs(x))] if named else []
    columns.append(("scrub", np.tile(generator.normal(size=SAMPLES), REPEATS)))
    candidates = tuple(
        Candidate(name, "steering_left", (EffectParameter("size", "Nm", ""),), (Variant((LEVER * column[:, None],)),))
        for name, column in columns
    )
    rate = Dependence("steering_left", Variable.RATE, Partner.NOTHING, "rad/s", "Nm", (x[:, None],), design)
    return Problem(("C_l", "d_vl"), ("kg m^2", "Nm s/rad"), (block,), candidates, dependences=(rate,))


def _drag(x: Array) -> Array:
    return 0.5 * x * np.abs(x)


def _bump(x: Array) -> Array:
    return np.cos(2 * x)


@pytest.fixture(scope="module")
def drag() -> Findings:
    return judge(_problem(0, _drag, True), _problem(1, _drag, True), seed=1)


@pytest.fixture(scope="module")
def bump() -> Findings:
    return judge(_problem(0, _bump, False), _problem(1, _bump, False), seed=1)


def values(series: Any) -> Array:
    return np.frombuffer(base64.b64decode(series["bdata"]), dtype=series["dtype"]).astype(float)


def lines(figure: dict[str, Any], name: str) -> tuple[Array, Array]:
    (one,) = [trace for trace in figure["data"] if trace.get("name") == name]
    return values(one["x"]), values(one["y"])


def test_rows_say_of_an_effect_what_it_is_and_the_curve_drawn_is_that(drag: Findings) -> None:
    (cause,) = drag.causes
    assert cause.candidate.key == "quadratic_drag@steering_left"
    points = effect_points(drag, cause)
    assert points is not None
    assert points.x == pytest.approx(np.concatenate([_motion(part)[:SAMPLES] for part in (0, 1)]))
    assert np.std(points.y - _drag(points.x)) == pytest.approx(NOISE / abs(LEVER) / np.sqrt(REPEATS), rel=0.25)
    assert np.median(points.noise) == pytest.approx(NOISE / abs(LEVER) / np.sqrt(REPEATS), rel=0.1)
    assert points.confirming.sum() == SAMPLES
    (curve,) = cause_curves(drag)
    x, y = lines(curve.figure, "cause")
    known = np.isfinite(x)
    assert y[known] == pytest.approx(_drag(x[known]), abs=0.05)
    assert curve.has_band
    assert curve.figure["layout"]["yaxis"]["title"]["text"] == "friction [Nm]"


def test_the_curve_of_a_law_is_the_one_that_was_learnt_and_the_rows_lie_along_it(bump: Findings) -> None:
    assert bump.verdict is Verdict.LAW
    (cause,) = bump.causes
    law = cause.law_answer
    assert law is not None
    points = law_points(bump, cause)
    assert points is not None
    assert np.std(points.y - np.interp(points.x, law.curve[:, 0], law.curve[:, 1])) < 2 * np.median(points.noise)
    figure = law_figure(law, points)
    x, y = lines(figure, "cause")
    assert x == pytest.approx(law.curve[:, 0], rel=1e-6)
    assert y == pytest.approx(law.curve[:, 1], rel=1e-5, abs=1e-6)
    _, upper = lines(figure, "± 2 std")
    assert upper == pytest.approx(law.curve[:, 1] + 2 * law.curve[:, 2], rel=1e-5, abs=1e-6)
    low, high = figure["layout"]["yaxis"]["range"]
    assert low < np.min(points.y[np.argsort(points.y)[10:]])
    assert high > np.max(points.y[np.argsort(points.y)[:-10]])


def test_what_is_no_function_of_its_variable_has_no_curve(drag: Findings) -> None:
    (cause,) = drag.causes
    generator = np.random.default_rng(3)
    scattered = [None if one is None else one * generator.normal(size=len(one)) for one in cause.part.added]
    assert effect_points(drag, replace(cause, part=replace(cause.part, added=scattered))) is None


@pytest.mark.parametrize("name", ["drag", "bump"])
def test_rivals_come_by_their_odds_and_the_one_taken_is_among_them(name: str, request: pytest.FixtureRequest) -> None:
    findings = request.getfixturevalue(name)
    charts = rival_charts(findings)
    assert charts[0].title.startswith("In the place of")
    for chart in charts:
        assert [bar.value for bar in chart.bars] == sorted((bar.value for bar in chart.bars), reverse=True)
        assert [bar.length for bar in chart.bars] == sorted((bar.length for bar in chart.bars), reverse=True)
        assert all(0 <= bar.length <= 1 for bar in chart.bars)
        assert sum(bar.standing is Standing.TAKEN for bar in chart.bars) == 1
    (cause,) = findings.causes
    taken = charts[0].bars[0]
    assert taken.standing is Standing.TAKEN
    assert taken.length == 1
    assert taken.value == pytest.approx(cause.log_odds)


def test_a_place_has_the_probability_of_its_place_and_not_of_its_name(drag: Findings) -> None:
    (cause,) = drag.causes
    key, other = cause.candidate.key, "quadratic_drag@steering_right"
    shares = {key: 0.5, other: 0.45}
    ranked = replace(cause.ranked, probabilities=shares, log_odds={key: 20.0, other: 19.9}, alike=(key,))
    bars = rival_charts(replace(drag, causes=(replace(cause, probability=0.95, ranked=ranked),)))[0].bars
    assert [bar.probability for bar in bars] == ["50 %", "45 %"]


def test_what_is_not_believed_and_nothing_make_one(drag: Findings) -> None:
    shares = (0.3, 0.1, 0.08, 0.06, 0.05, 0.04)
    doubtful = {f"stribeck@axis_{number}": share for number, share in enumerate(shares)}
    chart = rival_charts(replace(drag, causes=(), doubtful=doubtful))[-1]
    assert chart.unit == PROBABILITY
    assert sum(bar.value for bar in chart.bars) == pytest.approx(1.0)
    assert chart.bars[0].name == NOTHING
    assert chart.bars[0].value == pytest.approx(1 - sum(doubtful.values()))


def test_laws_that_are_not_believed_are_said_in_words(drag: Findings) -> None:
    """Also those of another motion than the place's own."""
    (rate,) = drag.problem.dependences
    turn = replace(rate, variable=Variable.ANGLE, of="wheel")
    problem = replace(drag.problem, dependences=(turn,))
    chart = rival_charts(replace(drag, causes=(), problem=problem, doubtful={turn.key: 0.9}))[-1]
    assert chart.bars[0].name == "a force that depends on the position (wheel), steering left"


def test_every_step_that_was_judged_has_a_line_on_one_scale() -> None:
    gaps = [(REPEATED, "kinematic", 0.2, 0.1), (REPEATED, "dynamic", 5.0, 1.02), (LANE_CHANGE, "outcome", 1e7, 3.0)]
    unseen = tuple(Unseen(steps, channel, Gap(before, after, 1.0)) for steps, channel, before, after in gaps)
    found = judged_steps(Diagnosis(Verdict.EFFECT, (), (), Gap(4.0, 1.0, 1.0), (), None, unseen))
    assert [(one.steps, one.channel) for one in found] == [
        ("all rows held out", ""),
        ("the held-out steps", "rolling constraints"),
        ("the held-out steps", "torques"),
        ("the lane change", "simulated motions"),
    ]
    assert all(0 <= place <= 1 for one in found for place in (one.before, one.after, one.noise))
    assert found[2].noise < found[2].after < found[2].before < found[3].before == 1.0
    ticks = scale_ticks(found)
    assert ticks[0] == (1.0, found[0].noise)
    assert [place for _, place in ticks] == sorted(place for _, place in ticks)
