"""Short runs of a simulator, each from the recorded state, and how far their motion is from the recorded one.

A simulator that is given recorded torques drifts: an error of a torque adds up in the speed, and so does the load that
fluctuates and that no record has. So it is set back to what was recorded at the begin of every window.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.signals import Signals, signals_of
from ident.errors import RecordError
from ident.estimate.equations import ROWS, RowsOfStep
from ident.estimate.filters import Processing, differentiate, zero_phase
from ident.plant import kinematics
from ident.records.record import Record, Segment, base_step
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

WINDOW: Final = 1.0
"""Time that the simulator runs before it is set back [s]; windows divide a repeat evenly, so they are about as long."""

ANGLES: Final = ("alpha_l", "alpha_r")
"""Coordinates that are compared as angles; all others as speeds."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Stretches of one segment, all of one length, at the same places in every repeat of the excitation.

    Attributes:
        signals: of the whole segment, smoothed.
        spec: of its step.
        coordinates: that it drives.
        starts: (W,) first samples.
        length: samples of each.
        repeat: (W,) number of the repeat, -1 where nothing repeats.
        place: (W,) number of the window within its repeat.
    """

    signals: Signals
    spec: RowsOfStep
    coordinates: tuple[str, ...]
    starts: Numbers
    length: int
    repeat: Numbers
    place: Numbers

    @property
    def segment(self) -> Segment:
        """As it was recorded."""
        return self.signals.segment

    @property
    def samples(self) -> Numbers:
        """(W, T) of the segment."""
        return self.starts[:, None] + np.arange(self.length)

    @property
    def lifted(self) -> bool:
        """Whether the wheels are in the air."""
        return self.spec.mode is None


@dataclass(frozen=True, eq=False)
class Difference:
    """Simulated minus recorded motion of one coordinate of one segment.

    Attributes:
        step, coordinate: which.
        unit: rad, rad/s or m/s.
        time: (W, T) in the segment [s].
        recorded, simulated: (W, T).
        repeat, place: (W,) as of the windows.
    """

    step: str
    coordinate: str
    unit: str
    time: Array
    recorded: Array
    simulated: Array
    repeat: Numbers
    place: Numbers

    @property
    def folded(self) -> Array:
        """Simulated minus recorded (P, N) by repeats; P = 1 where nothing repeats."""
        return self.by_repeats(self.simulated - self.recorded)

    def by_repeats(self, values: Array) -> Array:
        """Values (W, T) as (P, N), those places that every repeat has."""
        numbers = np.unique(self.repeat)
        places = [set(self.place[self.repeat == number].tolist()) for number in numbers]
        shared = list(set.intersection(*places))
        return np.stack([values[(self.repeat == number) & np.isin(self.place, shared)].ravel() for number in numbers])


def windows_of(record: Record, geometry: Geometry, processing: Processing, window: float = WINDOW) -> list[Windows]:
    """Windows of every step that drives a coordinate.

    Args:
        record: of the vehicle.
        geometry: its lengths.
        processing: filters.
        window: about how long each is [s].

    Raises:
        RecordError: it holds no such step, or is sampled too slowly.
    """
    found = []
    for signals in signals_of(record, geometry, processing):
        base = base_step(signals.segment.step)
        spec = None if base is None else ROWS.get(base)
        if spec is not None and (made := _windows(signals, spec, window)) is not None:
            found.append(made)
    if not found:
        raise RecordError(f"{record.source} has no step to simulate.", f"Record one of: {', '.join(ROWS)}.")
    return found


def _windows(signals: Signals, spec: RowsOfStep, window: float) -> Windows | None:
    segment = signals.segment
    stretches = [np.flatnonzero(segment.period == number) for number in segment.periods]
    # Where the master left out a cycle, samples of a repeat are not next to each other.
    whole = [samples for samples in stretches if len(samples) == samples[-1] - samples[0] + 1]
    numbers = [int(segment.period[samples[0]]) for samples in whole]
    if not whole:
        whole, numbers = [np.arange(len(segment))], [-1]
    shortest = min(map(len, whole))
    count = max(1, round(shortest * segment.sample_time / window))
    length = shortest // count
    if length < _SHORTEST:
        return None
    starts = np.array([int(samples[0]) + place * length for samples in whole for place in range(count)])
    repeat = np.repeat(np.array(numbers, dtype=np.int64), count)
    place = np.tile(np.arange(count), len(whole))
    return Windows(signals, spec, _coordinates(spec), starts, length, repeat, place)


_SHORTEST: Final = 50
"""Samples of a window from which its motion can be filtered."""


def _coordinates(spec: RowsOfStep) -> tuple[str, ...]:
    """What is compared: the coordinates of the rows, a virtual steering angle by those of the two sides."""
    return tuple(name for own in spec.coordinates for name in (ANGLES if own == "alpha_v" else (own,)))


def differences_of(windows: Windows, simulated: Array, geometry: Geometry, processing: Processing) -> list[Difference]:
    """What a simulator is off by, of each coordinate that the step drives.

    Args:
        windows: that it ran through.
        simulated: (W, T, 6) readings: alpha left, right, beta fl, rl, fr, rr [rad].
        geometry: for odometry.
        processing: its `cutoff` is that of the comparison.
    """
    segment, signals, samples = windows.segment, windows.signals, windows.samples
    measured = np.hstack([segment.steering_angles, segment.wheel_angles])[samples]
    dt = segment.sample_time
    # Recorded and simulated motion are close: their difference is filtered, which has no jumps at a window's ends.
    off = np.swapaxes(zero_phase(np.swapaxes(simulated - measured, 0, 1), processing.cutoff, dt), 0, 1)
    rates = differentiate(np.swapaxes(off, 0, 1), dt).swapaxes(0, 1)
    alpha = signals.alpha[samples]
    recorded = np.concatenate([signals.alpha_rate[samples], signals.beta_rate[samples]], axis=-1)
    own, extra = (_motion(alpha, angles, speeds, geometry) for angles, speeds in ((alpha, recorded), (off, rates)))
    return [
        Difference(
            segment.step,
            name,
            _UNITS.get(name, "rad/s"),
            segment.time[samples] - segment.time[0],
            own[name],
            own[name] + extra[name],
            windows.repeat,
            windows.place,
        )
        for name in windows.coordinates
    ]


_UNITS: Final = {"x": "m/s", "y": "m/s", **dict.fromkeys(ANGLES, "rad")}


def _motion(alpha: Array, angles: Array, rates: Array, geometry: Geometry) -> dict[str, Array]:
    """Every coordinate (W, T) by name: steering as it is in `angles` (W, T, 2 or more), the rest by `rates` (W, T, 6).

    Odometry is linear in the rates, so it also takes differences of rates to differences of twists.
    """
    flat = rates.reshape(-1, 6)
    twist = kinematics.odometry(alpha.reshape(-1, 2), flat[:, :2], flat[:, 2:], geometry).reshape(*alpha.shape[:2], 3)
    wheels = {f"beta_{wheel}": rates[..., 2 + index] for index, wheel in enumerate(WHEELS)}
    steering = {name: angles[..., index] for index, name in enumerate(ANGLES)}
    return {**steering, **wheels, **{name: twist[..., index] for index, name in enumerate(("x", "y", "gamma"))}}


Simulate = Callable[[Windows], Array]
"""Readings (W, T, 6) of a simulator in the windows of a segment."""


def shoot(
    windows: Sequence[Windows], simulate: Simulate, geometry: Geometry, processing: Processing
) -> list[Difference]:
    """Differences of all segments."""
    return [difference for one in windows for difference in differences_of(one, simulate(one), geometry, processing)]
