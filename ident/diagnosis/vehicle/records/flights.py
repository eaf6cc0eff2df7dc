"""A motor in the play of its gear: how far it moves above the band, flights from flank to flank included.

A contact is a spring, so that x, what a motor is turned beyond its wheel, tells the load, and not the load x, which in
flight is anywhere: with the half play h and the compliance c of the flanks

    c load = x - clip(x, -h, h).

x = x_s + x_f has a fast part, which is measured, and a slow one, which is not: wheels slide. x_s is where the flanks
carry the slow load, by the describing function of a sinusoid with an offset (Gelb and Vander Velde 1968, chapter 6),
then in time, harmonics included. What the flanks carry of x_f against what the gear has carried is what the sizes miss:

    x_f - twist = (load_f(x) - load_f) / |N / c, l / |x_f||,

N being the part of the flanks' stiffness that the motion meets, and l a load of which nothing is said. So the twist is
x_f where both loads agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.rattling import LEAST, above_band

Array = NDArray[np.float64]

NEWTON_STEPS: Final = 20
"""That find where flanks carry a load; at worst each halves what is left."""

SETTLED: Final = 1e-6
"""What they may miss of it, in units of the swing [-]."""

REFINEMENTS: Final = 4
"""The same in time, from there."""

STIFFEST: Final = 1e-6
"""Compliance of flanks at least [rad/Nm], a fiftieth of the emulator's: a descent may ask for none, or less."""

LEAST_TIME: Final = 0.1
"""Part of the time on a flank that a refinement counts on: with less, harmonics make it go too far [-]."""


@dataclass(frozen=True)
class Shaken:
    """How a motor moves that rattles.

    Attributes:
        moved: beyond its wheel, above the band (N,) [rad].
        swing: amplitude of that (N,) [rad].
        load: of its gear (N,) [Nm].
        unsure: load below which nothing is said of what carries it [Nm].
        sample_time: [s].
    """

    moved: Array
    swing: Array
    load: Array
    unsure: float
    sample_time: float


def twist_in_flight(shaken: Shaken, gap: float, compliance: float) -> Array:
    """How far the motor is beyond its wheel, above the band (N,) [rad].

    Args:
        shaken: how it moves.
        gap: whole play, at the wheel; zero where it is less [rad].
        compliance: of the flanks, taken for `STIFFEST` where it is less [rad/Nm].
    """

    def fast(values: Array) -> Array:
        return above_band(values, shaken.sample_time)

    half, compliance, carried_fast = max(gap, 0.0) / 2, max(compliance, STIFFEST), fast(shaken.load)
    slow, swing = compliance * (shaken.load - carried_fast), np.maximum(shaken.swing, LEAST)
    # The band takes some of the swing itself: what it takes of what is left is nearly that.
    angle = 2 * shaken.moved - fast(shaken.moved)
    offset = _offset(slow, swing, half)
    touching = np.maximum(_both(offset, swing, half).touching, LEAST_TIME)
    for _ in range(REFINEMENTS):
        beyond = _beyond(offset + angle, half)
        offset = offset + (slow - (beyond - fast(beyond))) / touching
    missed = fast(_beyond(offset + angle, half)) / compliance - carried_fast
    stiffness = np.hypot(_both(offset, swing, half).first / compliance, shaken.unsure / swing)
    return np.asarray(shaken.moved - missed / stiffness)


def _beyond(angle: Array, half: float) -> Array:
    return np.asarray(angle - np.clip(angle, -half, half))


def _offset(slow: Array, swing: Array, half: float) -> Array:
    """x_s (N,) at which a sinusoid around it is beyond the flanks by `slow` in the mean [rad].

    Newton, and halving where that leaves what encloses the root; only what has not settled goes on.
    """
    high = half + swing + np.abs(slow)
    low, found = -high, slow + half * np.sign(slow)
    left = np.arange(len(slow))
    for _ in range(NEWTON_STEPS):
        now, wide = found[left], swing[left]
        both = _both(now, wide, half)
        missing = wide * both.mean - slow[left]
        low[left], high[left] = np.where(missing < 0, now, low[left]), np.where(missing < 0, high[left], now)
        better = now - missing / np.maximum(both.touching, np.finfo(float).tiny)
        inside = (better >= low[left]) & (better <= high[left])
        found[left] = np.where(inside, better, (low[left] + high[left]) / 2)
        left = left[np.abs(missing) > SETTLED * wide]
        if not left.size:
            break
    return np.asarray(found)


@dataclass(frozen=True)
class _Ramp:
    """What a flank makes of a sinusoid of amplitude one.

    Attributes:
        mean, first: mean, and first harmonic, of what is beyond it (N,).
        touching: part of the time that anything is (N,), the derivative of the mean by an offset.
    """

    mean: Array
    first: Array
    touching: Array


def _both(offset: Array, swing: Array, half: float) -> _Ramp:
    """Of both flanks, around an offset (N,): the load of one is against that of the other, their stiffness adds up."""
    ahead, behind = _ramp((half - offset) / swing), _ramp((half + offset) / swing)
    return _Ramp(ahead.mean - behind.mean, ahead.first + behind.first, ahead.touching + behind.touching)


def _ramp(edge: Array) -> _Ramp:
    """Of max(sin φ - edge, 0)."""
    bent = np.clip(edge, -1.0, 1.0)
    angle, height = np.arccos(bent), np.sqrt(1 - bent**2)
    mean = np.where(edge <= -1, -edge, (height - bent * angle) / math.pi)
    return _Ramp(mean, (angle - bent * height) / math.pi, angle / math.pi)
