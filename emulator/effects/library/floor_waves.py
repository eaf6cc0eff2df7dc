"""A floor that goes up and down along x of the world. No model has it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, laws
from emulator.effects.laws import Moment


@dataclass(frozen=True)
class FloorWaves:
    """A floor that goes up and down along x of the world: a force amplitude sin(2 pi x / length) [N, m]."""

    amplitude: float
    length: float = 0.45

    def __call__(self, moment: Moment) -> None:
        """Push the chassis down the wave."""
        (x, _, _), (_, _, qz, qw) = moment.engine.base_pose()
        heading = 2 * math.atan2(qz, qw)
        force = self.amplitude * math.sin(math.tau * x / self.length)
        moment.engine.push((force * math.cos(heading), -force * math.sin(heading), 0.0))


INJECTOR: Final = Injector(
    name="floor_waves",
    places=("chassis",),
    units={"size": "N"},
    inject=laws(lambda _, effect: [FloorWaves(effect["size"])]),
    known=False,
    largest=20.0,
)
