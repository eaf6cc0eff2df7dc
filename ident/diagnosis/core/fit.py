"""The exact fit of a set: sizes with their uncertainty, curves of laws, and the gap of records that took no part."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.core.design import Design
from ident.diagnosis.core.evidence import Member
from ident.diagnosis.core.functions import FILTER, waves
from ident.diagnosis.core.hypotheses import Hypothesis
from ident.diagnosis.core.observations import MASS, OFFSET
from ident.diagnosis.core.search import State
from ident.diagnosis.diagnosis import Gap
from ident.diagnosis.law.answer import POINTS, LawAnswer
from ident.records.axis_record import AxisKind
from ident.vehicle.quantities import Quantity

Array = NDArray[np.float64]

TRUSTED: Final = 15.0
"""Parameters that would have to agree between the records, to say as much of the noise as it says itself."""

WIDEST: Final = 1.0
"""Deviation of the logarithm of a family's number, before the rows."""

STEP: Final = 1e-4
"""Relative step of a family's number, for its derivative."""


@dataclass(frozen=True)
class Fit:
    """A set of hypotheses, fitted exactly.

    Attributes:
        parameters: of every named member.
        laws: of every other.
        gap: of the records that confirm, fitted without them.
        closed: share of it that each member closes.
    """

    parameters: Mapping[int, Mapping[str, Quantity]]
    laws: Mapping[int, LawAnswer]
    gap: Gap
    closed: Mapping[int, float]


@dataclass(frozen=True)
class _Part:
    """Columns of one member among all.

    Attributes:
        place: of its columns.
        ridge: (k,) deviation of each, before the rows; inf: any.
        turn: (K, k) from them to the columns of the design.
        named: whether they are of a family, and not a function's.
    """

    place: slice
    ridge: Array
    turn: Array
    named: bool


def fitted(
    state: State, fitting: int, kind: AxisKind, *, led: bool = False, lag: float = 0.0, temper: float = 1.0
) -> Fit:
    """The fit of all rows, and of the first `fitting` records alone.

    Args:
        state: a set.
        fitting: number of records that are fitted; the others confirm.
        kind: of the axis.
        led: whether the effort follows by a filter.
        lag: that belongs to the set, and is not what sampling does [s].
        temper: of `temperature`.
    """
    design = state.evidence.design
    everything = range(len(design.observations))
    whole = _Equations(state, everything, led)
    mean, _ = whole.solution(state.members)
    bends = {
        index: bend
        for index, member in state.members.items()
        if (bend := _bend(design, index, member, mean[whole.parts[index].place])) is not None
    }
    bent = _Equations(state, everything, led, bends=bends)
    covariance = temper * bent.solution(state.members)[1]
    parameters, laws = {}, {}
    for index, member in state.members.items():
        hypothesis, part = design.hypotheses[index], whole.parts[index]
        beside = bent.parts[index].place
        a, c = mean[part.place], covariance[beside, beside]
        if hypothesis.free:
            laws[index] = _law(hypothesis, design, member, part.turn @ a, part.turn @ c @ part.turn.T, kind)
        else:
            parameters[index] = _quantities(hypothesis, design, member, a, c, float(mean[MASS]), kind)
    gap, closed = _held_out(state, fitting, led, lag)
    return Fit(parameters, laws, gap, closed)


def temperature(state: State, fitting: int) -> float:
    """By how much more the confirming records contradict the fit of the others than the noise lets them, at least 1.

    Args:
        state: a set.
        fitting: number of records that are fitted.
    """
    count = len(state.evidence.design.observations)
    if fitting >= count:
        return 1.0
    fit, confirm = (_Equations(state, part, False) for part in (range(fitting), range(fitting, count)))
    (predicted, spread), (own, alone) = fit.solution(state.members), confirm.solution(state.members)
    design = confirm.white[:, :-1]
    contradicted = float(np.sum((design @ (predicted - own)) ** 2))
    expected = float(np.sum((design @ (spread + alone)) * design))
    freedom = fit.width + sum(part.place.stop - part.place.start for part in fit.parts.values() if part.named)
    return float(max((TRUSTED + freedom * contradicted / expected) / (TRUSTED + freedom), 1.0))


