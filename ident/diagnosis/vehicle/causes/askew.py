"""Wheels that stand askew: how much of it each kind of drive shows is decided by the contacts, not by geometry.

Two sides that point to different centres cannot both roll. Where contacts give way in proportion to their slip, the
vehicle takes the middle; where they slide with all their grip any centre between the two balances the forces across
the wheels, and the next smaller moments decide: a side that slides also drags, and turns the vehicle towards itself.
So in one drive it follows the side that is askew and in another the side that is not: of what the middle would be,
it shows twice in one and not at all in the other. Every kind of drive therefore has a share of its own; over driving
straight and turning on the spot, in which the same side drags the other way, shares are one on average.

No contact is all dry: up to some speed of sliding it creeps, so every vehicle that drives slowly takes the middle.
What a share adds to the middle begins there, and lacks some speed beyond it, against the share.

That is so of an angle that stays. What a coupling gives way by follows the traction, and has no share; but the wheel
behind it drags as well, by the grip of the ground times the angle by which it stands askew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Candidate, Contribution, Variant
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

SHARE_STD: Final = 1.0
"""Of the share of a kind of drive about one: it is between none and two [-]."""

ADHESION: Final = 0.5
"""Of the friction of the floor, and its deviation: what wheels that slide aside drag with is between none of it and dry
concrete's [-]."""

MEAN_STD: Final = 0.1
"""Of the mean share of driving straight and turning on the spot about one [-].

Dry contacts, integrated for offsets of 1 to 5 mrad of either side and sign and slips from 0.01 to 10 mm/s, have 0.93 to
1.06 (`tests/ident/diagnosis/vehicle/causes/test_shares_of_an_askew_wheel.py`); five offsets in MuJoCo, at speeds at
which contacts do not creep, 0.84 to 0.91.
"""

LACKING_STD: Final = 5e-4
"""Of the speed that what a share adds lacks, because contacts that slide aside creep at first [m/s].

Dry contacts, integrated as for `MEAN_STD`, lack 0.1 mm/s where they slip by 0.01, and 0.9 where they slip by 0.05; from
0.1 on vehicles take the middle anyway.
"""

MODES: Final = (Mode.STEERED, Mode.ROTATION, Mode.LATERAL)
"""In which wheels roll; the shares of the first two are one on average."""

APART: Final = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
"""How shares of those may be apart."""

RATE: Final = 4.0
"""Rate of the wheels for which their drag is told [rad/s]."""

SLOW: Final = 0.2
"""Rate from which a dry drag, or what a share lacks, is taken to be there where it is first looked for [rad/s]."""

NONE: Final = float(np.finfo(float).eps)
"""Of an offset, or of the bend of a drag, which is in proportion to the rate then: not zero, to divide by."""


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


def sliding_aside(mode: Mode | None, geometry: Geometry) -> float:
    """Speed of the steering axes in a mode, over that at which the contacts roll: wheels turned aside slide with those.

    Contacts stand beside the axes, and roll faster in turns.
    """
    if mode is not Mode.ROTATION:
        return 1.0
    axis = math.hypot(geometry.wheelbase, geometry.track_width) / 2
    return axis / (axis + geometry.wheel_offset)


def with_shares(candidate: Candidate, blocks: Blocks, dragging: float) -> Candidate:
    """An offset of the steering that may have a share in the rolling rows of every mode, its wheels then dragging.

    Behind the offset come the friction at every wheel that drags as much at `RATE` [Nm], how it bends up to that [-],
    the speed that every mode lacks beyond creeping [m/s], and by how much its share is above one.

    Args:
        candidate: linear in its one number.
        blocks: of the drives.
        dragging: friction at every wheel that drags as wheels do on a floor of unit friction, by the offset [Nm/rad].
    """
    (plain,) = candidate.variants
    return replace(
        candidate,
        variants=(plain, _shared(plain, blocks)),
        contribution=_contribution(plain, blocks),
        expected=lambda values: _expected(values, dragging),
    )


