"""What the candidates of an axis are written in: its motion and effort in one record."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.motion import AxisMotion
from ident.diagnosis.dependence import Partner, Variable
from ident.diagnosis.problem import Candidate, Contribution, Series, Turned, Variant
from ident.effects import EffectParameter
from ident.records.axis_record import AxisKind

Array = NDArray[np.float64]
Filter = Callable[[Array], Array]
Response = Callable[[Array, Array], Array]


class AxisEffect(enum.StrEnum):
    """Effects that are looked for at axes alone."""

    COUPLED_FRICTION = "coupled_friction"
    FRICTION_WARMING = "friction_warming"
    GRAVITY_LOAD = "gravity_load"
    INERTIA_POSITION = "inertia_position"


OVER: Final[Mapping[str, tuple[Variable, Partner]]] = MappingProxyType(
    {
        AxisEffect.GRAVITY_LOAD: (Variable.ANGLE, Partner.NOTHING),
        AxisEffect.INERTIA_POSITION: (Variable.ANGLE, Partner.ACCELERATION),
    }
)
"""Of what each of them that is a function of one variable is one, and what that is multiplied with."""


@dataclass(frozen=True)
class AxisModel:
    """What candidates are written in: one axis of a record.

    Attributes:
        place: its place, for results.
        block: its number among the blocks of the problem.
        blocks: how many blocks there are.
        kind: says the units.
        motion: smoothed.
        sample_time: [s].
        filtered: passes (N,) or (N, k) through the filter of the rows.
        bandwidth: of that filter [rad/s].
        inertia: M of a first estimate [kg or kg m²].
        columns: (N, p) of the smoothed motion that make an effort with the parameters of the axis.
        first: number of the first of them among the parameters of all axes.
        effort: (N,) of a first estimate of them [N or Nm].
        absorbed: (N,) the same, of the columns of the baseline itself.
        speed: of which the axis is seldom faster [m/s or rad/s].
        slowest: than which it is seldom slower in a row [m/s or rad/s].
        nearest: path since a reversal within which few rows are [m or rad].
        reach: range of its position [m or rad].
        others: name and motion of the other axes.
    """

    place: str
    block: int
    blocks: int
    kind: AxisKind
    motion: AxisMotion
    sample_time: float
    filtered: Filter
    bandwidth: float
    inertia: float
    columns: Array
    first: int
    effort: Array
    absorbed: Array
    speed: float
    slowest: float
    nearest: float
    reach: float
    others: tuple[tuple[str, AxisMotion], ...]

    def effort_of(self, baseline: Array) -> Array:
        """Effort (N,) of the smoothed motion with parameters of all axes."""
        return np.asarray(self.columns @ baseline[self.first : self.first + self.columns.shape[1]])

    def alone(self, column: Array) -> tuple[Array | None, ...]:
        """A filtered column in the block of this axis, nothing in the others."""
        filtered = self.filtered(column)
        return tuple(filtered if index == self.block else None for index in range(self.blocks))

    def exactly(self, added: Callable[[Array, Array], Array]) -> tuple[Contribution, Contribution]:
        """Contribution and force of an effect that adds (N,) by the values of its parameters and of the baseline."""
        return (
            lambda values, baseline: self.alone(added(values, baseline)),
            lambda values, baseline: self.unfiltered(added(values, baseline)),
        )

    def answered(self, response: Response) -> tuple[Contribution, Turned]:
        """What an effect adds that answers to the whole effort: to that of the model, and to the forces of others.

        Args:
            response: parameters (k,), and an effort (N,) -> what becomes of that.
        """

        def contribution(values: Array, baseline: Array) -> Series:
            effort = self.effort_of(baseline)
            return self.alone(response(values, effort) - effort)

        def turned(values: Array, forces: Series) -> Series:
            own = forces[self.block]
            return (None,) * self.blocks if own is None else self.alone(response(values, own) - own)

        return contribution, turned

    def unfiltered(self, force: Array) -> Series:
        """A force (N,) on this axis, none on the others."""
        return tuple(force if index == self.block else None for index in range(self.blocks))

    def unit(self, per: str = "") -> str:
        """Unit of the effort, over some power of position and time."""
        return f"{self.kind.effort_unit}{per.replace('q', self.kind.position_unit)}"


def linear(
    axis: AxisModel,
    effect: str,
    parameters: Sequence[EffectParameter],
    *columns: Array,
    where: str | None = None,
) -> Candidate:
    """An effect whose columns (N,) are all there is; at the axis, or as `where` names it."""
    together = np.stack(columns, axis=1)

    def force(values: Array, _baseline: Array) -> Series:
        return axis.unfiltered(together @ values)

    return Candidate(effect, where or axis.place, tuple(parameters), (Variant(axis.alone(together)),), force=force)


def shaped_by(
    axis: AxisModel,
    effect: str,
    parameters: tuple[EffectParameter, EffectParameter],
    series: Callable[..., Array],
    tried: Sequence[float],
    *,
    along: Sequence[float] = (),
    price: float = 0.0,
    scale: Callable[[Array], float] = lambda _baseline: 1.0,
) -> Candidate:
    """An effect of a size times a series (N,) of one more number, of which some are tried first.

    `along` are where further numbers of the series begin, that are fitted and not stated. `scale` is by how much more
    the effect is, with other parameters than those of the first estimate.
    """

    def added(values: Array, baseline: Array) -> Array:
        return np.asarray(scale(baseline) * values[0] * series(*map(float, values[1:])))

    def variant(number: float) -> Variant:
        return Variant(axis.alone(series(number)[:, None]), lambda found: np.array([*found, number, *along]))

    return Candidate(effect, axis.place, parameters, tuple(map(variant, tried)), *axis.exactly(added), price=price)
