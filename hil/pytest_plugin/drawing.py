"""Primitives of a timeline in SVG: rows under each other along one axis of time, texts that stay inside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from hil.pytest_plugin.labels import printable, shortened, text_width, wrapped

WIDTH, LEFT, RIGHT, EDGE = 1000, 150, 20, 8
"""Of the picture, of the margins beside the axis, and what stays free at its edges [px]."""
SMALL, _NORMAL, _TITLE = 9, 11, 13
LANE, LINE = 17, 14
"""Height of a lane, and of a line of small text [px]."""
_BAR: Final = 15
_SWATCH: Final = 10
_TICKS: Final = 10
"""Marks that the axis of time has at most."""
_TITLE_LINES: Final = 3
_CLEAR: Final = 6.0
"""Of a name beside a mark [px]."""
_DARK: Final = 0.22
"""Luminance below which a colour carries white letters."""
_STYLE: Final = (
    f"text{{font:{_NORMAL}px sans-serif;fill:#222}}.t{{font-size:{_TITLE}px;font-weight:bold}}.s{{font-size:{SMALL}px}}"
    ".n{paint-order:stroke;stroke:#fff;stroke-width:3px}"
)


@dataclass(frozen=True)
class Look:
    """How something looks in a bar and in the legend: its name and its colour."""

    name: str
    colour: str

    @property
    def ink(self) -> str:
        """Colour of letters on it."""
        red, green, blue = (int(self.colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
        return "#fff" if 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2 < _DARK else "#222"


@dataclass(frozen=True)
class Axis:
    """Time along the picture, from `begin` to `end` [s]."""

    begin: float
    end: float

    def x(self, time: float) -> float:
        """Place of an instant [px]; what is outside is at the end nearest to it."""
        share = (min(max(time, self.begin), self.end) - self.begin) / max(self.end - self.begin, 1e-9)
        return round(LEFT + share * (WIDTH - LEFT - RIGHT), 1)


@dataclass(frozen=True)
class Row:
    """A part of the picture as wide as it: height [px], drawing, and what of the legend is in it."""

    height: int
    drawing: str
    looks: frozenset[Look] = frozenset()


def document(rows: Sequence[Row], behind: Sequence[str]) -> str:
    """The picture: rows from the top to the bottom, and lines behind them in coordinates of the picture."""
    parts, y = [], 0
    for row in rows:
        parts.append(f'<g transform="translate(0,{y})">{row.drawing}</g>')
        y += row.height
    y += EDGE
    sheet = f'<style>{_STYLE}</style><rect width="100%" height="100%" fill="white"/>'
    size = f'viewBox="0 0 {WIDTH} {y}" width="{WIDTH}" height="{y}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{sheet}{"".join(behind)}{"".join(parts)}</svg>\n'


def heading(title: str, below: str) -> list[Row]:
    """Title in as many lines as it needs, at most three, and a line below it."""
    lines = wrapped(printable(title), WIDTH - 2 * EDGE, _TITLE, _TITLE_LINES, bold=True)
    titles = [Row(18, _text(EDGE, 15, line, "t")) for line in lines]
    return [Row(4, ""), *titles, Row(LINE + 6, small(EDGE, 11, below))]


def label(text: str) -> str:
    """What a row is, in the margin."""
    return _text(EDGE, 12, text)


def small(x: float, y: float, text: str, colour: str = "", anchor: str = "start") -> str:
    """A small text, legible over lines."""
    style = f' style="fill:{colour}"' if colour else ""
    return _text(x, y, text, "s n", f' text-anchor="{anchor}"{style}')


def in_bar(x: float, text: str, look: Look) -> str:
    """A small text on a bar."""
    return _text(x, 12, text, "s", f' style="fill:{look.ink}"')


def bar(x: float, width: float, look: Look, told: str = "") -> str:
    """A bar in a lane; `told` is what a browser shows under the pointer, the name of the look unless given."""
    size = f'x="{x}" y="1" width="{width:.1f}" height="{_BAR}"'
    return f'<rect {size} fill="{look.colour}">{_hint(told or look.name)}</rect>'


def arrow(x: float, look: Look, told: str) -> str:
    """A mark at an instant of a lane."""
    return f'<path d="M{x} 1l4 {_BAR}h-8z" fill="{look.colour}" stroke="#fff" stroke-width="0.5">{_hint(told)}</path>'


def spans(
    points: Sequence[tuple[float, Look]], axis: Axis, marked: Sequence[float] = ()
) -> tuple[str, frozenset[Look]]:
    """Bars of what was the case from each instant on.

    Args:
        points: instants [s], and what was the case from then on.
        axis: of the picture.
        marked: instants at which a mark lies on the lane [s]; names keep clear of them.

    Returns:
        The bars, named where the name fits, and what there is in them.
    """
    parts, changes = [], [point for k, point in enumerate(points) if k == 0 or point[1] != points[k - 1][1]]
    in_the_way = sorted(axis.x(instant) for instant in marked)
    ends = [*(begin for begin, _ in changes), axis.end][1:]
    for (begin, look), end in zip(changes, ends, strict=True):
        x, width = axis.x(begin), axis.x(end) - axis.x(begin)
        parts.append(bar(x, max(width, 0.5), look, f"{look.name}, {begin:.3f} s to {end:.3f} s"))
        free = _free(x, x + width, text_width(look.name, SMALL), in_the_way)
        if free is not None:
            parts.append(in_bar(free, look.name, look))
    return "".join(parts), frozenset(look for _, look in changes)


def _free(begin: float, end: float, width: float, in_the_way: Sequence[float]) -> float | None:
    """The first place of a name in a bar from `begin` to `end` that is clear of marks [px]; None if there is none."""
    places = [begin + 4, *(mark + _CLEAR for mark in in_the_way if begin <= mark <= end)]
    for place in places:
        crossed = any(place - _CLEAR < mark < place + width + _CLEAR for mark in in_the_way)
        if place + width + 4 <= end and not crossed:
            return place
    return None


def time_axis(axis: Axis) -> Row:
    """Its marks, with their instants."""
    return Row(LINE + 4, "".join(small(axis.x(at), 11, f"{at:g} s", anchor="middle") for at in marks(axis)))


def marks(axis: Axis) -> list[float]:
    """Round instants, at most ten [s]."""
    length = axis.end - axis.begin
    power = 10.0 ** math.floor(math.log10(length / _TICKS))
    step = next(power * factor for factor in (1, 2, 5, 10) if length / (power * factor) <= _TICKS)
    first, last = math.floor(axis.begin / step), math.floor(axis.end / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def upright(x: float, top: float, bottom: float, colour: str = "") -> str:
    """A line at an instant through all rows: thin, or dashed in a colour."""
    style = f'stroke="{colour}" stroke-dasharray="3,3"' if colour else 'stroke="#000" stroke-opacity="0.12"'
    return f'<line x1="{x}" x2="{x}" y1="{top}" y2="{bottom}" {style}/>'


def legend(looks: Sequence[Look]) -> list[Row]:
    """Colours and their names, in as many lines as they need."""
    lines: list[list[str]] = [[]]
    x = float(LEFT)
    for look in looks:
        width = _SWATCH + 4 + text_width(look.name, SMALL) + 12
        if x + width > WIDTH - EDGE and lines[-1]:
            lines.append([])
            x = float(LEFT)
        swatch = f'<rect x="{x:.1f}" y="2" width="{_SWATCH}" height="{_SWATCH}" fill="{look.colour}"/>'
        lines[-1].append(swatch + small(x + _SWATCH + 4, 10, look.name))
        x += width
    return [Row(LINE, "".join(line)) for line in lines]


def beside(begin: float, end: float, text: str) -> tuple[float, float, str, bool]:
    """Where the text of a bar from `begin` to `end` [px] goes: in it, behind it, before it, or shortened.

    Returns:
        Where it begins and ends [px], what of it there is, and whether that is in the bar.
    """
    width = text_width(text, SMALL)
    rooms = ((begin + 4, end - 4), (end + 4, WIDTH - EDGE), (LEFT, begin - 4))
    fitting = [k for k, (low, high) in enumerate(rooms) if high - low >= width]
    chosen = fitting[0] if fitting else max(range(3), key=lambda k: rooms[k][1] - rooms[k][0])
    low, high = rooms[chosen]
    shown = shortened(text, high - low, SMALL)
    start = high - text_width(shown, SMALL) if chosen == 2 else low
    return start, start + text_width(shown, SMALL), shown, chosen == 0


def _hint(told: str) -> str:
    return f"<title>{escape(printable(told))}</title>"


def _text(x: float, y: float, text: str, kind: str = "", more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y}" class="{kind}"{more}>{escape(printable(text))}</text>'
