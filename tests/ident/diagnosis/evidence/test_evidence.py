"""The evidence is that of Gaussian rows, by a dense covariance; noise and exact forms are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from ident.diagnosis.evidence.evidence import Evidence
from ident.diagnosis.evidence.tables import Member
from ident.diagnosis.hypotheses.gram import Beside, Gram
from ident.diagnosis.noise.colours import SIZES
from ident.diagnosis.problem import Nominal, Problem, Variant
from ident.diagnosis.search.slots import slot_of

Array = NDArray[np.float64]
Asked = Callable[[Problem, Problem], Any]


@pytest.fixture
def problems(world: Callable[..., Any]) -> tuple[Problem, Problem]:
    made = world(3, samples=120, true={"b": 0.4})
    return made.problem(0), made.problem(1)


def dense(question: Any, sizes: tuple[int, ...], columns: Array) -> float:
    """Log density of the target, columns (n, k) with coefficients of unit variance beside the baseline's."""
    count = len(question.design.target)
    white, volume = question.colours.white(np.eye(count), sizes)
    noise = np.linalg.inv(white.T @ white)
    every = np.column_stack([question.design.baseline, columns])
    assert np.linalg.slogdet(noise)[1] == pytest.approx(2 * volume)
    density = stats.multivariate_normal(np.zeros(count), noise + every @ every.T, allow_singular=True)
    return float(density.logpdf(question.design.target) + 0.5 * count * np.log(2 * np.pi))


def test_evidence_is_that_of_gaussian_rows(problems: tuple[Problem, Problem], asked: Asked) -> None:
    known = tuple(replace(one, spreads=dict.fromkeys(one.names, (0.0, 3.0))) for one in problems)
    question = asked(*known)
    sizes = tuple(1 if label else 0 for label in range(len(question.colours.labels)))
    members = {question.number("b@place"): Member(0, 0.5), question.number("d@place"): Member(0, 2.0)}
    target = Evidence(question.products, sizes).target_beside(())
    columns = [
        one.scale * question.design.columns[:, question.design.hypotheses[index].blocks[0].place]
        for index, one in members.items()
    ]
    nothing = dense(question, sizes, np.zeros((len(question.design.target), 0)))
    assert target.nothing == pytest.approx(nothing, abs=1e-4)
    assert target.nothing + target.log_likelihood(members) == pytest.approx(
        dense(question, sizes, np.hstack(columns)), abs=1e-4
    )


def test_what_errors_of_a_model_have_in_common_is_known_of_its_parameters(
    problems: tuple[Problem, Problem], asked: Asked
) -> None:
    """Against the density of rows whose parameters are Gaussian with that covariance."""
    correlation = np.array([[1.0, -0.9, 0.2], [-0.9, 1.0, 0.0], [0.2, 0.0, 1.0]])
    nominal = Nominal(np.array([0.9, -1.7, 0.4]), np.array([0.3, 0.5, 0.1]), correlation)
    question = asked(*(replace(one, nominal=nominal) for one in problems))
    rows = question.regression.rows
    white, _ = question.colours.white(np.eye(len(rows.target)), question.colours.usual)
    covariance = np.outer(nominal.std, nominal.std) * correlation
    expected = stats.multivariate_normal(
        rows.baseline @ nominal.values,
        np.linalg.inv(white.T @ white) + rows.baseline @ covariance @ rows.baseline.T,
        allow_singular=True,
    )
    found = Evidence(question.products, question.colours.usual).target_beside(()).nothing
    assert found == pytest.approx(expected.logpdf(rows.target) + 0.5 * len(rows.target) * np.log(2 * np.pi), abs=1e-3)


def test_the_evidence_of_a_hypothesis_integrates_its_scale(problems: tuple[Problem, Problem], asked: Asked) -> None:
    question = asked(*problems)
    target = Evidence(question.products, question.colours.usual).target_beside(())
    number = question.number("b@place")
    table = target.table(number, target.beside({}))
    one_by_one = [target.log_likelihood({number: Member(0, scale)}) for scale in table.scales.tolist()]
    assert table.total == pytest.approx(np.logaddexp.reduce(one_by_one) - np.log(len(one_by_one)))
    assert target.table_of(number, {}).total == pytest.approx(table.total)


def test_hypotheses_looked_at_together_have_the_evidence_that_each_has_alone(
    problems: tuple[Problem, Problem], asked: Asked
) -> None:
    question = asked(*problems)
    target = Evidence(question.products, question.colours.usual).target_beside(())
    beside = target.beside({question.number("b@place"): Member(0, 2.0)})
    others = [one for one in range(len(question.design.hypotheses)) if one != question.number("b@place")]
    together = target.tables(others, beside)
    for one in others:
        alone = target.table(one, beside)
        np.testing.assert_allclose(together[one].logs, alone.logs, rtol=1e-9)
        assert together[one].best == alone.best


