"""On what a remainder may depend: a smooth function of one variable of the motion, at a place.

A law adds partner(t) f(x(t)) to the rows of its place, f unknown: f(v), f(q), f(q) sign(v) for friction over position,
f(q) a for inertia over position. A group of equals has one f, each with its own x.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Basis = Callable[[Array], Array]
"""Values x (...) -> K functions of it (..., K)."""


class Design(Protocol):
    """Columns of some functions in every block, filtered like it."""

    def __call__(self, basis: Basis, *, apart: bool = False) -> Sequence[Array | None]:
        """(N, K), the sum of all equals; or (N, J K) with those of each beside the others'; None: no law acts there."""


class Variable(enum.StrEnum):
    """What a law is a function of."""

    RATE = "rate"
    DIRECTION = "direction"
    ANGLE = "angle"
    LOAD = "load"
    LOAD_RATE = "load_rate"
    LOAD_SECOND_RATE = "load_second_rate"
    ACCELERATION = "acceleration"
    TIME = "time"
    TEMPERATURE = "temperature"
    PATH_SINCE_REVERSAL = "path_since_reversal"
    OTHER_AXIS = "other_axis"


_OF_ACCELERATIONS: Final = (Variable.ACCELERATION, Variable.LOAD, Variable.LOAD_RATE, Variable.LOAD_SECOND_RATE)


class Partner(enum.StrEnum):
    """What the function is multiplied with."""

    NOTHING = ""
    DIRECTION = "direction"
    RATE = "rate"
    ACCELERATION = "acceleration"
    ROLLING = "rolling"
    """The rate of a wheel that rolls, in rolling rows: the function is of its radius."""


@dataclass(frozen=True)
class Dependence:
    """A variable at a place, of which the rows may hold a smooth function.

    Attributes:
        where: place.
        variable, partner: f(variable) times partner.
        unit_x, unit_y: of the variable and of f.
        arguments: (N, J) of every block, the variable at each of J equals; None where the law does not act.
        design: columns of every block for some functions of the variable.
        of: which motion, where that is not the place's own or comes around: another axis, a sum with it, a turn.
        period: of the variable where it comes around, else 0.
        noise: log evidence that the noise of what it is made of may be for a law of it.
        unrecorded: of what else that the records do not have the rows of one record may be a function; None: nothing.
    """

    where: str
    variable: Variable
    partner: Partner
    unit_x: str
    unit_y: str
    arguments: tuple[Array | None, ...]
    design: Design
    of: str = ""
    period: float = 0.0
    noise: float = 0.0
    unrecorded: Variable | None = None

    @property
    def effect(self) -> str:
        """Name of the law as an effect of a model."""
        return law_name(self.variable, self.partner, self.of)

    @property
    def is_noisy(self) -> bool:
        """Whether it is made of accelerations, whose noise stands in the rows as well."""
        return self.variable in _OF_ACCELERATIONS or self.partner is Partner.ACCELERATION

    @property
    def key(self) -> str:
        """Unique in a problem."""
        return f"{self.effect}@{self.where}"


def law_name(variable: str, partner: str, of: str = "") -> str:
    """Name of a law as an effect of a model; with `of`, one that no model has a form for, or a wheel's or a motor's."""
    return "_".join(part for part in ("law", str(variable), of, str(partner)) if part)


def across(parts: Sequence[Dependence]) -> Dependence:
    """One dependence of several records, with columns in the blocks of all."""

    def design(basis: Basis, *, apart: bool = False) -> Sequence[Array | None]:
        return [column for part in parts for column in part.design(basis, apart=apart)]

    return replace(parts[0], arguments=tuple(x for part in parts for x in part.arguments), design=design)


NEAREST: Final = 0.02
"""Of the rows, that are nearest to a reversal, or slowest: what is over before them no row can bound."""


def path_since_reversal(position: Array, velocity: Array) -> Array:
    """Distance (N,) that a position has gone since its velocity last changed sign."""
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    turned = np.flatnonzero(np.diff(np.sign(velocity)) != 0) + 1
    since = np.zeros(len(position), dtype=np.int64)
    since[turned] = turned
    return np.asarray(gone - gone[np.maximum.accumulate(since)])
