"""Figures of a replay: which node differs when, and an object as both sides have it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.network import Node
from hil.replay.comparing import Compared, Track
from hil.replay.playing import Mark
from ident.report.figures import MEASURED, MODELLED, RESIDUAL, STUCK, Figure, packed

MOST_SAMPLES: Final = 3000
BINS: Final = 600
"""Stretches of time that the timeline tells apart."""

_SYMBOL: Final = "line-ns-open"
_EVENT_COLOUR: Final = "#c24a4a"
_LONGEST_LABELS: Final = 40
"""Names of logs that have room above a timeline."""


def timeline_figure(compared: Compared, marks: Sequence[Mark]) -> Figure:
    """A line an object that differs: when it does, and how far in its own largest difference; messages as diamonds."""
    ranked = compared.ranked()
    names = [f"{track.node.role} {track.item.name}" for track in ranked]
    data = [_stretches(track, name) for track, name in zip(ranked, names, strict=True)]
    spoken = sorted({_spoken(event.node) for event in compared.events})
    if compared.events:
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "other messages",
                "x": [event.time for event in compared.events],
                "y": [_spoken(event.node) for event in compared.events],
                "marker": {"symbol": "diamond", "size": 9, "color": _EVENT_COLOUR},
                "text": [str(event.answer) for event in compared.events],
                "hovertemplate": "%{y}, %{text}: %{x:.3f} s<extra></extra>",
            }
        )
    rows = [*names, *spoken]
    layout = {
        "height": 120 + 26 * len(rows),
        "hovermode": "closest",
        "xaxis": {"title": {"text": "time [s]"}, "range": _span(compared)},
        "yaxis": {"type": "category", "categoryorder": "array", "categoryarray": rows[::-1], "automargin": True},
        "shapes": [_line_at(mark.time) for mark in marks],
        "annotations": [_label(mark) for mark in marks] if 1 < len(marks) <= _LONGEST_LABELS else [],
        "margin": {"l": 52, "r": 10, "t": 100 if len(marks) > 1 else 12, "b": 42},
    }
    return {"data": data, "layout": layout}


def track_figure(track: Track) -> Figure:
    """An object as recorded and as emulated; below the difference, and what it may be for no reason."""
    keep = slice(None, None, max(1, math.ceil(len(track.time) / MOST_SAMPLES)))
    time, scale = packed(track.time[keep]), abs(track.unit[0])
    unit = track.unit[1] or "raw"
    recorded, emulated = _scaled(track.recorded, track), _scaled(track.emulated, track)
    data = [
        _line(time, recorded[keep], "recorded", MEASURED, 2.4),
        _line(time, emulated[keep], "emulated", MODELLED, 1.2),
        _line(time, (emulated - recorded)[keep], "difference", RESIDUAL, 1.2) | {"yaxis": "y2"},
    ]
    if track.tolerance.any():
        band = track.tolerance[keep] * scale
        edge = {"yaxis": "y2", "showlegend": False, "hoverinfo": "skip", "line": {"width": 0}}
        data += [
            _line(time, band, "", STUCK, 0) | edge,
            _line(time, -band, "", STUCK, 0) | edge | {"fill": "tonexty", "fillcolor": STUCK},
        ]
    layout = {
        "height": 340,
        "showlegend": True,
        "hovermode": "x unified",
        "xaxis": {"title": {"text": "time [s]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": unit}, "domain": [0.45, 1.0]},
        "yaxis2": {"title": {"text": f"difference [{unit}]"}, "domain": [0.0, 0.36], "zeroline": True},
        "shapes": [_line_at(float(track.time[track.differing[0]]))],
    }
    return {"data": data, "layout": layout}


def _scaled(counts: NDArray[np.int64], track: Track) -> NDArray[np.float64]:
    return np.multiply(counts, track.unit[0], dtype=np.float64)


def _stretches(track: Track, name: str) -> Figure:
    begin, end = float(track.time[0]), float(track.time[-1])
    bins = np.floor((track.time[track.differing] - begin) / max(end - begin, 1e-9) * (BINS - 1)).astype(int)
    size = np.abs(track.difference[track.differing]).astype(float)
    largest = np.zeros(BINS)
    np.maximum.at(largest, bins, size)
    at = np.flatnonzero(largest)
    share = largest[at] / largest.max()
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": packed(begin + (at + 0.5) * (end - begin) / (BINS - 1)),
        "y": [name] * len(at),
        "marker": {
            "symbol": _SYMBOL,
            "size": 15,
            "color": packed(share),
            "colorscale": [[0.0, MEASURED], [1.0, MODELLED]],
            "cmin": 0.0,
            "cmax": 1.0,
            "line": {"width": 2},
        },
        "hovertemplate": "%{y}: %{x:.3f} s<extra></extra>",
    }


def _span(compared: Compared) -> list[float]:
    times = [float(time) for track in compared.tracks for time in (track.time[0], track.time[-1])]
    times += [event.time for event in compared.events]
    return [min(times), max(times)]


def _spoken(node: Node) -> str:
    return f"{node.role} says"


def _line(x: dict[str, str], values: NDArray[np.float64], name: str, colour: str, width: float) -> Figure:
    style = {"color": colour, "width": width}
    return {"type": "scatter", "mode": "lines", "name": name, "x": x, "y": packed(values), "line": style}


def _line_at(time: float) -> Figure:
    edges = {"x0": time, "x1": time, "y0": 0, "y1": 1, "yref": "paper", "xref": "x"}
    return {"type": "line", "layer": "below", "line": {"width": 1, "dash": "dot", "color": RESIDUAL}, **edges}


def _label(mark: Mark) -> Figure:
    return {
        "x": mark.time,
        "y": 1.0,
        "yref": "paper",
        "yanchor": "bottom",
        "xanchor": "left",
        "text": mark.name,
        "textangle": -40,
        "showarrow": False,
        "font": {"size": 10, "color": RESIDUAL},
    }
