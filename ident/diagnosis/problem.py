"""A gap as a regression: rows of a model, and columns that each possible cause would add to it.

Builders (one for the vehicle, one for a servo axis) turn records into a `Problem`; everything statistical sees nothing
else. The model of a block is

    target = baseline p + Σ columns θ + noise,

p shared by all blocks, θ by all blocks in which a candidate acts.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Dependence
from ident.effects import EffectParameter
from ident.vehicle.parameters import ROUNDED

Array = NDArray[np.float64]
Series = Sequence[Array | None]
"""One (N,) a block, None where it is zero."""
Contribution = Callable[[Array, Array], Series]
"""Values of the parameters (k,) and of the baseline (p,) -> what a candidate adds to the model of every block, (N,)."""
Turned = Callable[[Array, Series], Series]
"""Values of the parameters (k,) and forces of others -> what a candidate makes of those."""


class Channel(enum.StrEnum):
    """What is compared: rolling constraints, generalized torques, or simulated and recorded motion."""

    KINEMATIC = "kinematic"
    DYNAMIC = "dynamic"
    OUTCOME = "outcome"


@dataclass(frozen=True)
class Block:
    """Rows of one coordinate of one uninterrupted segment, all samples, in time.

    Every series has passed the same zero-phase filter.

    Attributes:
        record: where the rows come from, for messages.
        channel, step, coordinate: what they compare.
        unit: of the target, SI.
        sample_time: [s].
        bandwidth: cutoff of the filter that the series have passed [rad/s].
        target: (N,) measured.
        baseline: (N, p) regressor of the model; columns of zeros where a parameter does not act.
        moving: (N,) rows to be used; the others are stiction, or the ends of the filter.
        period: (N,) number of the repeat, -1 outside of any.
        regions: masks (N,) by name (`low_speed`, `forward`, ...) in which the gap is counted; they may overlap.
        features: (N, f) states that an unknown cause might depend on (speeds, angles, accelerations); any scale.
        tolerance: rms up to which a gap means nothing, however well it repeats, in the unit of the target.
        tolerated: (N,) factor on the tolerance at every moment, of rms one in the moving rows; None: one throughout.
        irregular: (N,) part of the target that may differ between repeats and is no noise; None: nothing.
    """

    record: str
    channel: Channel
    step: str
    coordinate: str
    unit: str
    sample_time: float
    bandwidth: float
    target: Array
    baseline: Array
    moving: NDArray[np.bool_]
    period: NDArray[np.int64]
    regions: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    features: Array | None = None
    tolerance: float = 0.0
    tolerated: Array | None = None
    irregular: Array | None = None

    @property
    def tolerances(self) -> Array:
        """What a model may have wrong at every moment (N,), rms in the unit of the target."""
        return self.tolerance * (np.ones_like(self.target) if self.tolerated is None else self.tolerated)

    @property
    def regular(self) -> Array:
        """The target (N,) without what is irregular."""
        return self.target if self.irregular is None else self.target - self.irregular

    @property
    def label(self) -> str:
        """Step and coordinate."""
        return f"{self.step}/{self.coordinate}"


@dataclass(frozen=True)
class Variant:
    """Columns of a candidate, its nonlinear parameters held at one choice.

    Attributes:
        columns: one (N, k) a block, None where it does not act; filtered like the block.
        start: coefficients of the columns (k,) -> values of all parameters of the candidate. None: they are the same,
            those of what may come along behind the parameters.
        bent: the candidate's contribution says more than these columns; without it, a refit takes the columns alone.
        beside: how many of the columns, the last ones, only come along with the effect.
        itself: the other columns are the effect by itself; not so where what comes along is what the effect does.
        found: (m,) numbers of the exact form that a refit may begin with as well; None: none.
    """

    columns: tuple[Array | None, ...]
    start: Callable[[Array], Array] | None = None
    bent: bool = True
    beside: int = 0
    itself: bool = True
    found: Array | None = None

    def numbers(self, coefficients: Array) -> Array:
        """(m,) of the exact form, by coefficients (k,) of the columns."""
        return coefficients if self.start is None else np.array(self.start(coefficients), dtype=float)


@dataclass(frozen=True)
class Periodic:
    """A force that is a wave over an angle, of an order that the records are asked for.

    Attributes:
        dependence: key of that on the angle.
        start: order [1/unit of the angle] -> coefficients of its sine and cosine -> values of the parameters.
    """

    dependence: str
    start: Callable[[float], Callable[[Array], Array]]


@dataclass(frozen=True)
class Candidate:
    """A possible cause at a place.

    Attributes:
        effect: canonical name.
        where: place.
        parameters: what its result is given in.
        variants: at least one; several choices of nonlinear parameters are tried, the best one counts.
        contribution: exact and nonlinear in the parameters, for the refit; None where the columns are all there is.
        force: what it adds before any filter, for what is turned by another; None: it is not turned.
        turned: parameters (k,), and the forces of others -> what it makes of those, beyond what they add themselves: an
            effort is late with everything in it. None: it adds to what others add.
        drift: it is a changed value of the model, no structure that the model lacks.
        least: what the coefficients of a variant must reach, 0 for a play or a mass; if the data want one smaller,
            this is not the cause. None: anything is possible.
        negligible: sizes of the coefficient of a single column, where it is negative and where it is positive, up to
            which it means nothing, in its unit.
        lowest: what the parameters must reach in size after the refit to be this effect; empty: anything.
        expected: how far the numbers of the exact form (m,) are from what physics allows, in standard deviations (k,),
            for what rows do not tell; None: nothing is known of them.
        excluded: the records speak against it, so that no others can bring it back.
        spread: standard deviations of the parameters that come with the way they are told, beyond the scatter of the
            rows; empty where there are none.
        part: the same as part of each parameter.
        yielding: the same over what comes along: a load, of what flanks yield under it.
        periodic: of a wave over an angle; its variants are then those of the orders that the records show.
        price: log evidence that the choice of its variants costs beyond that of its coefficients.
        noise: log evidence that the noise of what its columns are made of may be for it.
        as_found: its columns are taken from the rows themselves: a number of its own at every moment.
        usual: its size in practice; inf where nothing is known of it.
    """

    effect: str
    where: str
    parameters: tuple[EffectParameter, ...]
    variants: tuple[Variant, ...]
    contribution: Contribution | None = None
    force: Contribution | None = None
    turned: Turned | None = None
    drift: bool = False
    least: float | None = None
    negligible: tuple[float, float] = (0.0, 0.0)
    lowest: tuple[float, ...] = ()
    expected: Callable[[Array], Array] | None = None
    excluded: bool = False
    spread: tuple[float, ...] = ()
    part: float = 0.0
    yielding: float = 0.0
    periodic: Periodic | None = None
    price: float = 0.0
    noise: float = 0.0
    as_found: bool = False
    usual: float = math.inf

    @property
    def key(self) -> str:
        """`effect@where`, unique in a problem."""
        return f"{self.effect}@{self.where}"


def contributions_of(candidates: Sequence[Candidate], values: Array, baseline: Array) -> Series:
    """What a candidate of some parameters (k,) adds beside those of the baseline (p,); it has an exact form.

    Args:
        candidates: it in all problems, as their blocks follow each other.
        values, baseline: of the parameters.
    """
    forms = [each.contribution for each in candidates if each.contribution is not None]
    return [one for form in forms for one in form(values, baseline)]


def forces_of(candidates: Sequence[Candidate], values: Array, baseline: Array) -> Series:
    """The same of its force; it has one."""
    forms = [each.force for each in candidates if each.force is not None]
    return [one for form in forms for one in form(values, baseline)]


def turned_by(candidates: Sequence[Candidate], values: Array, forces: Series) -> Series:
    """What a candidate of some parameters (k,) makes of the forces of others; arguments as above."""
    found, first = list[Array | None](), 0
    for candidate in candidates:
        last = first + len(candidate.variants[0].columns)
        assert candidate.turned is not None
        found += candidate.turned(values, forces[first:last])
        first = last
    return found


def summed(parts: Sequence[Series]) -> Series:
    """What several add, at least one, to every block."""
    found = []
    for each in zip(*parts, strict=True):
        there = [one for one in each if one is not None]
        found.append(np.sum(there, axis=0) if there else None)
    return found


@dataclass(frozen=True)
class Nominal:
    """Values of the model that is judged, and how well they are known.

    Attributes:
        values, std: (p,) in the units of the baseline.
        correlation: (p, p) of their errors; None: independent.
    """

    values: Array
    std: Array
    correlation: Array | None = None

    def of(self, places: NDArray[np.int64]) -> Nominal:
        """Of some parameters."""
        correlation = None if self.correlation is None else self.correlation[np.ix_(places, places)]
        return Nominal(self.values[places], self.std[places], correlation)

    @property
    def spread(self) -> Array:
        """(p, p) whose columns are independent errors of one standard deviation each."""
        powers, turn = np.linalg.eigh(np.eye(len(self.std)) if self.correlation is None else self.correlation)
        return np.asarray(self.std[:, None] * turn * np.sqrt(np.maximum(powers, ROUNDED)))


@dataclass(frozen=True)
class Known:
    """What is known beforehand of some parameters of the baseline.

    Attributes:
        places: (k,) which.
        values: (k,) of them.
        spread: (k, k) whose columns are independent errors of one standard deviation each.
    """

    places: NDArray[np.int64]
    values: Array
    spread: Array

    @cached_property
    def precision(self) -> Array:
        """(k, k) that turns errors into independent ones of one standard deviation each."""
        return np.asarray(np.linalg.inv(self.spread))


@dataclass(frozen=True)
class Problem:
    """Everything that the search for causes sees of one or several records.

    Attributes:
        names, units: of the baseline's p parameters.
        blocks: rows.
        candidates: possible causes; the same ones, in the same order, in a problem to fit and one to confirm.
        nominal: model that is judged; None: the baseline is refitted freely.
        spreads: means and standard deviations of parameters by name that no model states, judged or not.
        dependences: on what a remainder may depend; the same ones, in the same order, in a problem to confirm.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    blocks: tuple[Block, ...]
    candidates: tuple[Candidate, ...]
    nominal: Nominal | None = None
    spreads: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    dependences: tuple[Dependence, ...] = ()

    @cached_property
    def known(self) -> Known:
        """Of all parameters where a model is judged, else of those with a spread of their own."""
        if self.nominal is not None:
            return Known(np.arange(len(self.names)), self.nominal.values, self.nominal.spread)
        places = np.array([self.names.index(name) for name in self.spreads], dtype=np.int64)
        means, std = np.array(list(self.spreads.values())).reshape(-1, 2).T
        return Known(places, means, np.diag(std))

    def candidate(self, key: str) -> Candidate:
        """The candidate of that key.

        Raises:
            KeyError: there is none.
        """
        for candidate in self.candidates:
            if candidate.key == key:
                return candidate
        raise KeyError(key)
