"""Figures as plain plotly dictionaries; arrays travel as base64 of float32."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.filters import Processing
from ident.estimate.noise import torque_unit
from ident.report.comparison import Comparison, Folded
from ident.report.digits import unit_text
from ident.report.driven_path import Leg, vehicle_outline
from ident.report.excitation import PhasePlane
from ident.report.rows import ParameterRow
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]
Figure = dict[str, Any]

MEASURED: Final = "#4a86c9"
MODELLED: Final = "#d9660f"
RESIDUAL: Final = "#7d8794"
TRUTH: Final = "#2f9a6b"
LEG_COLOURS: Final = ("#4a86c9", "#d9660f", "#2f9a6b", "#b0559b", "#a07f1d", "#c24a4a", "#5a9aa8", "#7a6ad0")
"""Readable on white and on near-black alike."""

STUCK: Final = "rgba(128,128,128,0.18)"
SAMPLES_PER_FILTER_PERIOD: Final = 8
"""Samples drawn of one period of the filter's cutoff: beyond four times it nothing is left to see."""

MOST_SAMPLES: Final = 3000
"""Samples drawn of one trace at most, so that the file stays small."""

POSES_PER_LEG: Final = 4


def packed(values: Array) -> dict[str, str]:
    """An array in plotly's typed form."""
    raw = np.ascontiguousarray(values, dtype="<f4").tobytes()
    return {"dtype": "f4", "bdata": base64.b64encode(raw).decode("ascii")}


def drawn(samples: int, sample_time: float, processing: Processing) -> slice:
    """Which samples of a filtered signal are drawn."""
    useful = 2 * math.pi / (processing.cutoff * SAMPLES_PER_FILTER_PERIOD * sample_time)
    return slice(None, None, max(1, int(useful), math.ceil(samples / MOST_SAMPLES)))


def torque_figure(comparison: Comparison, processing: Processing) -> Figure:
    """Both sides of (24) over time, the residual below on the same time axis, stiction shaded."""
    keep = drawn(len(comparison.time), comparison.sample_time, processing)
    time = packed(comparison.time[keep])
    unit = torque_unit(comparison.coordinate)
    data = [
        _line(time, packed(comparison.measured[keep]), "measured", MEASURED, width=2.6),
        _line(time, packed(comparison.modelled[keep]), "model", MODELLED, width=1.3),
        _line(time, packed(comparison.residual[keep]), "residual", RESIDUAL, width=1.1) | {"yaxis": "y2"},
    ]
    layout = {
        "height": 360,
        "hovermode": "x unified",
        "xaxis": {"title": {"text": "time in the step [s]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": unit}, "domain": [0.34, 1.0], "zeroline": True},
        "yaxis2": {
            "title": {"text": f"residual {unit}"},
            "domain": [0.0, 0.26],
            "zeroline": True,
            "range": _residual_range(comparison),
        },
        "shapes": [_span(start, stop) for start, stop in comparison.stuck_spans()],
    }
    return {"data": data, "layout": layout}


def _residual_range(comparison: Comparison) -> list[float]:
    """Wide enough for every row that counts; residuals in stiction may leave it."""
    counted = comparison.residual[comparison.moving]
    size = 1.15 * float(np.abs(counted if counted.size else comparison.residual).max())
    return [-size, size]


def folded_figure(comparison: Comparison, fold: Folded, processing: Processing) -> Figure:
    """Residual of every repeat over the phase, their mean, and the band within which a mean of noise would stay."""
    keep = drawn(len(fold.phase), comparison.sample_time, processing)
    phase = packed(fold.phase[keep])
    data = [
        _line(phase, packed(repeat[keep]), f"period {number}", RESIDUAL, width=0.9) | {"opacity": 0.65}
        for number, repeat in enumerate(fold.periods)
    ]
    data.append(_line(phase, packed(fold.mean[keep]), "mean of the periods", MODELLED, width=2.2))
    band = 2 * fold.noise / math.sqrt(len(fold.periods))
    layout = {
        "height": 260,
        "hovermode": "closest",
        "xaxis": {"title": {"text": "time in the period [s]"}},
        "yaxis": {"title": {"text": f"residual {torque_unit(comparison.coordinate)}"}, "zeroline": True},
        "shapes": [_band(-band, band)],
    }
    return {"data": data, "layout": layout}


