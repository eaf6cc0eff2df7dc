"""Figures of a diagnosis: the map of the gap, and residuals before and after."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.gap.diagnosis import Share
from ident.gap.judge import Findings
from ident.gap.problem import Block
from ident.gap.rows import kept_rows
from ident.report.digits import percent, unit_text
from ident.report.figures import MODELLED, RESIDUAL, packed

Array = NDArray[np.float64]
Figure = dict[str, Any]

MOST_RESIDUALS: Final = 12
MOST_SAMPLES: Final = 3000
SCALE: Final = ((0.0, "rgba(217,102,15,0.04)"), (0.5, "rgba(217,102,15,0.55)"), (1.0, "rgba(217,102,15,1)"))
"""From nothing to the accent of residuals; readable on white and on near-black."""


def map_figure(shares: Sequence[Share]) -> Figure:
    """Share of the gap by step and coordinate (down) and region (across)."""
    rows = list(dict.fromkeys((share.step, share.coordinate, share.channel) for share in shares))
    columns = sorted(dict.fromkeys(share.region for share in shares), key=lambda region: (region != "all", region))
    values = {((share.step, share.coordinate, share.channel), share.region): share.share for share in shares}
    table = [[values.get((row, column)) for column in columns] for row in rows]
    texts = [["" if value is None else percent(value) for value in line] for line in table]
    heat = {
        "type": "heatmap",
        "x": [column.replace("_", " ") for column in columns],
        "y": [
            f"{step}, {coordinate}" + ("" if channel == "dynamic" else f" ({channel})")
            for step, coordinate, channel in rows
        ],
        "z": table,
        "text": texts,
        "texttemplate": "%{text}",
        "colorscale": [list(stop) for stop in SCALE],
        "zmin": 0.0,
        "zmax": max([value for line in table for value in line if value is not None], default=1.0) or 1.0,
        "showscale": False,
        "xgap": 2,
        "ygap": 2,
        "hovertemplate": "%{y}, %{x}: %{text} of the gap<extra></extra>",
    }
    layout = {"height": 110 + 30 * len(rows), "xaxis": {"side": "top"}, "yaxis": {"autorange": "reversed"}}
    return {"data": [heat], "layout": layout}


def residual_figures(findings: Findings) -> list[tuple[str, str, Figure]]:
    """Key, title and figure of the coordinates with the largest gap: what the model leaves, before and after."""
    drawn: list[tuple[str, str, Figure]] = []
    blocks = findings.problem.blocks
    order = np.argsort([-_size(block, model) for block, model in zip(blocks, findings.before.blocks, strict=False)])
    for index in order[:MOST_RESIDUALS].tolist():
        block = blocks[index]
        models = {"before": findings.before.blocks[index]}
        if findings.causes:
            models["with the causes"] = findings.after.blocks[index]
        drawn.append((f"residual-{index}", f"{block.step} · {block.coordinate}", _residual(block, models)))
    return drawn


def _size(block: Block, model: Array) -> float:
    left = (block.target - model)[block.moving]
    scale = float(np.sqrt(np.mean(block.target[block.moving] ** 2))) if left.size else 0.0
    return float(np.sqrt(np.mean(left**2))) / scale if scale > 0 else 0.0


def _residual(block: Block, models: Mapping[str, Array]) -> Figure:
    kept = kept_rows(block)
    step = max(1, math.ceil(kept.samples.shape[1] / MOST_SAMPLES))
    time = (kept.samples[0] * block.sample_time)[::step]
    gaps = np.flatnonzero(np.diff(kept.runs[::step]) != 0) + 1

    def line(model: Array, name: str, colour: str, width: float) -> Figure:
        values = kept.mean(block.target - model)[::step]
        broken_time, broken = np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
        return {
            "type": "scattergl" if len(time) > MOST_SAMPLES else "scatter",
            "mode": "lines",
            "name": name,
            "x": packed(broken_time),
            "y": packed(broken),
            "line": {"color": colour, "width": width},
        }

    layout = {
        "height": 260,
        "showlegend": True,
        "hovermode": "x unified",
        "xaxis": {"title": {"text": "time, repeats averaged [s]" if len(kept.samples) > 1 else "time [s]"}},
        "yaxis": {"title": {"text": f"measured - model [{unit_text(block.unit)}]"}, "zeroline": True},
    }
    colours = ((RESIDUAL, 1.2), (MODELLED, 1.6))
    lines = [line(model, name, *style) for (name, model), style in zip(models.items(), colours, strict=False)]
    return {"data": lines, "layout": layout}
