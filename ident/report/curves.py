"""Curves of causes with the data behind them: of laws with their band, of named effects where they are a function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.dependence import Partner, Variable
from ident.diagnosis.diagnosis import LawAnswer
from ident.report.digits import plain, unit_text
from ident.report.figures import MEASURED, MODELLED, TRUTH, packed
from ident.report.headline import place_words
from ident.report.law_text import variable_name
from ident.report.partial import Points, averaged, effect_points, law_points

Array = NDArray[np.float64]
Figure = dict[str, Any]

MOST_POINTS: Final = 2000
"""Drawn of one cause, so that the file stays small."""

BAND: Final = 2.0
"""Standard deviations on either side of a curve."""

SHADE: Final = "rgba(217,102,15,0.22)"
"""Of the band: the colour of the curve."""

MOMENT: Final = "Nm"

OUTSIDE: Final = 0.005
"""Share of the points that may lie above or below what is shown."""

_VERTICAL: Final[Mapping[str, str]] = MappingProxyType(
    {
        Partner.DIRECTION: "friction",
        Partner.RATE: "viscous friction",
        Partner.ACCELERATION: "inertia",
        Partner.ROLLING: "rolling radius",
    }
)
"""What a function is, by what it is multiplied with."""


@dataclass(frozen=True)
class Curve:
    """A figure of one cause.

    Attributes:
        key: of the figure.
        title: cause and place.
        figure: curve, band and points.
        has_band: whether a band is drawn.
    """

    key: str
    title: str
    figure: Figure
    has_band: bool


def cause_curves(findings: Findings) -> list[Curve]:
    """Of all causes that are a function of one variable in these rows, in the order of the causes."""
    return list(_curves(findings))


def _curves(findings: Findings) -> Iterator[Curve]:
    for index, cause in enumerate(findings.causes):
        key, where = f"curve-{index}", place_words(cause.candidate.where)
        if cause.law_answer is not None:
            yield Curve(key, f"law · {where}", law_figure(cause.law_answer, law_points(findings, cause)), True)
            continue
        points = effect_points(findings, cause)
        if points is not None:
            share = _share_of_std(cause)
            title = f"{plain(str(cause.candidate.effect))} · {where}"
            yield Curve(key, title, effect_figure(points, share), share > 0)


def law_figure(law: LawAnswer, points: Points | None) -> Figure:
    """A law as it was learnt, with its band, over what rows say of it."""
    x, y, std = law.curve.T
    across = f"{variable_name(law.variable, law.of)} [{unit_text(law.unit_x)}]"
    return _figure(points, (x, y, BAND * std), (across, _vertical(law.variable, law.partner, law.unit_y)))


def effect_figure(points: Points, share: float) -> Figure:
    """What an effect adds over its variable, over what rows say of it.

    Args:
        points: of the effect.
        share: standard deviation of all of the curve over the curve itself; zero for no band.
    """
    x, y = averaged(points.x, points.added)
    of = points.dependence
    across = f"{variable_name(of.variable, of.of)} [{unit_text(of.unit_x)}]"
    return _figure(points, (x, y, BAND * share * np.abs(y)), (across, _vertical(of.variable, of.partner, of.unit_y)))


def _share_of_std(cause: Cause) -> float:
    """Of an effect of one number, by which all of its curve grows and shrinks; 0 of others."""
    values, std = cause.part.values, cause.part.std
    return float(std[0] / abs(values[0])) if len(values) == 1 and values[0] else 0.0


def _vertical(variable: str, partner: str, unit: str) -> str:
    alone = "friction" if variable == Variable.RATE else "torque" if unit.startswith(MOMENT) else "force"
    return f"{_VERTICAL[partner] if partner else alone} [{unit_text(unit)}]"


def _figure(points: Points | None, curve: tuple[Array, Array, Array], titles: tuple[str, str]) -> Figure:
    x, y, half = curve
    layout = {
        "height": 330,
        "showlegend": True,
        "hovermode": "closest",
        "xaxis": {"title": {"text": titles[0]}},
        "yaxis": {"title": {"text": titles[1]}, "zeroline": True, "range": _range(points, y, half)},
    }
    return {"data": [*_dots(points), *_band(x, y, half), _line(x, y)], "layout": layout}


def _line(x: Array, y: Array) -> Figure:
    style = {"color": MODELLED, "width": 2.4}
    return {"type": "scatter", "mode": "lines", "name": "cause", "x": packed(x), "y": packed(y), "line": style}


def _band(x: Array, y: Array, half: Array) -> Iterator[Figure]:
    """Two edges without ink and what is between them; nothing where the band has no width."""
    if not np.any(half > 0):
        return
    edge = {"type": "scatter", "mode": "lines", "x": packed(x), "line": {"width": 0}, "hoverinfo": "skip"}
    yield edge | {"y": packed(y - half), "showlegend": False}
    yield edge | {"y": packed(y + half), "fill": "tonexty", "fillcolor": SHADE, "name": f"± {BAND:.0f} std"}


def _dots(points: Points | None) -> Iterator[Figure]:
    """Rows that were fitted and rows that confirm, both thinned alike."""
    if points is None:
        return
    step = max(1, -(-len(points.x) // MOST_POINTS))
    for confirming, name, colour in ((False, "rows fitted", MEASURED), (True, "rows that confirm", TRUTH)):
        chosen = np.flatnonzero(points.confirming == confirming)[::step]
        if chosen.size:
            yield {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": packed(points.x[chosen]),
                "y": packed(points.y[chosen]),
                "marker": {"color": colour, "size": 4, "opacity": 0.55},
                "hoverinfo": "skip",
            }


def _range(points: Points | None, y: Array, half: Array) -> list[float]:
    """The curve with its band, and nearly all points: a few far ones must not flatten it."""
    values = [float(np.nanmin(y - half)), float(np.nanmax(y + half))]
    if points is not None:
        values += np.quantile(points.y, [OUTSIDE, 1 - OUTSIDE]).tolist()
    low, high = min(values), max(values)
    margin = 0.06 * (high - low) or 1.0
    return [low - margin, high + margin]