class _Equations:
    """White rows of some records: plant, members with the derivatives of their numbers, target."""

    def __init__(
        self,
        state: State,
        records: range,
        led: bool,
        lag: float = 0.0,
        bends: Mapping[int, Sequence[Array]] = MappingProxyType({}),
    ) -> None:
        design = state.evidence.design
        self.width = design.width
        rows = [np.vstack([design.plant[record] for record in records])]
        self.parts: dict[int, _Part] = {}
        end = self.width
        for index, member in state.members.items():
            block = design.blocks[member.block]
            columns = np.vstack([design.columns[record][:, block.place] for record in records])
            if design.hypotheses[index].free:
                turn = member.scale * block.factor
                columns, ridge = columns @ turn, np.ones(turn.shape[1])
            else:
                turn, ridge = np.eye(columns.shape[1]), np.full(columns.shape[1], np.inf)
            if index in bends:
                columns = np.column_stack([columns, np.concatenate([bends[index][record] for record in records])])
                ridge = np.append(ridge, WIDEST)
            rows.append(columns)
            self.parts[index] = _Part(
                slice(end, end + columns.shape[1]), ridge, turn, not design.hypotheses[index].free
            )
            end += columns.shape[1]
        target = np.concatenate(
            [
                design.targets[record]
                - (design.following[record] if led else 0.0)
                + lag * design.observations[record].late
                for record in records
            ]
        )
        stacked = np.column_stack([*rows, target])
        ends = np.cumsum([0, *(len(design.targets[record]) for record in records)])
        self.white = np.vstack(
            [state.evidence.whiteners[record].white(stacked[ends[n] : ends[n + 1]]) for n, record in enumerate(records)]
        )

    def solution(self, members: Mapping[int, Member], *, late: bool = True) -> tuple[Array, Array]:
        """Mean and covariance of all coefficients, of some members; the others are zero, and so is any lag if asked."""
        chosen = np.zeros(self.white.shape[1] - 1, dtype=bool)
        chosen[: self.width if late else OFFSET + 1] = True
        ridge = np.full(len(chosen), np.inf)
        for index in members:
            part = self.parts[index]
            chosen[part.place], ridge[part.place] = True, part.ridge
        design, target = self.white[:, :-1][:, chosen], self.white[:, -1]
        size = np.linalg.norm(design, axis=0)
        size[size == 0] = 1.0
        normal = design.T @ design / np.outer(size, size) + np.diag(1 / (size * ridge[chosen]) ** 2)
        inverse = np.linalg.pinv(normal, hermitian=True) / np.outer(size, size)
        mean, covariance = np.zeros(len(chosen)), np.zeros((len(chosen), len(chosen)))
        mean[chosen] = inverse @ (design.T @ target)
        covariance[np.ix_(chosen, chosen)] = inverse
        return mean, covariance

    def left(self, mean: Array) -> float:
        """Power of a row, in units of the noise."""
        rest = self.white[:, -1] - self.white[:, :-1] @ mean
        return float(np.mean(rest**2))


def _bend(design: Design, index: int, member: Member, mean: Array) -> list[Array] | None:
    """(n,) of every record, what another number of a family would add, by its logarithm; None where it has none."""
    hypothesis, block = design.hypotheses[index], design.blocks[member.block]
    if hypothesis.free or len(hypothesis.numbers) < 2 or block.number == hypothesis.numbers[-1]:
        return None
    size, found = design.sizes[block.place], []
    for one in design.observations:
        low, high = (one.rows(hypothesis.series(one, block.number * (1 + side * STEP))) for side in (-1, 1))
        found.append((high - low) / (2 * STEP) @ (mean / size))
    return found


def _held_out(state: State, fitting: int, led: bool, lag: float) -> tuple[Gap, dict[int, float]]:
    """Of the confirming records, by a fit of the others; of a single record, by itself."""
    count = len(state.evidence.design.observations)
    parts = [range(fitting), range(fitting, count)] if fitting < count else [range(count), range(count)]
    fit, confirm = (_Equations(state, part, led) for part in parts)
    after = confirm.left(fit.solution(state.members)[0])
    bare = [_Equations(state, part, False, lag) for part in parts] if lag else [fit, confirm]
    before = bare[1].left(bare[0].solution({}, late=not lag)[0])
    removable = before - 1.0
    closed = {}
    for index in state.members:
        without = confirm.left(fit.solution({i: m for i, m in state.members.items() if i != index})[0])
        closed[index] = (without - after) / removable if removable > 0 else math.nan
    return Gap(math.sqrt(before), math.sqrt(after), 1.0), closed


def _unit(text: str, kind: AxisKind) -> str:
    return text.replace("u", kind.effort_unit).replace("q", kind.position_unit)


def _quantities(
    hypothesis: Hypothesis, design: Design, member: Member, a: Array, covariance: Array, mass: float, kind: AxisKind
) -> dict[str, Quantity]:
    """Parameters of a family, by the coefficients of its columns and what is known of its number."""
    block = design.blocks[member.block]
    a, std = a / design.sizes[block.place], np.sqrt(np.maximum(np.diag(covariance), 0.0))
    relative = float(std[-1]) if len(std) > len(a) else math.nan
    std = std[: len(a)] / design.sizes[block.place]
    values, errors = [float(a[0]), block.number], [float(std[0]), relative * block.number]
    if hypothesis.response is not None:
        scale = (design.observations[0].values[MASS] / mass) ** 2
        values[0], errors[0] = values[0] * scale, errors[0] * scale
    elif len(a) > 1:
        # Sine and cosine of a wave.
        size, both = (
            float(np.hypot(*a)),
            covariance[:2, :2] / np.outer(design.sizes[block.place], design.sizes[block.place]),
        )
        along, across = a / size, np.array([-a[1], a[0]]) / size
        values = [size, block.number, math.atan2(a[1], a[0])]
        errors = [math.sqrt(along @ both @ along), errors[1], math.sqrt(across @ both @ across) / size]
    return {
        word: Quantity(value, _unit(unit, kind), "diagnosis", error)
        for (word, unit), value, error in zip(hypothesis.parameters, values, errors, strict=False)
    }


def _law(
    hypothesis: Hypothesis, design: Design, member: Member, a: Array, covariance: Array, kind: AxisKind
) -> LawAnswer:
    """A free function as it is written down."""
    function = hypothesis.function
    assert function is not None
    curve, size = np.zeros((0, 3)), design.sizes[design.blocks[member.block].place]
    if function is not FILTER:
        basis = waves(function, design.observations)
        x = np.linspace(basis.low, basis.high, POINTS)
        columns = basis.at(x) / size
        std = np.sqrt(np.maximum(np.sum((columns @ covariance) * columns, axis=1), 0.0))
        curve = np.column_stack([x, columns @ a, std])
    return LawAnswer(
        variable=str(function.variable),
        partner=str(function.partner),
        of="",
        channel="dynamic",
        period=None,
        unit_x="",
        unit_y=kind.effort_unit,
        curve=curve,
        formula=None,
        nearest=None,
        distance=None,
    )
