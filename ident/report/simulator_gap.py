"""The gap of a simulator in words, as numbers and as a page."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from plotly import offline

from ident.diagnosis.vehicle.records.following import Difference
from ident.diagnosis.vehicle.simulator_gap import SimulatorGap, StepGap
from ident.report import digits
from ident.report.digits import percent, significant, unit_text
from ident.report.figures import MEASURED, MODELLED, RESIDUAL, STUCK, Figure, packed
from ident.writing import write_whole

Array = NDArray[np.float64]

SCHEMA: Final = "quasiomni.simulator_gap/1"
MOST_FIGURES: Final = 12
MOST_SAMPLES: Final = 3000


@dataclass(frozen=True)
class SimulatorReport:
    """What there is to say.

    Attributes:
        gap: what was found.
        record: whose torques were simulated.
        before, after: files of the two models.
        effects: that the simulator has after, `name@place` each.
        engine: of the simulation.
    """

    gap: SimulatorGap
    record: str
    before: str
    after: str
    effects: Sequence[str]
    engine: str


def headline(report: SimulatorReport) -> str:
    """How far the gap shrinks, in one sentence."""
    total = report.gap.total
    if not math.isfinite(total.before):
        return "No step of the record repeats, so its noise is not known: only before and after are stated."
    text = f"Simulator's gap: {significant(total.before)} times the noise before, {significant(total.after)} after"
    return f"{text}: {percent(total.closed)} of what is above the noise is gone."


def summary_lines(report: SimulatorReport) -> list[str]:
    """The whole, then every coordinate of every step, largest gap first and what does not repeat behind."""
    effects = ", ".join(report.effects) or "no effects"
    lines = [headline(report), f"Before: {report.before}. After: {report.after}, with {effects}."]
    return [*lines, *(_line(one) for one in by_size(report.gap))]


def by_size(gap: SimulatorGap) -> list[StepGap]:
    """Steps by the share of the gap that they have, those without known noise behind."""
    return sorted(gap.steps, key=lambda one: (not one.repeats, -one.share))


def _line(one: StepGap) -> str:
    unit = unit_text(one.unit)
    head = f"  {one.step}, {one.coordinate}: {one.gap.before:.2e} to {one.gap.after:.2e} {unit}"
    if not one.repeats:
        return f"{head}; it does not repeat, so its noise is not known; {least_text(one.closed)} of it closed"
    noise = one.in_noise
    text = f"{head}, noise {one.gap.floor:.2e}; {significant(noise.before)} to {significant(noise.after)} times"
    return f"{text}, {percent(one.closed)} closed" if noise.before > SEEN else f"{text}: nothing to close"


def least_text(closed: float) -> str:
    """A share that is at least so large: never rounded upwards."""
    return f"at least {math.floor(1000 * max(closed, 0.0)) / 10:.1f} %"


SEEN: Final = 1.2
"""Times the noise from which a gap is worth a share."""


def write_simulator_json(report: SimulatorReport, path: Path) -> None:
    """Write the numbers, whole or not at all.

    Raises:
        UserError: they cannot be written.
    """
    head = {
        "schema": SCHEMA,
        "record": report.record,
        "before": report.before,
        "after": report.after,
        "effects": list(report.effects),
        "engine": report.engine,
    }
    write_whole(json.dumps(head | report.gap.as_json(), indent=2, allow_nan=False) + "\n", path)


def write_simulator_report(report: SimulatorReport, path: Path) -> None:
    """Write the page, whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(render_simulator_report(report), path)


def render_simulator_report(report: SimulatorReport) -> str:
    """The page as a string; scripts, styles and data inline, nothing is loaded from anywhere."""
    shown = by_size(report.gap)[:MOST_FIGURES]
    figures = {f"trace-{index}": trace_figure(one) for index, one in enumerate(shown)}
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ident.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(percent=percent, least=least_text, significant=significant, unit=digits.unit_text)
    return environment.get_template("simulator_gap.html.j2").render(
        report=report,
        headline=headline(report),
        total=report.gap.total,
        steps=by_size(report.gap),
        seen=SEEN,
        traces=list(zip(figures, shown, strict=True)),
        figures=Markup(json.dumps(figures, separators=(",", ":")).replace("<", "\\u003c")),
        plotly=Markup(offline.get_plotlyjs()),
    )


def trace_figure(one: StepGap) -> Figure:
    """Torque as recorded and as each simulator needs it, first repeat; below what they lack, repeats averaged.

    The band is twice the noise of a mean of the repeats. Stiction is left out.
    """
    before, after = one.before[0], one.after[0]
    unit = unit_text(one.unit)
    tracks = (
        (before.recorded[0], "recorded", MEASURED, 2.4),
        (before.needed[0], "before", RESIDUAL, 1.2),
        (after.needed[0], "after", MODELLED, 1.2),
    )
    data = [_line_of(before, values, name, colour, width) for values, name, colour, width in tracks]
    for off, colour in ((before, RESIDUAL), (after, MODELLED)):
        line = _line_of(off, off.off.mean(axis=0), "", colour, 1.4)
        data.append(line | {"yaxis": "y2", "showlegend": False})
    band = 2 * one.gap.floor / math.sqrt(len(before.off)) if one.repeats else 0.0
    edges = {"x0": 0, "x1": 1, "xref": "paper", "y0": -band, "y1": band, "yref": "y2"}
    layout = {
        "height": 380,
        "showlegend": True,
        "hovermode": "x unified",
        "xaxis": {"title": {"text": "time in the step [s]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": unit}, "domain": [0.48, 1.0], "zeroline": True},
        "yaxis2": {"title": {"text": f"lacking [{unit}]"}, "domain": [0.0, 0.4], "zeroline": True},
        "shapes": [{"type": "rect", "layer": "below", "fillcolor": STUCK, "line": {"width": 0}, **edges}],
    }
    return {"data": data, "layout": layout}


def _line_of(difference: Difference, values: Array, name: str, colour: str, width: float) -> Figure:
    """A line (N,) over the time of the first repeat, with a break at every stretch that is left out."""
    step = max(1, math.ceil(len(values) / MOST_SAMPLES))
    breaks = np.flatnonzero(np.diff(difference.runs[::step])) + 1
    x, y = (np.insert(rows[::step], breaks, np.nan) for rows in (difference.time[0], values))
    style = {"color": colour, "width": width}
    return {"type": "scatter", "mode": "lines", "name": name, "x": packed(x), "y": packed(y), "line": style}
