"""Laws of a servo axis as columns of a regression, written down without the diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import interpolate, signal

from ident.records.axis_record import AxisRecord

Array = NDArray[np.float64]
Columns = list[Array]
Variants = Iterator[Columns]


@dataclass(frozen=True)
class Axis:
    """What the model of an axis is made of, all (N,), SI.

    Attributes:
        time, effort: as recorded.
        position, speed, acceleration: of this axis, behind the low pass.
        others: position, speed and acceleration of the other axes of the record.
        interval: of samples [s].
        cutoff: of the low pass [Hz].
    """

    time: Array
    effort: Array
    position: Array
    speed: Array
    acceleration: Array
    others: tuple[tuple[Array, Array, Array], ...]
    interval: float
    cutoff: float

    @property
    def scale(self) -> float:
        """A large speed of this axis."""
        return float(np.percentile(np.abs(self.speed), 99))

    @property
    def direction(self) -> Array:
        """Sign of the speed, soft where the speed is noise."""
        return _sign(self.speed)

    def smooth(self, values: Array) -> Array:
        """Columns or the effort behind the low pass."""
        return low_pass(values, self.interval, self.cutoff)


Law = Callable[[Axis, Array], Variants]
"""Of an axis and the effort that its model has so far [N or Nm]: the columns of each form that the law may have."""


def low_pass(values: Array, interval: float, cutoff: float) -> Array:
    """Forward and backward through a Butterworth filter of fourth order."""
    sections = signal.butter(4, cutoff, fs=1 / interval, output="sos")
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0))


def axes_of(record: AxisRecord, cutoff: float) -> list[Axis]:
    """Every axis of a record, with the others beside it."""
    interval = record.sample_time
    motions = []
    for axis in record.axes:
        position = low_pass(axis.position, interval, cutoff)
        speed = np.gradient(position, interval)
        motions.append((position, speed, np.gradient(speed, interval)))
    return [
        Axis(record.time, axis.effort, *motions[at], tuple(motions[:at] + motions[at + 1 :]), interval, cutoff)
        for at, axis in enumerate(record.axes)
    ]


def baseline(axis: Axis) -> Columns:
    """Inertia of all axes, viscous and Coulomb friction, offset."""
    return [axis.acceleration, axis.speed, axis.direction, np.ones_like(axis.speed), *(q[2] for q in axis.others)]


def _sign(speed: Array) -> Array:
    return np.asarray(np.tanh(speed / (0.01 * np.percentile(np.abs(speed), 99))))


def _angles(axis: Axis) -> list[Array]:
    return [axis.position, *(position for position, _, _ in axis.others)]


def _sums(axis: Axis) -> list[Array]:
    """Angles of other axes, and sums and differences of up to three of all."""
    angles = _angles(axis)
    pairs = [first + sign * second for first, second in combinations(angles, 2) for sign in (1, -1)]
    triples = [a + s * b + t * c for a, b, c in combinations(angles, 3) for s in (1, -1) for t in (1, -1)]
    return angles[1:] + pairs + triples


def _spline(values: Array, times: Array, pieces: int = 14) -> Columns:
    low, high = np.percentile(values, [0.1, 99.9])
    knots = np.r_[[low] * 3, np.linspace(low, high, pieces), [high] * 3]
    basis = interpolate.BSpline.design_matrix(np.clip(values, low, high), knots, 3).toarray()
    return list((basis * times[:, None]).T)


def _waves(angle: Array) -> Columns:
    return [np.sin(angle), np.cos(angle)]


def _gravity(axis: Axis, _: Array) -> Variants:
    yield [axis.position]
    yield _waves(axis.position)


def _gravity_sum(axis: Axis, _: Array) -> Variants:
    for angle in _sums(axis):
        yield _waves(axis.position) + _waves(angle)


def _gravity_sums(axis: Axis, _: Array) -> Variants:
    if axis.others:
        yield [wave for angle in [axis.position, *_sums(axis)] for wave in _waves(angle)]


def _ripple(axis: Axis, _: Array) -> Variants:
    span = np.ptp(axis.position)
    for order in np.arange(3.0, 400.0, 0.5):
        yield _waves(2 * np.pi * order * axis.position / span)


def _path(axis: Axis) -> Array:
    """Path since the last reversal."""
    turns = np.flatnonzero(np.diff(np.sign(axis.speed)) != 0)
    travelled = np.r_[0.0, np.cumsum(np.abs(np.diff(axis.position)))]
    starts = np.r_[0.0, travelled[turns]]
    return np.asarray(travelled - starts[np.searchsorted(turns, np.arange(len(travelled)), side="right")])


def _delay(axis: Axis, load: Array) -> Variants:
    for late in np.r_[-10:0, 1:11] * 1e-3:
        yield [np.interp(axis.time - late, axis.time, load) - load]


def _products(axis: Axis, _: Array) -> Variants:
    if axis.others:
        speeds = [axis.speed, *(speed for _, speed, _ in axis.others)]
        pairs = [first * second for at, first in enumerate(speeds) for second in speeds[at:]]
        yield [pair * wave for pair in pairs for angle in _angles(axis) for wave in _waves(angle)]


def _coupled_friction(axis: Axis, _: Array) -> Variants:
    for _, speed, _ in axis.others:
        yield [speed, _sign(speed)]


def _coupled_inertia(axis: Axis, _: Array) -> Variants:
    for position, _, acceleration in axis.others:
        angles = (position, axis.position, axis.position + position)
        yield [a * wave for a in (acceleration, axis.acceleration) for angle in angles for wave in _waves(angle)]


def _stribeck(axis: Axis, _: Array) -> Variants:
    for part in np.geomspace(0.01, 1.0, 15):
        yield [axis.direction * np.exp(-((axis.speed / (axis.scale * part)) ** 2))]


def _presliding(axis: Axis, _: Array) -> Variants:
    for part in np.geomspace(1e-3, 0.3, 12):
        yield [axis.direction * np.exp(-_path(axis) / (np.ptp(axis.position) * part))]


def _one(columns: Callable[[Axis, Array], Columns]) -> Law:
    """A law of one form."""
    return lambda axis, load: iter([columns(axis, load)])


def _shapes(axis: Axis) -> Columns:
    return [axis.position, *_waves(axis.position)]


LAWS: Final[Mapping[str, Law]] = {
    "gravity over own position": _gravity,
    "gravity over one sum of positions": _gravity_sum,
    "gravity over all sums of positions": _gravity_sums,
    "f(position)": _one(lambda axis, _: _spline(axis.position, np.ones_like(axis.speed))),
    "f(position) times direction": _one(lambda axis, _: _spline(axis.position, axis.direction)),
    "friction over position": _one(lambda axis, _: [axis.direction * shape for shape in _shapes(axis)]),
    "f(speed)": _one(lambda axis, _: _spline(axis.speed, np.ones_like(axis.speed))),
    "stribeck": _stribeck,
    "drag": _one(lambda axis, _: [axis.speed * np.abs(axis.speed)]),
    "asymmetry": _one(lambda axis, _: [np.abs(axis.speed)]),
    "delay": _delay,
    "lag of the load": _one(lambda axis, load: [np.gradient(load, axis.interval)]),
    "elasticity": _one(lambda axis, load: [np.gradient(np.gradient(load, axis.interval), axis.interval)]),
    "friction over load": _one(lambda axis, load: [axis.direction * np.abs(load)]),
    "inertia over position": _one(lambda axis, _: [axis.acceleration * shape for shape in _shapes(axis)]),
    "inertia over other positions": _coupled_inertia,
    "products of speeds": _products,
    "friction from another axis": _coupled_friction,
    "presliding": _presliding,
    "time": _one(lambda axis, _: _spline(axis.time, np.ones_like(axis.speed), 6)),
    "friction over time": _one(lambda axis, _: _spline(axis.time, axis.direction, 6)),
    "ripple": _ripple,
}
