"""Curves of the last seconds: torques, speeds, errors, steering, bus."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import viser

from hil.page.shown import Sketch, Snapshot

SPAN: Final = 20.0
"""Simulated time that is shown [s]."""

_POINTS: Final = 600
"""Most points of a curve."""

_COLOURS: Final = ("#1971c2", "#e8590c", "#2f9e44", "#9c36b5", "#c2255c", "#0c8599")
_LOAD_WINDOW: Final = 0.2
"""Least simulated time over which the load of the bus is taken [s]."""

Values = Callable[[Snapshot], Sequence[float]]


@dataclass(frozen=True)
class Curves:
    """One plot: what its vertical axis is called, unit included, its curves, and where their values come from."""

    title: str
    axis: str
    names: tuple[str, ...]
    values: Values
    height: int = 150


def _plots(sketch: Sketch) -> tuple[Curves, ...]:
    drives = tuple(name for name, _ in sketch.drives)
    encoders = tuple(name for name, _ in sketch.encoders)
    return (
        Curves("Motor torque, 6077h", "Nm", drives, lambda now: [drive.torque for drive in now.drives]),
        Curves(
            "Torque error: demand 6074h less actual 6077h",
            "Nm",
            drives,
            lambda now: [drive.asked - drive.torque for drive in now.drives],
        ),
        Curves("Wheel speed, 606Ch", "rad/s", drives, lambda now: [drive.speed for drive in now.drives]),
        Curves(
            "Steering angle, 6004h", "deg", encoders, lambda now: [math.degrees(one.angle) for one in now.encoders], 130
        ),
        Curves(
            "Encoder error: reading less true axis",
            "mdeg",
            encoders,
            lambda now: [1e3 * math.degrees(one.error) for one in now.encoders],
            130,
        ),
        Curves(
            "Following error 60F4h at the wheel (position modes)",
            "deg",
            drives,
            lambda now: [math.degrees(drive.position_error) for drive in now.drives],
        ),
    )


class BusLoadMeter:
    """Load of the bus over the last moments of simulated time.

    Args:
        bit_rate: [bit/s].
    """

    def __init__(self, bit_rate: float) -> None:
        self._bit_rate = bit_rate
        self._seen: deque[tuple[float, tuple[int, int]]] = deque()
        self.load = (0.0, 0.0)

    def take(self, snapshot: Snapshot) -> None:
        """Look at the bits so far."""
        seen = self._seen
        seen.append((snapshot.time, snapshot.bus.bits))
        while len(seen) > 2 and seen[1][0] <= snapshot.time - _LOAD_WINDOW:
            seen.popleft()
        (begin, (least, most)), (end, (least_now, most_now)) = seen[0], seen[-1]
        if end > begin:
            capacity = self._bit_rate * (end - begin)
            self.load = (least_now - least) / capacity, (most_now - most) / capacity


class Plots:
    """All curves, in the container that is open when this is made."""

    def __init__(self, server: viser.ViserServer, sketch: Sketch) -> None:
        self.meter = BusLoadMeter(sketch.bit_rate)
        bus = Curves("Bus load, without and with all stuff bits", "%", ("least", "most"), lambda _: self._load(), 120)
        self._curves = (*_plots(sketch), bus)
        rows = 1 + sum(len(one.names) for one in self._curves)
        self._history: deque[tuple[float, ...]] = deque(maxlen=_POINTS)
        self._rows = rows
        self._handles = [_add(server, one) for one in self._curves]

    def take(self, snapshot: Snapshot) -> None:
        """Note one look. Where simulated time has gone back, something else is shown now."""
        if self._history and snapshot.time < self._history[-1][0]:
            self._history.clear()
        self.meter.take(snapshot)
        row = [snapshot.time]
        for one in self._curves:
            row += one.values(snapshot)
        self._history.append(tuple(row))
        while snapshot.time - self._history[0][0] > SPAN:
            self._history.popleft()

    def draw(self) -> None:
        """Draw what was noted."""
        if len(self._history) < 2:
            return
        table = np.array(self._history).T
        first = 1
        for one, handle in zip(self._curves, self._handles, strict=True):
            handle.data = (table[0], *table[first : first + len(one.names)])
            first += len(one.names)

    def _load(self) -> tuple[float, ...]:
        return tuple(100 * share for share in self.meter.load)


def _add(server: viser.ViserServer, curves: Curves) -> viser.GuiUplotHandle:
    empty = np.array([0.0, 1.0])
    series: tuple[Any, ...] = (
        {"label": "t [s]"},
        *(
            {"label": name, "stroke": colour, "width": 1.5}
            for name, colour in zip(curves.names, _COLOURS, strict=False)
        ),
    )
    axes: tuple[Any, ...] = ({"size": 28}, {"label": curves.axis, "labelSize": 18, "size": 46})
    return server.gui.add_uplot(
        (empty, *(np.full(2, np.nan) for _ in curves.names)),
        series,
        title=curves.title,
        scales={"x": {"time": False}},
        axes=axes,
        legend={"show": True, "live": False},
        height=curves.height,
    )