def interval_figure(rows: Sequence[ParameterRow]) -> Figure:
    """95 % intervals relative to the values, and where the truth lies."""
    names = [row.estimate.name for row in rows][::-1]
    widths = [100 * row.half_width for row in rows][::-1]
    data: list[Figure] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": "identified, 95 % interval",
            "x": [0.0] * len(rows),
            "y": names,
            "error_x": {"type": "data", "array": widths, "color": MEASURED, "thickness": 2.2, "width": 5},
            "marker": {"color": MEASURED, "size": 7},
            "hovertemplate": "%{y}: ±%{error_x.array:.3g} %<extra></extra>",
        }
    ]
    if all(row.error is not None for row in rows):
        offsets = [100 * (1 / (1 + (row.error or 0.0)) - 1) for row in rows][::-1]
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "truth",
                "x": offsets,
                "y": names,
                "marker": {"color": TRUTH, "size": 11, "symbol": "diamond-open", "line": {"width": 2}},
                "hovertemplate": "%{y}: truth at %{x:+.3g} %<extra></extra>",
            }
        )
    layout = {
        "height": 340,
        "hovermode": "closest",
        "xaxis": {"title": {"text": "from the identified value [%]"}, "zeroline": True},
        "yaxis": {"type": "category", "automargin": True},
    }
    return {"data": data, "layout": layout}


def excitation_figure(plane: PhasePlane) -> Figure:
    """Speed and acceleration of the driven coordinate: rows kept, and rows left out as stiction."""
    groups = ((~plane.moving, "left out (stiction)", RESIDUAL), (plane.moving, "kept", MEASURED))
    data = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "x": packed(plane.speed[rows]),
            "y": packed(plane.acceleration[rows]),
            "marker": {"size": 3, "color": colour},
            "hovertemplate": "%{x:.3g}, %{y:.3g}<extra></extra>",
        }
        for rows, name, colour in groups
    ]
    layout = {
        "height": 280,
        "hovermode": "closest",
        "xaxis": {"title": {"text": f"speed [{unit_text(plane.unit)}/s]"}, "zeroline": True},
        "yaxis": {"title": {"text": f"acceleration [{unit_text(plane.unit)}/s²]"}, "zeroline": True},
    }
    return {"data": data, "layout": layout}


def path_figure(legs: Sequence[Leg], geometry: Geometry) -> Figure:
    """The path of the chassis centre by step, with the vehicle drawn at some poses."""
    names = list(dict.fromkeys(leg.step for leg in legs))
    colours = {name: LEG_COLOURS[index % len(LEG_COLOURS)] for index, name in enumerate(names)}
    data = [_leg_trace(leg, colours[leg.step], first=leg is _first(legs, leg.step)) for leg in legs]
    data += [_vehicle_trace(leg, colours[leg.step], geometry) for leg in legs]
    layout = {
        "height": 420,
        "hovermode": "closest",
        "showlegend": True,
        "xaxis": {"title": {"text": "x [m]"}, "constrain": "domain"},
        "yaxis": {"title": {"text": "y [m]"}, "scaleanchor": "x", "scaleratio": 1},
    }
    return {"data": data, "layout": layout}


def _first(legs: Sequence[Leg], step: str) -> Leg:
    return next(leg for leg in legs if leg.step == step)


def _leg_trace(leg: Leg, colour: str, *, first: bool) -> Figure:
    keep = slice(None, None, max(1, len(leg.pose) // 500))
    trace = _line(packed(leg.pose[keep, 0]), packed(leg.pose[keep, 1]), leg.step, colour, width=2.4)
    return trace | {"legendgroup": leg.step, "showlegend": first}


def _vehicle_trace(leg: Leg, colour: str, geometry: Geometry) -> Figure:
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(leg.pose, axis=0)).sum(axis=1))])
    marks = np.searchsorted(travelled, np.linspace(0.0, travelled[-1], POSES_PER_LEG))
    lines: list[Array] = []
    for mark in np.unique(np.minimum(marks, len(leg.pose) - 1)):
        for line in vehicle_outline(leg.pose[mark], leg.alpha[mark], geometry):
            lines += [line, np.full((1, 2), np.nan)]
    points = np.concatenate(lines)
    trace = _line(packed(points[:, 0]), packed(points[:, 1]), leg.step, colour, width=1.0)
    return trace | {"legendgroup": leg.step, "showlegend": False, "opacity": 0.55, "hoverinfo": "skip"}


def _line(x: Any, y: Any, name: str, colour: str, *, width: float) -> Figure:
    return {"type": "scatter", "mode": "lines", "name": name, "x": x, "y": y, "line": {"color": colour, "width": width}}


def _span(start: float, stop: float) -> Figure:
    edges = {"x0": start, "x1": stop, "y0": 0, "y1": 1, "yref": "paper", "xref": "x"}
    return {"type": "rect", "layer": "below", "fillcolor": STUCK, "line": {"width": 0}, **edges}


def _band(low: float, high: float) -> Figure:
    edges = {"x0": 0, "x1": 1, "xref": "paper", "y0": low, "y1": high, "yref": "y"}
    return {"type": "rect", "layer": "below", "fillcolor": STUCK, "line": {"width": 0}, **edges}
