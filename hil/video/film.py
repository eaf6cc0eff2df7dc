"""What a video needs of a drive, noted as it happens: where the vehicle is, and what it is doing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from emulator.as_built import AsBuilt
from emulator.drive import Drive
from emulator.encoder import Encoder
from emulator.engine.protocol import Engine
from emulator.vehicle import EmulatedVehicle

_TOLERANCE: Final = 1e-6
"""Part of the time between two stills by which simulated time may miss one through rounding."""


def _unheard(_done: int, _total: int) -> None:
    """Nobody waits."""


@dataclass
class Caption:
    """What the vehicle is doing, changed by whoever makes it do something else."""

    text: str


@dataclass(frozen=True)
class Video:
    """A video that is asked for.

    Attributes:
        path: to write, of a kind of `hil.video.writing`.
        rate: stills a simulated second.
        caption: of what is seen now.
        drawn: told how many stills are drawn, of how many.
    """

    path: Path
    rate: int
    caption: Caption
    drawn: Callable[[int, int], None] = _unheard


@dataclass(frozen=True)
class Still:
    """The vehicle at one instant.

    Attributes:
        time: simulated [s].
        caption: what it is doing.
        position: of the chassis' centre in the world [m].
        orientation: its quaternion (x, y, z, w).
        angles: (8,) of the joints [rad].
    """

    time: float
    caption: str
    position: tuple[float, ...]
    orientation: tuple[float, ...]
    angles: tuple[float, ...]


class FilmedVehicle:
    """An emulated vehicle that is looked at from time to time; for everybody else it is that vehicle.

    It is read between two steps of the engine and never told anything, so that a drive with a video is the one without.

    Args:
        vehicle: the vehicle; the caller closes it.
        rate: stills a simulated second.
        caption: of what is seen now.

    Attributes:
        drives, encoders: the vehicle's own.
        engine, built: the vehicle's own.
        stills: so far; one at the beginning.
    """

    drives: tuple[Drive, Drive, Drive, Drive]
    encoders: tuple[Encoder, Encoder]

    def __init__(self, vehicle: EmulatedVehicle, rate: int, caption: Caption) -> None:
        self.drives, self.encoders = vehicle.drives, vehicle.encoders
        self.engine: Engine = vehicle.engine
        self.built: AsBuilt = vehicle.built
        self.stills: list[Still] = []
        self._vehicle = vehicle
        self._rate = rate
        self._caption = caption
        self._begin = vehicle.time
        self._look()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._vehicle.time

    def advance(self, duration: float) -> None:
        """Let `duration` [s] pass."""
        self._vehicle.advance(duration)
        if (self._vehicle.time - self._begin) * self._rate + _TOLERANCE >= len(self.stills):
            self._look()

    def lift(self) -> None:
        """Put the vehicle on the jack-stand."""
        self._vehicle.lift()

    def lower(self) -> None:
        """Take the vehicle off the jack-stand."""
        self._vehicle.lower()

    def load(self, mass: float) -> None:
        """Put a load [kg] on the chassis."""
        self._vehicle.load(mass)

    def wet(self, wheel: int, coefficient: float) -> None:
        """Let a wheel roll on ground with another coefficient of friction [-]."""
        self._vehicle.wet(wheel, coefficient)

    def dry(self, wheel: int) -> None:
        """Give a wheel the ground back that it had before."""
        self._vehicle.dry(wheel)

    def _look(self) -> None:
        """Note one still, and the same again for instants that a long advance has passed."""
        engine = self._vehicle.engine
        position, orientation = engine.base_pose()
        still = Still(
            self._vehicle.time, self._caption.text, tuple(position), tuple(orientation), tuple(engine.angles())
        )
        due = int((still.time - self._begin) * self._rate + _TOLERANCE) + 1
        self.stills += [still] * (due - len(self.stills))
