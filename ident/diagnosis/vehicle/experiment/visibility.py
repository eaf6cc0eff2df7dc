"""What an experiment can see, split and place: rank of the causes' columns beside the baseline, from the equations."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.directions import VISIBLE
from ident.diagnosis.observations.linear import orthonormal
from ident.diagnosis.observations.rows import Rows, make_rows
from ident.diagnosis.problem import Channel, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.lag import LAG_NAME
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, FOUR, Drive, ideal_record
from ident.effects import Effect
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

ALIKE: Final = 0.98
"""Cosine of the angle between what two causes leave, from which they count as one."""

RANK: Final = 1e-6
"""Smallest singular value, relative to the largest, of a baseline column that counts."""

NEGLIGIBLE: Final = 1e-3
"""Norm of a column, over the largest one of the same cause, that means nothing."""

NOISE: Final = 0.01
"""Noise of a generalized torque, in units of its rms; that of the rolling rows is what they tolerate."""


@dataclass(frozen=True, eq=False)
class Sight:
    """What an experiment shows of one cause.

    Attributes:
        key: of the cause.
        left: orthonormal bases of what the baseline leaves of every cause's columns, by key.
    """

    key: str
    left: Mapping[str, Sequence[Array]]

    @property
    def visible(self) -> bool:
        """Whether the baseline leaves anything of it."""
        return any(basis.shape[1] > 0 for basis in self.left[self.key])

    @cached_property
    def alike(self) -> tuple[str, ...]:
        """Keys of other causes that look the same."""
        return tuple(sorted(key for key in self.left if key != self.key and self._looks_like(key)))

    def alike_effects(self) -> tuple[str, ...]:
        """Names of other effects among them."""
        own = self.key.partition("@")[0]
        return tuple(dict.fromkeys(name for key in self.alike if (name := key.partition("@")[0]) != own))

    def _looks_like(self, other: str) -> bool:
        return any(_are_alike(mine, theirs) for mine in self.left[self.key] for theirs in self.left[other])


def sights(problem: Problem, further: Problem | None = None) -> Mapping[str, Sight]:
    """What rows of one problem, or two, show of every candidate, by key; a lag absorbs no delay beyond a sample."""
    rows = make_rows(problem, further)
    scale = row_noise(rows)
    free = [column for column, name in enumerate(problem.names) if name != LAG_NAME]
    baseline = orthonormal(rows.baseline[:, free] / scale[:, None], RANK)
    left: dict[str, list[Array]] = {candidate.key: [] for candidate in problem.candidates}
    for column in rows.layout:
        key = problem.candidates[column.candidate].key
        left[key].append(_left(rows.columns[:, column.own] / scale[:, None], baseline))
    return {key: Sight(key, left) for key in left}


def row_noise(rows: Rows) -> Array:
    """Noise (n,) of the rows, that of a vehicle that obeys the model: see NOISE."""
    scale = np.ones(len(rows))
    for (block, _), place in zip(rows.blocks, rows.block_slices, strict=True):
        rms = float(np.sqrt(np.mean(rows.target[place] ** 2))) if place.stop > place.start else 1.0
        scale[place] = block.tolerance if block.channel is Channel.KINEMATIC else NOISE * rms
    return scale


def _left(columns: Array, baseline: Array) -> Array:
    """Orthonormal basis of what the baseline leaves of some columns."""
    norms = np.linalg.norm(columns, axis=0)
    kept = norms > NEGLIGIBLE * norms.max(initial=0.0)
    used = columns[:, kept] / norms[kept]
    left = used - baseline @ (baseline.T @ used)
    # Eigenvectors of the few products: singular vectors of the many rows take ten times as long.
    powers, turn = np.linalg.eigh(left.T @ left)
    seen = powers > VISIBLE**2
    return np.asarray(left @ (turn[:, seen] / np.sqrt(powers[seen])))


def _are_alike(first: Array, second: Array) -> bool:
    """Whether the largest cosine of the principal angles between two spaces is near one; not where one is empty."""
    if not (first.shape[1] and second.shape[1]):
        return False
    cosines = first.T @ second
    # The Frobenius norm is no smaller, and takes no singular values.
    return bool(np.linalg.norm(cosines) > ALIKE and np.linalg.norm(cosines, 2) > ALIKE)


FORETOLD: Final = frozenset(EffectName) - {EffectName.PARAMETER_CHANGE, EffectName.SLIP}
"""Effects that the equations say something of before a record is there: sliding is found in records."""


@dataclass
class Visibility:
    """What every experiment shows of one vehicle, computed when it is first asked for: half a second for all effects.

    Attributes:
        vehicle: geometry is taken as true, parameters as its file guesses them.
    """

    vehicle: VehicleDescription
    _found: dict[tuple[str, frozenset[str]], Mapping[str, Sight]] = field(default_factory=dict)
    _plain: dict[tuple[Drive, ...], dict[frozenset[str], Problem]] = field(default_factory=dict)

    def __getitem__(self, experiment: str) -> Mapping[str, Sight]:
        """What the four steps show together with one diagnostic experiment; without any for the name `four steps`."""
        return self.of(experiment, FORETOLD)

    def of(self, experiment: str, effects: Collection[str]) -> Mapping[str, Sight]:
        """The same as if there were only some effects, by name."""
        asked = experiment, frozenset(map(str, effects))
        if asked not in self._found:
            self._found[asked] = sights(*self.imagined(*asked))
        return self._found[asked]

    def imagined(self, experiment: str, effects: frozenset[str]) -> tuple[Problem, Problem | None]:
        """Ideal rows of the four steps, and those that one diagnostic experiment adds; None for the four alone."""
        four, further = self._made(FOUR, (), effects), DIAGNOSTIC.get(experiment)
        return four, None if further is None else self._made(further.drives, further.given, effects)

    def _made(self, drives: Sequence[Drive], given: Sequence[Effect], effects: frozenset[str]) -> Problem:
        """Of what has been made for more effects already, the part that is asked for."""
        made = self._plain.setdefault(tuple(drives), {})
        more = next((problem for names, problem in made.items() if effects <= names), None)
        if more is None:
            more = made[effects] = _problem(drives, given, self.vehicle, effects)
        return replace(more, candidates=tuple(one for one in more.candidates if one.effect in effects))


def _problem(
    drives: Sequence[Drive], given: Sequence[Effect], vehicle: VehicleDescription, effects: Collection[str]
) -> Problem:
    # At the vehicle file's parameters: an experiment of few steps does not show all of them.
    names = [name for name in EffectName if name in effects and name in FORETOLD]
    record = ideal_record(drives, vehicle, periods=1)
    problem = build_problem([record], vehicle, vehicle.prior, given=given, effects=names, obeyed=True)
    return replace(problem, nominal=None)


EXPERIMENTS: Final = ("four steps", *DIAGNOSTIC)
"""Columns of the table: the four steps alone, then together with each diagnostic experiment."""
