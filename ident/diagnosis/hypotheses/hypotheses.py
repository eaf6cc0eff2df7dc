"""Hypotheses: every cause at every place, and every free function, as columns in the rows with a prior each.

A named hypothesis is a candidate of the problem, whose variants are the values of its nonlinear numbers. A free
function of a variable is a Gaussian process (`ident.diagnosis.law.spline`), whose lengths stand in the place of those.
One of all names is as likely as the next, and of one name one place as the next; a law without a name is less likely.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.law.learning import LENGTHS, Designs
from ident.diagnosis.law.spline import Knots
from ident.diagnosis.names import LAW
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.noise.information import information_in
from ident.diagnosis.observations.linear import ROUNDING
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Column
from ident.diagnosis.problem import Candidate, Problem, Variant

Array = NDArray[np.float64]

SAME: Final = 1e-5
"""Share of the power of a free function that a direction must have: less changes no row."""


UNNAMED: Final = 3.0
"""Log odds of a name against a law without one, before the rows: twenty to one."""

DECADE: Final = 10.0
"""Size of an effect over its usual one, at most."""

UNKNOWN: Final = 1e3
"""Standard deviation of a parameter of which nothing is known, over what makes all of the target."""


@dataclass(frozen=True)
class Block:
    """Columns of one hypothesis at one value of its nonlinear numbers.

    Attributes:
        place: among all columns of the design.
        factor: (K, R) of the prior covariance, columns of unit variance.
        weight: log of its share of the prior.
        column: of a named hypothesis, in the rows.
        kept: (k,) which of the columns of the variant are anything.
        sizes: (K,) that its columns were divided by.
        largest: scale that it may have: of a size that people meet, and a decade more.
        expected: (m,) and (m,) of a single coefficient that is positive: slopes of what physics expects of its numbers,
            in standard deviations, and how far they are from that at zero; None: nothing is expected.
    """

    place: slice
    factor: Array
    weight: float
    column: Column | None
    kept: NDArray[np.bool_]
    sizes: Array
    largest: float = math.inf
    expected: tuple[Array, Array] | None = None

    @property
    def least(self) -> float:
        """What the coefficients must reach."""
        return -math.inf if self.column is None else self.column.least

    @property
    def negligible(self) -> tuple[float, float]:
        """Sizes of a single coefficient up to which it means nothing, negative and positive."""
        return (0.0, 0.0) if self.column is None else self.column.negligible

    def expected_of(self, amplitude: float) -> tuple[float, float, float]:
        """Slope and target of one row of what is expected of a coefficient of this sign, and half of what is left.

        A negative one has none: what physics says of it is the same for every size.
        """
        if self.expected is None:
            return 0.0, 0.0, 0.0
        slopes, missed = self.expected
        length = float(np.linalg.norm(slopes)) if amplitude > 0 else 0.0
        return length, float(-slopes @ missed) / length if length else 0.0, 0.5 * float(missed @ missed)


@dataclass(frozen=True)
class Hypothesis:
    """A cause that may be there.

    Attributes:
        key: `name@where`.
        name: of the library, or `law`.
        price: log odds against it, before the rows.
        choice: what of that is for its name and its place being one of many.
        blocks: at least one.
        candidate: its number, of a name.
        dependence: its number, of a law.
    """

    key: str
    name: str
    price: float
    choice: float
    blocks: tuple[Block, ...]
    candidate: int | None = None
    dependence: int | None = None

    @property
    def free(self) -> bool:
        """Whether it is a law without a name."""
        return self.dependence is not None


@dataclass(frozen=True)
class Design:
    """All hypotheses in the rows.

    Attributes:
        hypotheses: of the problems.
        columns: (n, K) of all of them.
        baseline: (n, p) of the parameters of the plant, by independent standard deviations of what is known of them.
        target: (n,) without what is known of them.
        known: (p,) of the parameters, in their units.
        spread: (p, p) whose columns are those standard deviations.
        free: (p,) of which nothing is known.
    """

    hypotheses: tuple[Hypothesis, ...]
    columns: Array
    baseline: Array
    target: Array
    known: Array
    spread: Array
    free: NDArray[np.bool_]


def make_design(problems: Sequence[Problem], regression: Regression, colours: Colours, designs: Designs) -> Design:
    """Columns of everything that may be there."""
    builder = _Builder(regression, colours)
    names = {str(one.effect) for one in problems[0].candidates if not one.excluded}
    kinds = math.log(len(names) + 1)
    found = [*builder.named(problems[0], kinds), *builder.free(problems[0], designs, kinds)]
    rows, known = regression.rows, problems[0].known
    length = np.linalg.norm(rows.baseline, axis=0)
    whole = UNKNOWN * float(np.linalg.norm(rows.target))
    spread = np.diag(np.divide(whole, length, out=np.zeros_like(length), where=length > 0))
    spread[np.ix_(known.places, known.places)] = known.spread
    values, free = np.zeros(len(spread)), np.ones(len(spread), dtype=bool)
    free[known.places] = False
    values[known.places] = known.values
    target = rows.target - rows.baseline @ values
    return Design(tuple(found), np.hstack(builder.columns), rows.baseline @ spread, target, values, spread, free)


class _Builder:
    """Puts columns beside each other, every one of unit rms where nothing is lacking but what is tolerated."""

    def __init__(self, regression: Regression, colours: Colours) -> None:
        self.regression, self.colours = regression, colours
        self.columns = [np.zeros((len(regression.rows), 0))]
        self._end = 0

    def named(self, problem: Problem, kinds: float) -> list[Hypothesis]:
        """All candidates that show."""
        rows = self.regression.rows
        white, _ = self.colours.white(rows.columns, self.colours.usual)
        sizes = np.sqrt(np.mean(white**2, axis=0))
        layout: dict[int, list[Column]] = defaultdict(list)
        for column in rows.layout:
            layout[column.candidate].append(column)
        places = Counter(str(one.effect) for one in problem.candidates if not one.excluded)
        found = []
        for number, candidate in enumerate(problem.candidates):
            shown = [one for one in layout[number] if one.width and sizes[one.place].max() > 0]
            weight = -math.log(max(len(shown), 1))
            blocks = tuple(self._block(column, sizes[column.place], weight, candidate) for column in shown)
            if blocks and not candidate.excluded:
                # What its choice costs beyond that of the variants, whose shares of the prior are their weights.
                variant = max(candidate.price + weight, 0.0)
                choice = kinds + math.log(places[str(candidate.effect)])
                price = choice + variant + candidate.noise
                if candidate.as_found:
                    (column,) = shown
                    price += information_in(rows.columns[:, column.place].sum(axis=1), self.colours)
                found.append(Hypothesis(candidate.key, str(candidate.effect), price, choice, blocks, candidate=number))
        return found

    def free(self, problem: Problem, designs: Designs, kinds: float) -> list[Hypothesis]:
        """All functions whose variable changes."""
        found, price = [], kinds + UNNAMED + math.log(max(len(problem.dependences), 1))
        for number, dependence in enumerate(problem.dependences):
            knots = designs.knots(number)
            blocks = () if knots is None else self._function(designs.columns(number), knots)
            if blocks:
                whole = price + dependence.noise
                found.append(Hypothesis(dependence.key, LAW, whole, price, blocks, dependence=number))
        return found

    def _block(self, column: Column, sizes: Array, weight: float, candidate: Candidate) -> Block:
        kept = sizes > ROUNDING * sizes.max()
        place = self._appended(self.regression.rows.columns[:, column.place][:, kept] / sizes[kept])
        variant = candidate.variants[column.variant]
        # The size that a coefficient of one is: a ripple's is told at the motor, its column at the wheel.
        unit = abs(float(variant.numbers(np.eye(column.width)[0])[0]))
        largest = DECADE * candidate.usual / unit * sizes[0] if kept[0] and unit else math.inf
        expected = _expected(candidate, variant, sizes) if len(sizes) == 1 else None
        return Block(place, np.eye(int(kept.sum())), weight, column, kept, sizes[kept], largest, expected)

    def _function(self, columns: Array, knots: Knots) -> tuple[Block, ...]:
        """A function at every length, in the directions that they have in common."""
        white, _ = self.colours.white(columns, self.colours.usual)
        factors = [knots.prior(share) for share in LENGTHS if share >= knots.shortest]
        made = [white @ factor for factor in factors]
        sizes = [math.sqrt(float(np.mean(np.sum(one**2, axis=1)))) for one in made]
        if min(sizes) == 0:
            return ()
        unit = np.hstack([one / size for one, size in zip(made, sizes, strict=True)])
        powers, turn = np.linalg.eigh(unit.T @ unit)
        turn = turn[:, powers > SAME * powers.max()] / np.sqrt(powers[powers > SAME * powers.max()])
        along = np.hstack([factor / size for factor, size in zip(factors, sizes, strict=True)]) @ turn
        count = math.sqrt(len(columns))
        place = self._appended(columns @ along * count)
        directions = unit @ turn
        nothing, weight = np.zeros(0, dtype=bool), -math.log(len(made))
        return tuple(
            Block(place, _thin(directions.T @ one / size / count), weight, None, nothing, np.zeros(0))
            for one, size in zip(made, sizes, strict=True)
        )

    def _appended(self, columns: Array) -> slice:
        self.columns.append(columns)
        self._end += columns.shape[1]
        return slice(self._end - columns.shape[1], self._end)


def _thin(factor: Array) -> Array:
    """Of the same covariance, with no more columns (K, R) than rows."""
    if factor.shape[1] <= factor.shape[0]:
        return factor
    turned, sizes, _ = np.linalg.svd(factor, full_matrices=False)
    return np.asarray(turned * sizes)


def _expected(candidate: Candidate, variant: Variant, sizes: Array) -> tuple[Array, Array] | None:
    """What physics expects of the numbers of an effect of one column, by its coefficient: straight from zero on."""
    if candidate.expected is None:
        return None
    here, there = (candidate.expected(variant.numbers(found)) for found in (np.zeros(1), 1 / sizes))
    return there - here, here
