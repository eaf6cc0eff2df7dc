"""What one sees of the vehicle, in every engine: shapes that touch nothing and weigh nothing.

The body is a slab between the wheels, half as high as it is, a stripe across its front, and one beam an axle out to the
steering axes: so wheels and steering units show from above, too. A steering unit is a post with an arm to its wheel and
a pointer to where the wheel heads; a wheel has a bar from its hub over the tread.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from emulator.as_built import WheelBuild
from emulator.engine.layout import END_SIGN, Vector, axle, tyre_centre
from emulator.prototype import Prototype

BODY_COLOUR: Final = (0.85, 0.45, 0.10)
FRONT_COLOUR: Final = (0.97, 0.93, 0.86)
BEAM_COLOUR: Final = (0.45, 0.47, 0.50)
KNUCKLE_COLOUR: Final = (0.10, 0.38, 0.80)
TYRE_COLOUR: Final = (0.13, 0.13, 0.14)
MARK_COLOUR: Final = (1.00, 0.90, 0.10)
"""Of the bar that shows how a wheel turns."""

TYRE_WIDTH_RATIO: Final = 0.5
"""Width of the tyre that one sees over the wheel radius."""

_CLEAR: Final = 1.1
"""Height of the body's underside above the axles, over the wheel radius: wheels turn below it."""


class Kind(enum.StrEnum):
    """What shapes there are."""

    BOX = "box"
    CYLINDER = "cylinder"


@dataclass(frozen=True)
class Shape:
    """A coloured solid in the frame of its body.

    Attributes:
        kind: of solid.
        half: half of the extents along x, y, z [m]; of a cylinder those of the box around it.
        centre: [m].
        colour: red, green, blue, 0 to 1.
        lying: a cylinder's axis is y, otherwise z.
    """

    kind: Kind
    half: Vector
    centre: Vector
    colour: Vector
    lying: bool = False

    @property
    def radius(self) -> float:
        """Of a cylinder [m]."""
        return self.half[0]

    @property
    def half_length(self) -> float:
        """Of a cylinder, along its axis [m]."""
        return self.half[1] if self.lying else self.half[2]


def chassis_shapes(prototype: Prototype) -> Iterator[Shape]:
    """Slab, stripe at its front, and a beam an axle, in the chassis frame; its mass is elsewhere."""
    geometry, body = prototype.geometry, prototype.body
    radius = geometry.wheel_radius
    half_length, half_width = body.length / 2, max(geometry.track_width / 2 - 1.6 * radius, geometry.track_width / 8)
    beam, half_height = radius / 6, body.height / 4
    underside = (1 + _CLEAR) * radius - body.centre_height
    middle = underside + half_height
    yield Shape(Kind.BOX, (half_length, half_width, half_height), (0.0, 0.0, middle), BODY_COLOUR)
    stripe = (half_length / 16, 1.01 * half_width, 1.02 * half_height)
    yield Shape(Kind.BOX, stripe, (0.85 * half_length, 0.0, middle), FRONT_COLOUR)
    for end in sorted(set(END_SIGN.values())):
        place = (end * geometry.wheelbase / 2, 0.0, underside + beam)
        yield Shape(Kind.BOX, (1.5 * beam, geometry.track_width / 2, beam), place, BEAM_COLOUR)


def knuckle_shapes(prototype: Prototype, wheel: str, build: WheelBuild) -> Iterator[Shape]:
    """Post on the steering axis, arm to the wheel, pointer forward on top, in the frame of the knuckle."""
    radius = prototype.geometry.wheel_radius
    _, aside, above = axle(prototype, wheel, build)
    top = (_CLEAR + 0.45) * radius
    post = radius / 4
    yield Shape(Kind.CYLINDER, (post, post, (top + post) / 2), (0.0, 0.0, (top - post) / 2), KNUCKLE_COLOUR)
    yield Shape(Kind.BOX, (radius / 7, abs(aside) / 2, radius / 7), (0.0, aside / 2, above), KNUCKLE_COLOUR)
    yield Shape(Kind.BOX, (0.6 * radius, radius / 6, radius / 10), (0.5 * radius, 0.0, top), KNUCKLE_COLOUR)


def wheel_shapes(prototype: Prototype, build: WheelBuild) -> Iterator[Shape]:
    """Tyre, and the bar over both of its sides and the tread, in the frame of the wheel."""
    half_width = TYRE_WIDTH_RATIO * prototype.geometry.wheel_radius / 2
    x, y, z = tyre_centre(build)
    yield Shape(Kind.CYLINDER, (build.radius, half_width, build.radius), (x, y, z), TYRE_COLOUR, lying=True)
    bar = (build.radius / 6, 1.04 * half_width, 0.51 * build.radius)
    yield Shape(Kind.BOX, bar, (x, y, z + build.radius / 2), MARK_COLOUR)
