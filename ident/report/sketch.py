"""The vehicle from above, or axes from the side, with the places of causes marked: inline SVG, colours by CSS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from markupsafe import Markup

from ident.diagnosis.diagnosis import NamedEffect
from ident.plant.places import CHASSIS, DRIVES, ENCODERS, OF_PARAMETERS, STEERING, WHEEL_PLACES, members
from ident.report.digits import plain, value_text
from ident.report.headline import place_words
from ident.report.law_text import swing_text
from ident.vehicle.geometry import WHEELS, Geometry

LENGTH: Final = 250.0
"""Of the vehicle, wheels included; the unit of all numbers here is a pixel of a screen that shows it at full size."""

MARGIN: Final = 128.0
"""Beside it, for the words."""

USUAL: Final = Geometry(wheelbase=1.2, track_width=0.8, wheel_offset=0.12, wheel_radius=0.1, gear_ratio=20.0)
"""Proportions where those of the vehicle are not at hand."""

LINE: Final = 15.0
"""Between lines of words."""

LINES: Final = 3.2
"""That the words of one cause take."""

ROW: Final = 60.0
"""Between axes."""

_SIDES: Final = MappingProxyType({"fl": (-1, -1), "rl": (-1, 1), "fr": (1, -1), "rr": (1, 1)})
"""Of the wheels: right and down."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Mark:
    """A cause as the sketch shows it.

    Attributes:
        number: that stands at its place, and before it in the list of causes.
        where: place of the vehicle, parameter of its model, or axis.
        words: short lines, of what it is.
    """

    number: int
    where: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class _Part:
    """A part of the drawing: its shapes, and where number and words of a cause stand.

    Attributes:
        shapes: elements of SVG.
        x, y: of the number.
        side: -1 for words left of the drawing, 1 for right.
    """

    shapes: Markup
    x: float
    y: float
    side: int


def joint_of(where: str) -> str:
    """The place that a cause's place is, or that a parameter of the model belongs to."""
    return OF_PARAMETERS.get(where, where)


def mark_of(number: int, effect: NamedEffect) -> Mark:
    """An effect as the sketch says it: what it is and how large."""
    if effect.law is not None:
        return Mark(number, effect.where, ("a law", swing_text(effect.law, 2)))
    quantity = next(iter(effect.parameters.values()))
    size = value_text(quantity.value, quantity.unit, beside=quantity.std)
    return Mark(number, effect.where, (plain(effect.name), size))


def vehicle_sketch(marks: Sequence[Mark], geometry: Geometry | None) -> Markup:
    """The vehicle from above, front upwards; members of a group are all marked.

    Args:
        marks: causes, none where there is nothing to mark.
        geometry: for its proportions; None: usual ones.
    """
    shape = geometry or USUAL
    scale = LENGTH / (shape.wheelbase + 2 * shape.wheel_radius)
    half = scale * (shape.track_width / 2 + shape.wheel_offset + 0.35 * shape.wheel_radius)
    width, height = 2 * (half + MARGIN), LENGTH + 40.0
    box = (-width / 2, -height / 2, width, height)
    return _drawing(_vehicle_parts(shape, scale), marks, box, half, "The vehicle from above, front upwards")


def axis_sketch(marks: Sequence[Mark], names: Sequence[str]) -> Markup:
    """Each axis as a drive, a screw and a carriage on its guide, one below the other."""
    parts = {name: _axis_part(ROW * index, name) for index, name in enumerate(names)}
    box = (-110.0, -35.0, 220.0 + MARGIN, ROW * len(names) + 15.0)
    return _drawing(parts, marks, box, 100.0, "The axes from the side")


def _drawing(parts: Mapping[str, _Part], marks: Sequence[Mark], box: Box, half: float, title: str) -> Markup:
    """All parts, those that are marked in another colour, numbers on them and words beside the drawing."""
    marked = {place for mark in marks for place in _places(mark, parts)}
    group = Markup('<g data-place="{}" class="{}">{}</g>')
    shapes = [
        group.format(place, "marked" if place in marked else "part", part.shapes) for place, part in parts.items()
    ]
    names = ", ".join(place_words(joint_of(mark.where)) for mark in marks)
    return Markup(
        '<svg class="sketch" viewBox="{}" role="img" aria-label="{}" style="max-width:{}px">{}{}</svg>'
    ).format(
        " ".join(f"{value:.0f}" for value in _room(box, _labels(parts, marks, half)[1])),
        f"{title}; marked: {names or 'nothing'}",
        f"{box[2]:.0f}",
        Markup("").join(shapes),
        Markup("").join(_labels(parts, marks, half)[0]),
    )


def _room(box: Box, lowest: float) -> Box:
    """The box, with room for words down to a height."""
    x, y, width, height = box
    return x, y, width, max(height, lowest - y)


def _places(mark: Mark, parts: Mapping[str, _Part]) -> list[str]:
    """The parts that a cause is at; of an axis whose friction follows another one, the axis that has it."""
    where = joint_of(mark.where.partition("<")[0])
    return [place for place in members(where) if place in parts]


