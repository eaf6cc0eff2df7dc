"""Pictures of a score as SVG: reliability and confusion, readable by themselves on any page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final
from xml.sax.saxutils import escape

from hil.exam.statistics import Bin
from ident.effects import EFFECTS

_INK: Final = "#222"
_FAINT: Final = "#999"
_RIGHT: Final = "#2a6f4e"
_WRONG: Final = "#b3471d"
_POINT: Final = "#2266aa"

_EDGE: Final = 56
_WIDTH: Final = 320

_CELL: Final = 24
_LABEL: Final = 205
_HEAD: Final = 150
_VERDICTS: Final = ("none", "unknown", "failed")


def reliability_svg(bins: Sequence[Bin]) -> str:
    """Share of right names over stated probability, with intervals, beside the diagonal."""

    def place(x: float, y: float) -> tuple[float, float]:
        return _EDGE + x * _WIDTH, _EDGE / 2 + (1 - y) * _WIDTH

    (x0, y0), (x1, y1) = place(0, 0), place(1, 1)
    parts = [
        f'<rect x="{x0}" y="{y1}" width="{_WIDTH}" height="{_WIDTH}" fill="none" stroke="{_FAINT}"/>',
        f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="{_FAINT}" stroke-dasharray="4"/>',
    ]
    for tick in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        x, y = place(tick, tick)
        parts.append(_text(x, y0 + 16, f"{tick:g}", anchor="middle"))
        parts.append(_text(x0 - 6, y + 4, f"{tick:g}", anchor="end"))
    parts.append(_text(_EDGE + _WIDTH / 2, y0 + 36, "stated probability", anchor="middle"))
    parts.append(_text(14, _EDGE / 2 + _WIDTH / 2, "share of names that are right", anchor="middle", turn=-90))
    for each in bins:
        low, high = each.right.interval
        x, y = place(each.stated, each.right.value)
        bottom, top = place(0, low)[1], place(0, high)[1]
        parts.append(f'<line x1="{x:.1f}" y1="{bottom:.1f}" x2="{x:.1f}" y2="{top:.1f}" stroke="{_POINT}"/>')
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{_POINT}"/>')
    return _svg(_WIDTH + 1.5 * _EDGE, _WIDTH + 1.5 * _EDGE, parts)


def confusion_svg(counts: Mapping[tuple[str, str], int], wished: Mapping[str, str]) -> str:
    """Truth down, answer across, shaded by the share of a row; the answers wished for in green, others in red."""
    rows, columns = _ordered({true for true, _ in counts}), _ordered({said for _, said in counts})
    parts = [
        _text(_LABEL - 8, _HEAD + _CELL * (index + 0.68), name, anchor="end") for index, name in enumerate(rows)
    ] + [_text(_LABEL + _CELL * (index + 0.68), _HEAD - 8, name, turn=-90) for index, name in enumerate(columns)]
    parts.append(_text(12, _HEAD - 8, "truth ↓  answer →", weight="bold"))
    for down, true in enumerate(rows):
        total = sum(count for (row, _), count in counts.items() if row == true)
        for across, said in enumerate(columns):
            place = _LABEL + _CELL * across, _HEAD + _CELL * down
            parts += _cell(place, counts.get((true, said), 0), total, right=wished[true] == said)
    return _svg(_LABEL + _CELL * len(columns) + 12, _HEAD + _CELL * len(rows) + 12, parts)


def _cell(place: tuple[float, float], count: int, total: int, *, right: bool) -> list[str]:
    x, y = place
    frame = f'<rect x="{x}" y="{y}" width="{_CELL}" height="{_CELL}" fill="none" stroke="#ddd"/>'
    if not count:
        return [frame]
    share = count / total
    fill = f'fill="{_RIGHT if right else _WRONG}" fill-opacity="{0.12 + 0.88 * share:.2f}"'
    ink = "#fff" if share > 0.5 else _INK
    return [
        f'<rect x="{x}" y="{y}" width="{_CELL}" height="{_CELL}" {fill} stroke="#ddd"/>',
        _text(x + _CELL / 2, y + 0.68 * _CELL, str(count), anchor="middle", colour=ink),
    ]


def _ordered(names: set[str]) -> list[str]:
    """Effects of the library in their order, then others, then verdicts."""
    known = [str(name) for name in EFFECTS if name in names]
    verdicts = [name for name in _VERDICTS if name in names]
    return [*known, *sorted(names - set(known) - set(verdicts)), *verdicts]


def _text(
    x: float, y: float, text: str, *, anchor: str = "start", turn: int = 0, colour: str = _INK, weight: str = "normal"
) -> str:
    turned = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-weight="{weight}"{turned}>'
        f"{escape(text)}</text>"
    )


def _svg(width: float, height: float, parts: Sequence[str]) -> str:
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" font-family="sans-serif" font-size="12">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#fff"/>', *parts, "</svg>", ""])