def test_what_physics_expects_of_a_size_weighs_as_a_row_does(problems: tuple[Problem, Problem], asked: Asked) -> None:
    """Against the integral over the size, by quadrature."""

    def expected(numbers: Array) -> Array:
        return np.asarray((numbers - 0.3) / 0.05)

    told = [
        replace(
            one, candidates=tuple(replace(c, expected=expected if c.effect == "b" else None) for c in one.candidates)
        )
        for one in problems
    ]
    free, known = asked(*problems), asked(*told)
    number = free.number("b@place")
    tables = [Evidence(one.products, one.colours.usual).target_beside(()) for one in (known, free)]
    found, rows = (one.table(number, one.beside({})) for one in tables)
    scale = float(found.scales[len(found.scales) // 2])
    block = free.design.hypotheses[number].blocks[0]
    target = Evidence(free.products, free.colours.usual).target_beside(())
    place = free.products.at(block.place)
    power, amplitude = float(target.products.of(place, place)[0, 0]), float(target.products.target[place.start])
    sizes = np.linspace(-5, 5, 200_001) * float(block.sizes[0])

    def integral(more: Array) -> float:
        logs = amplitude * sizes - 0.5 * power * sizes**2 - 0.5 * (sizes / scale) ** 2 + more
        return float(np.logaddexp.reduce(logs))

    beyond = (sizes / block.sizes[0] - 0.3) / 0.05
    expected = integral(-0.5 * beyond**2) - integral(0 * sizes)
    middle = len(found.scales) // 2
    assert found.logs[0, middle] - rows.logs[0, middle] == pytest.approx(expected, abs=1e-3)


def test_a_set_has_the_same_posterior_by_its_own_columns_and_by_all(
    problems: tuple[Problem, Problem], asked: Asked
) -> None:
    fitter = asked(*problems).search.fitter
    state = fitter.state({index: Member(0, 1.0) for index in (0, 1)}, None)
    assert fitter.among_all(state).log_posterior == pytest.approx(state.log_posterior)


def diluted_by(excess: float, products: Beside) -> Beside:
    return replace(products, gram=Gram.of_all(products.gram.among(np.arange(len(products.gram))) / excess))


@pytest.mark.parametrize("excess", [2.0, 5.0])
def test_a_tempered_likelihood_is_that_of_rows_of_so_much_more_variance(
    problems: tuple[Problem, Problem], asked: Asked, excess: float
) -> None:
    """Products of white rows are so much smaller, but for what a coefficient then costs less."""
    question = asked(*problems)
    state, number = question.search.run(), question.number("b@place")
    assert list(state.members) == [number]
    whole, price = question.search.fitter.among_all(state), question.design.hypotheses[number].price
    alone = whole.target.table(number, whole.target.beside({}))
    blocks = question.design.hypotheses[number].blocks
    products = diluted_by(excess, whole.target.beside({}))
    (table,) = whole.evidence.tables_by([blocks], products)
    diluted = table.total - price
    slot = slot_of(question.search, whole, number, excess)
    bare = state.log_posterior - question.search.fitter.nothing.log_posterior
    noise = bare + price - alone.total
    assert slot.logs[number] - noise / excess == pytest.approx(diluted, abs=0.5 * np.log(excess) + 0.1)
    assert slot_of(question.search, whole, number, 1.0).logs[number] == pytest.approx(bare)


def test_slow_noise_that_no_repeat_shows_is_what_a_model_lacks(world: Callable[..., Any], asked: Asked) -> None:
    """What repeats in one coordinate and is no column is lacking there, and nowhere else."""
    made = world(5, samples=200, repeats=6)
    problems = [made.problem(part) for part in (0, 1)]
    slow = 3.0 * np.sin(np.linspace(0, 12, 200))
    lacking = [
        replace(
            problem,
            blocks=(replace(problem.blocks[0], target=problem.blocks[0].target + np.tile(slow, 6)), problem.blocks[1]),
        )
        for problem in problems
    ]
    sizes = asked(*lacking).search.fitter.nothing.evidence.sizes
    labels = asked(*lacking).colours.labels
    found = dict(zip(labels, (SIZES[size] for size in sizes), strict=True))
    assert found["dynamic/step/x"] >= 3
    assert found["dynamic/step/y"] == 0
    assert not any(asked(*problems).search.fitter.nothing.evidence.sizes)


def test_a_cause_that_is_not_linear_in_its_size_is_found_as_it_is(world: Callable[..., Any], asked: Asked) -> None:
    """f(a) = a x + 0.3 a² y: by its column alone y would be left."""
    made = world(7, samples=300, names=("a", "y"))

    def bent(problem: Problem) -> Problem:
        line, curve = (
            [one[:, 0] for one in candidate.variants[0].columns if one is not None] for candidate in problem.candidates
        )

        def added(size: float) -> list[Array]:
            return [size * first + 0.3 * size**2 * second for first, second in zip(line, curve, strict=True)]

        blocks = tuple(
            replace(block, target=block.target + more) for block, more in zip(problem.blocks, added(2.0), strict=True)
        )
        first = replace(
            problem.candidates[0],
            contribution=lambda values, _: added(float(values[0])),
            variants=(Variant(problem.candidates[0].variants[0].columns),),
        )
        return replace(problem, blocks=blocks, candidates=(first, problem.candidates[1]))

    question = asked(bent(made.problem(0)), bent(made.problem(1)))
    state = question.search.run()
    assert list(state.members) == [question.number("a@place")]
    (index,) = state.members
    size = state.target.means(state.members)[index][0] / question.design.hypotheses[index].blocks[0].sizes[0]
    assert size == pytest.approx(2.0, abs=0.05)
