"""Drives whose torque follows the one reported as a filter of first order does.

    T ẏ = u - y,    as the equations have it:  τ ẏ = u - y,  y′ = u - T/τ (u - y),  τ = sqrt(T² + δ²)

y′ acts. δ keeps ẏ finite for T = 0, where the torque passes as it is; at low frequencies y′ is T late in any case.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy import signal

from ident.plant.memories import Memories
from ident.plant.places import DRIVES
from ident.plant.symbolic import Expression
from ident.plant.symbols import Symbols
from ident.plant.terms import Term, lag_at
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

_SHORTEST: Final = 1e-4
"""δ [s]."""


def following_torques(x: Symbols, terms: Sequence[Term], memories: Memories, torques: Expression) -> Expression:
    """Torques (4,) that act [Nm], from those that the filters are asked for."""
    following = ca.SX(torques)
    for wheel in memories.lags:
        time = lag_at(terms, DRIVES[wheel])
        following[wheel] -= time / _constant(time) * (torques[wheel] - x[f"following_torque_{WHEELS[wheel]}"])
    return following


def following_rates(x: Symbols, terms: Sequence[Term], memories: Memories, torques: Expression) -> Expression:
    """ẏ (n,) [Nm/s] from the torques (4,) that the filters are asked for [Nm]."""
    return ca.vertcat(
        *(
            (torques[wheel] - x[f"following_torque_{WHEELS[wheel]}"]) / _constant(lag_at(terms, DRIVES[wheel]))
            for wheel in memories.lags
        )
    )


def following(values: Array, time: float, sample_time: float) -> Array:
    """A series (N,), linear between its samples, behind such a filter, which has settled at its first value.

    Args:
        values: at the input.
        time: T [s].
        sample_time: [s].
    """
    if time <= 0:
        return values
    kept = float(np.exp(-sample_time / time))
    ahead = 1 - time / sample_time * (1 - kept)
    before = 1 - kept - ahead
    found, _ = signal.lfilter([ahead, before], [1, -kept], values, zi=[(1 - ahead) * values[0]])
    return np.asarray(found)


def late_series(torques: Array, delays: Array, lags: Array, sample_time: float) -> Array:
    """Torques (R, T, 4) of R runs as they act, behind dead times and filters (4,) [s], settled at the start."""
    if not (delays.any() or lags.any()):
        return torques
    time = np.arange(torques.shape[1]) * sample_time
    late = torques.copy()
    for wheel, (delay, lag) in enumerate(zip(delays, lags, strict=True)):
        for run in range(len(torques)):
            delayed = np.interp(time - delay, time, torques[run, :, wheel])
            late[run, :, wheel] = following(delayed, lag, sample_time)
    return late


def _constant(time: Expression) -> Expression:
    return ca.sqrt(time**2 + _SHORTEST**2)