def _labels(parts: Mapping[str, _Part], marks: Sequence[Mark], half: float) -> tuple[list[Markup], float]:
    """A number at every place of a cause, its words once beside the drawing; and the lowest height that words take.

    Words of one side that would stand in each other are moved down, and a line leads to them.
    """
    words: list[Markup] = []
    numbers: list[Markup] = []
    taken: dict[str, int] = {}
    free = {-1: -LENGTH, 1: -LENGTH}
    for mark in sorted(marks, key=lambda mark: min([parts[one].y for one in _places(mark, parts)], default=0.0)):
        for index, place in enumerate(_places(mark, parts)):
            part = parts[place]
            x, y = part.x + 19.0 * taken.get(place, 0), part.y
            taken[place] = taken.get(place, 0) + 1
            if index == 0:
                height = max(y, free[part.side])
                free[part.side] = height + LINES * LINE
                words.append(_words(mark, (x, y), (part.side * (half + 10.0), height), part.side))
            numbers.append(_badge(x, y, mark.number))
    return [*words, *numbers], max(free.values())


def _badge(x: float, y: float, number: int) -> Markup:
    circle = Markup('<circle class="badge" cx="{}" cy="{}" r="9"/>').format(_n(x), _n(y))
    return circle + Markup('<text class="number" x="{}" y="{}">{}</text>').format(_n(x), _n(y + 4), number)


def _words(mark: Mark, place: tuple[float, float], at: tuple[float, float], side: int) -> Markup:
    anchor = "start" if side > 0 else "end"
    entry = Markup('<text class="{}" x="{}" y="{}" text-anchor="{}">{}</text>')
    lines = (place_words(joint_of(mark.where)), *mark.words)
    texts = [
        entry.format("what" if index else "where", _n(at[0] + 4 * side), _n(at[1] + 4 + LINE * index), anchor, text)
        for index, text in enumerate(lines)
    ]
    leader = Markup('<line class="leader" x1="{}" y1="{}" x2="{}" y2="{}"/>').format(*map(_n, (*place, *at)))
    return leader + Markup("").join(texts)


def _vehicle_parts(shape: Geometry, scale: float) -> dict[str, _Part]:
    """In the order in which they are drawn."""
    length, track, radius = (scale * one for one in (shape.wheelbase / 2, shape.track_width / 2, shape.wheel_radius))
    parts = {CHASSIS[0]: _chassis(length, track, radius)}
    for place, side in zip(STEERING, (-1, 1), strict=True):
        parts[place] = _unit(side * track, length, 0.32 * radius, side)
    for place, side in zip(ENCODERS, (-1, 1), strict=True):
        parts[place] = _encoder(side * track, 0.32 * length, 0.5 * radius, side)
    for name, drive, wheel in zip(WHEELS, DRIVES, WHEEL_PLACES, strict=True):
        right, down = _SIDES[name]
        x, y = right * track, down * length
        parts[wheel] = _wheel(x, y, right * scale * shape.wheel_offset, radius, right)
        middle = x - right * 1.05 * radius
        parts[drive] = _Part(
            _box(middle - 0.7 * radius, y - 0.4 * radius, 1.4 * radius, 0.8 * radius), middle, y, right
        )
    return parts


def _chassis(length: float, track: float, radius: float) -> _Part:
    half, end = track - 0.3 * radius, length + 0.45 * radius
    nose = Markup('<path class="ahead" d="M-9,{} L0,{} L9,{}"/>').format(*(_n(-end + one) for one in (24, 12, 24)))
    return _Part(_box(-half, -end, 2 * half, 2 * end) + nose, 0.0, 0.0, 1)


def _unit(x: float, length: float, radius: float, side: int) -> _Part:
    """A steering unit: two axes and the coupling between them."""
    rod = Markup('<line class="rod" x1="{0}" y1="{1}" x2="{0}" y2="{2}"/>').format(_n(x), _n(-length), _n(length))
    axes = [Markup('<circle cx="{}" cy="{}" r="{}"/>').format(_n(x), _n(y), _n(radius)) for y in (-length, length)]
    return _Part(rod + Markup("").join(axes), x, -0.3 * length, side)


def _encoder(x: float, y: float, size: float, side: int) -> _Part:
    shaft = Markup('<circle cx="{}" cy="{}" r="{}"/>').format(*map(_n, (x, y, size / 2)))
    return _Part(_box(x - size, y - size, 2 * size, 2 * size) + shaft, x, y, side)


def _wheel(x: float, y: float, away: float, radius: float, side: int) -> _Part:
    axle = Markup('<line x1="{}" y1="{}" x2="{}" y2="{}"/>').format(*map(_n, (x, y, x + away, y)))
    thick = 0.35 * radius
    return _Part(axle + _box(x + away - thick, y - radius, 2 * thick, 2 * radius), x + away, y, side)


def _axis_part(y: float, name: str) -> _Part:
    guide = Markup('<line x1="-60" y1="{0}" x2="95" y2="{0}"/>').format(_n(y + 14))
    screw = Markup('<line class="rod" x1="-62" y1="{0}" x2="95" y2="{0}"/>').format(_n(y))
    text = Markup('<text class="name" x="-81" y="{}">{}</text>').format(_n(y + 4), name.removeprefix("axis_"))
    return _Part(guide + screw + _box(-2, y - 14, 46, 24) + _box(-100, y - 13, 38, 26) + text, 21, y - 2, 1)


def _box(x: float, y: float, width: float, height: float) -> Markup:
    return Markup('<rect x="{}" y="{}" width="{}" height="{}" rx="3"/>').format(*map(_n, (x, y, width, height)))


def _n(value: float) -> str:
    return f"{value:.1f}"
