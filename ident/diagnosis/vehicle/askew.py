"""Wheels that stand askew: by how much of it each drive turns aside is decided by the contacts, not by geometry.

Two sides that point to different centres cannot both roll. Where contacts give way in proportion to their slip, the
vehicle takes the middle; where they slide with all their grip any centre between the two balances the forces across
the wheels, and the next smaller moments decide: a side that slides also drags, and turns the vehicle towards itself.
So in one drive it follows the side that is askew and in another the side that is not: of what the middle would be,
it shows twice in one and not at all in the other. Every drive therefore has a share of its own; over driving straight
and turning on the spot, in which the same side drags the other way, shares are one on average.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Candidate, Contribution, Variant
from ident.plant.modes import Mode
from ident.plant.places import STEERING
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

ASKEW: Final = (EffectName.STEERING_OFFSET, EffectName.ELASTICITY, EffectName.BACKLASH)
"""Causes that leave the wheels of a vehicle askew, at the places of `STEERING`."""

SHARE_STD: Final = 1.0
"""Of the share of a drive about one: it is between none and two [-]."""

MEAN_STD: Final = 0.05
"""Of the mean share of driving straight and turning on the spot about one [-].

Dry contacts, integrated for offsets of 1 to 5 mrad of either side and sign and slips from 0.01 to 10 mm/s, have 0.93 to
1.06 (`tests/ident/diagnosis/vehicle/test_shares_of_an_askew_wheel.py`).
"""

MODES: Final = (Mode.STEERED, Mode.ROTATION, Mode.LATERAL)
"""In which wheels roll; the shares of the first two are one on average."""

APART: Final = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
"""How shares of those may be apart."""

RATE: Final = 4.0
"""Rate of the wheels for which their drag is told [rad/s]."""

SLOW: Final = 0.2
"""Rate from which a dry drag is taken to be there where it is first looked for [rad/s]."""

STRAIGHT: Final = 1e-3
"""Bend of a drag below which it is in proportion to the rate [-]."""


@dataclass(frozen=True)
class Travelling:
    """A block of a drive in which wheels roll.

    Attributes:
        mode: number of its mode in `MODES`.
        friction: (N,) what wheels that drag as a friction of 1 Nm at each does in straight drives add to it; None for
            rolling rows.
        rate: (N,) of the wheels in a straight drive in which their axes are as fast [rad/s].
    """

    mode: int
    friction: Array | None
    rate: Array


Blocks = Sequence[Travelling | None]
"""What each block is of drives in which wheels roll; None for others."""


def stands_askew(candidate: Candidate) -> bool:
    """Whether a cause is one of them."""
    return candidate.effect in ASKEW and candidate.where in STEERING


def sliding_aside(mode: Mode, geometry: Geometry) -> float:
    """Speed of the steering axes in a mode, over that at which the contacts roll: wheels turned aside slide with those.

    Contacts stand beside the axes, and roll faster in turns.
    """
    if mode is not Mode.ROTATION:
        return 1.0
    axis = math.hypot(geometry.wheelbase, geometry.track_width) / 2
    return axis / (axis + geometry.wheel_offset)


def with_shares(candidate: Candidate, blocks: Blocks) -> Candidate:
    """A cause that may have a share of its own in the rolling rows of every mode, its wheels then dragging.

    Behind its own numbers come the friction at every wheel that drags as much at `RATE` [Nm], how it bends up to that
    [-], and by how much the share of every mode is above one.
    """
    own = _width(candidate.variants[-1])
    return replace(
        candidate,
        variants=(*candidate.variants, _shared(candidate.variants[-1], blocks)),
        contribution=_contribution(candidate, own, blocks),
        expected=lambda values: _expected(values[own + 2 :]),
        own=own,
    )


def _width(variant: Variant) -> int:
    """Columns of a variant, whether or not these records show any: its own, and what comes along."""
    return 1 + variant.beside


def _shared(variant: Variant, blocks: Blocks) -> Variant:
    """Its columns; what drags, at any rate and by the rate; how the first column is apart between the modes."""
    own = _width(variant)
    start = variant.start or (lambda found: found)

    def numbers(found: Array) -> Array:
        itself, line, apart = found[:own], found[own : own + 2], found[own + 2 :]
        above = APART @ apart / itself[0] if itself[0] else np.zeros(len(MODES))
        return np.concatenate([start(itself), _bent(*line.tolist()), above])

    columns = [_joined(column, block, own) for column, block in zip(variant.columns, blocks, strict=True)]
    return Variant(tuple(columns), numbers, beside=variant.beside + 2 + APART.shape[1], itself=False)


def _bent(dry: float, viscous: float) -> Array:
    """Drag and bend that are about a line over the rate."""
    drag = dry + viscous * RATE
    part = float(np.clip(viscous * RATE / drag, 0.0, 1.0)) if drag else 0.0
    return np.array([drag, RATE / (SLOW + 2 * part * RATE)])


def _joined(column: Array | None, block: Travelling | None, own: int) -> Array | None:
    there = column if column is not None or block is None else block.friction
    if there is None:
        return None
    joined = np.zeros((len(there), own + 2 + APART.shape[1]))
    if column is not None:
        joined[:, :own] = column
    if block is None:
        return joined
    if block.friction is not None:
        joined[:, own : own + 2] = block.friction[:, None] * np.stack([np.ones_like(block.rate), block.rate], axis=1)
    elif column is not None:
        joined[:, own + 2 :] = column[:, :1] * APART[block.mode]
    return joined


def _contribution(candidate: Candidate, own: int, blocks: Blocks) -> Contribution:
    exact = candidate.contribution or _linear(candidate.variants[0])

    def contribution(values: Array, parameters: Array) -> Sequence[Array | None]:
        found, along = exact(values[:own], parameters), values[own:]
        if not len(along):
            return found
        return [_with_share(series, block, along) for series, block in zip(found, blocks, strict=True)]

    return contribution


def _linear(variant: Variant) -> Callable[[Array, Array], Sequence[Array | None]]:
    return lambda values, _: [None if column is None else column @ values for column in variant.columns]


def _with_share(series: Array | None, block: Travelling | None, along: Array) -> Array | None:
    drag, bend, *above = (float(number) for number in along)
    if block is None:
        return series
    if block.friction is None:
        return None if series is None else (1 + above[block.mode]) * series
    bend = max(abs(bend), STRAIGHT)
    dragged = drag / math.tanh(bend) * block.friction * np.tanh(bend * block.rate / RATE)
    return dragged if series is None else series + dragged


def _expected(above: Array) -> Array:
    """How far shares are from one, in standard deviations."""
    if not len(above):
        return np.zeros(0)
    return np.append(above / SHARE_STD, above[:2].mean() / MEAN_STD)