def _shared(variant: Variant, blocks: Blocks) -> Variant:
    """Its column; what drags, at any rate and by the rate; how the column is apart between the modes."""
    if all(column is None for column in variant.columns):
        return variant

    def numbers(found: Array) -> Array:
        offset, line, lacking, apart = found[0], found[1:3], found[3 : 3 + len(MODES)], found[3 + len(MODES) :]
        above = APART @ apart / offset if offset else np.zeros(len(MODES))
        return np.concatenate([[offset], _bent(*line.tolist()), lacking, above])

    columns = [_joined(column, block) for column, block in zip(variant.columns, blocks, strict=True)]
    return Variant(tuple(columns), numbers, beside=2 + sum(APART.shape), itself=False)


def _bent(dry: float, viscous: float) -> Array:
    """Drag and bend that are about a line over the rate."""
    drag = dry + viscous * RATE
    part = float(np.clip(viscous * RATE / drag, 0.0, 1.0)) if drag else 0.0
    return np.array([drag, RATE / (SLOW + 2 * part * RATE)])


def _joined(column: Array | None, block: Travelling | None) -> Array | None:
    there = column if column is not None or block is None else block.friction
    if there is None:
        return None
    joined = np.zeros((len(there), 3 + sum(APART.shape)))
    if column is not None:
        joined[:, :1] = column
    if block is None:
        return joined
    if block.friction is not None:
        joined[:, 1:3] = block.friction[:, None] * np.stack([np.ones_like(block.rate), block.rate], axis=1)
    elif column is not None:
        joined[:, 3 + block.mode] = -beyond_creeping(column[:, 0], block.rate)
        joined[:, 3 + len(MODES) :] = column * APART[block.mode]
    return joined


def _contribution(variant: Variant, blocks: Blocks) -> Contribution:
    directions = [
        None if column is None or block is None else beyond_creeping(column[:, 0], block.rate)
        for column, block in zip(variant.columns, blocks, strict=True)
    ]

    def contribution(values: Array, _parameters: Array) -> Sequence[Array | None]:
        found = [None if column is None else values[0] * column[:, 0] for column in variant.columns]
        if len(values) == 1:
            return found
        every = zip(found, directions, blocks, strict=True)
        return [_with_share(series, direction, block, values[1:]) for series, direction, block in every]

    return contribution


def _with_share(series: Array | None, direction: Array | None, block: Travelling | None, along: Array) -> Array | None:
    drag, bend = (float(number) for number in along[:2])
    if block is None:
        return series
    if block.friction is None:
        lacking, above = along[2:].reshape(2, -1)[:, block.mode]
        return None if series is None or direction is None else (1 + above) * series - lacking * direction
    bend = max(abs(bend), NONE)
    dragged = drag / math.tanh(bend) * block.friction * np.tanh(bend * block.rate / RATE)
    return dragged if series is None else series + dragged


def beyond_creeping(shown: Array, rate: Array) -> Array:
    """The direction (N,) of what a vehicle shows, where its wheels are faster than contacts creep; `rate` is theirs."""
    return np.asarray(np.tanh(shown * rms(rate) / (SLOW * max(rms(shown), NONE))))


def _expected(values: Array, dragging: float) -> Array:
    """How far a drag is from what wheels at that angle drag, what is lacking from none and shares from one."""
    if len(values) == 1:
        return np.zeros(0)
    offset, drag, (lacking, above) = float(values[0]), float(values[1]), values[3:].reshape(2, -1)
    beyond = _beyond_expected(drag, offset, dragging)
    return np.concatenate([[beyond], lacking / LACKING_STD, above / SHARE_STD, [above[:2].mean() / MEAN_STD]])


def _beyond_expected(drag: float, angle: float, dragging: float) -> float:
    """How far a drag is from that of wheels at an angle, in standard deviations, which are as large as it."""
    return drag / (ADHESION * dragging * max(abs(angle), NONE)) - 1


def with_drag(candidate: Candidate, dragging: float) -> Candidate:
    """A coupling that gives way, whose rear wheel then drags.

    The friction of that wheel, over the torque that the coupling passes on [-], comes behind the compliance.

    Args:
        candidate: of these two numbers.
        dragging: friction of a wheel that drags on a floor of unit friction, by the angle [Nm/rad].
    """

    def expected(values: Array) -> Array:
        if len(values) == 1:
            return np.zeros(0)
        compliance, drag = values.tolist()
        return np.array([_beyond_expected(drag, compliance, dragging)])

    return replace(candidate, expected=expected)
