"""How large what a machine lacks is, in noise units: what its model does not absorb, over the noise of the effort."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.exam.axes.effects import MISSING
from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.problem import axis_problem
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.observations.linear import least_squares, rms
from ident.errors import UserError
from ident.estimate.filters import SEVEN, differentiate, zero_phase
from ident.records.axis_record import AxisRecord

Array = NDArray[np.float64]

SLOW: Final = 0.05
"""Part of the largest speed below which an axis may stick, and a row says nothing."""

TRIES: Final = 6
"""Sizes that are tried at most to hit a number of noise units."""

NEAR: Final = 0.02
"""Of that number, at which a size is taken."""

RUNAWAY: Final = 2.0
"""Travel over that of the plain machine, beyond which a machine does not do what it is told."""


class Ruler:
    """Noise units on one machine in one motion.

    Args:
        machine: without what it may lack.
        seed: of its motion.

    Raises:
        EstimationError: no motion of it can be used.
    """

    def __init__(self, machine: Machine, seed: int) -> None:
        self._quiet, self._seed = replace(machine, noise=0.0, encoder=0.0), seed
        record = machine.drive(seed)
        self._bandwidth = axis_problem([record], axis_reference([record], None, [])).blocks[0].bandwidth
        plain = self._quiet.drive(seed)
        self._travel = float(np.ptp(plain.axes[0].position))
        self._plain = self._left(plain)
        noise = np.random.default_rng(seed).normal(size=len(record)) * machine.noise
        self._noise = rms(self._filtered(noise)[self._plain.moving])

    def units(self, name: str, size: float, values: Mapping[str, float]) -> float:
        """Noise units of a size."""
        machine = MISSING[name].added(self._quiet, size, values)
        left = self._left(machine.drive(self._seed))
        kept = left.moving & self._plain.moving
        gap = (left.force - self._plain.force)[kept]
        beside = gap - self._plain.columns[kept] @ least_squares(self._plain.columns[kept], gap)
        return rms(np.asarray(beside)) / self._noise if np.isfinite(beside).all() else math.inf

    def follows(self, machine: Machine) -> bool:
        """Whether a machine, with what it lacks, goes where it is told: a loop may be stable with each of two alone."""
        position = replace(machine, noise=0.0, encoder=0.0).drive(self._seed).axes[0].position
        return bool(np.isfinite(position).all() and np.ptp(position) < RUNAWAY * self._travel)

    def size(self, name: str, units: float, values: Mapping[str, float]) -> float:
        """Size that is so many noise units.

        Raises:
            UserError: none is: the machine cannot be driven with it.
        """
        size = MISSING[name].probe(self._quiet)
        for _ in range(TRIES):
            found = self.units(name, size, values)
            if not math.isfinite(found) or found <= 0:
                size /= 4
            elif abs(found / units - 1) < NEAR:
                return size
            else:
                size *= units / found
        raise UserError(f"{name} has no size of {units:g} noise units here.", "Draw another machine.")

    def _left(self, record: AxisRecord) -> _Left:
        """What friction and inertia leave of the effort."""
        machine, axis = self._quiet, record.axes[0]
        velocity = differentiate(axis.position, record.sample_time, SEVEN)
        acceleration = differentiate(velocity, record.sample_time, SEVEN)
        columns = np.stack([acceleration, velocity, np.sign(velocity), np.ones_like(velocity)], axis=1)
        force = axis.effort - columns @ [machine.mass, machine.viscous, machine.coulomb, machine.offset]
        memory = round(3 / self._bandwidth / record.sample_time)
        slow = np.abs(velocity) < SLOW * np.abs(velocity).max()
        moving = np.convolve(slow, np.ones(2 * memory + 1), mode="same") < 0.5
        return _Left(self._filtered(force), np.stack([self._filtered(one) for one in columns.T], axis=1), moving)

    def _filtered(self, values: Array) -> Array:
        return zero_phase(values, self._bandwidth, 1 / self._quiet.rate)


@dataclass(frozen=True)
class _Left:
    """Force (n,) that a model leaves, its columns (n, 4), both filtered, and rows (n,) that move."""

    force: Array
    columns: Array
    moving: NDArray[np.bool_]


@lru_cache(maxsize=1)
def ruler_of(machine: Machine, seed: int) -> Ruler:
    """The last one is kept: cases with two effects ask twice."""
    return Ruler(machine, seed)
