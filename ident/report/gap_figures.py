"""Figures of a diagnosis: the map of the gap, and residuals before and after."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.check.remainder import ALL, noise_floors
from ident.diagnosis.diagnosis import Share
from ident.diagnosis.observations.rows import kept_rows, make_rows
from ident.diagnosis.problem import Block, Channel
from ident.report.digits import percent, significant, unit_text
from ident.report.figures import MODELLED, RESIDUAL, STUCK, packed

Array = NDArray[np.float64]
Figure = dict[str, Any]

MOST_RESIDUALS: Final = 12
MOST_SAMPLES: Final = 3000
LEAST_SHARE: Final = 1e-3
"""Share of the gap below which a coordinate is left out of the map."""
REGIONS: Final = (
    ALL,
    *("low_speed", "high_speed", "forward", "backward", "speeding_up", "braking", "high_acceleration"),
    *("behind", "ahead", "lower_half_of_travel", "upper_half_of_travel", "high_load", "early", "late"),
)
"""Across the map."""
SCALE: Final = ((0.0, "rgba(217,102,15,0.04)"), (0.5, "rgba(217,102,15,0.55)"), (1.0, "rgba(217,102,15,1)"))
"""From nothing to the accent of residuals; readable on white and on near-black."""


def map_figure(shares: Sequence[Share]) -> Figure:
    """Share of the gap by step and coordinate (down, those that matter) and region (across)."""
    whole = {_row(share): share.share for share in shares if share.region == ALL}
    rows = [row for row, share in whole.items() if share >= LEAST_SHARE] or list(whole)[:1]
    columns = sorted(dict.fromkeys(share.region for share in shares), key=_place)
    values = {(_row(share), share.region): share.share for share in shares}
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


def _row(share: Share) -> tuple[str, str, str]:
    return share.step, share.coordinate, share.channel


def _place(region: str) -> tuple[int, str]:
    """Opposites beside each other, what is not in the list behind."""
    return REGIONS.index(region) if region in REGIONS else len(REGIONS), region


def residual_figures(findings: Findings) -> list[tuple[str, str, Figure]]:
    """Key, title and figure of what models leave of held-out data; the largest gap over its noise first."""
    drawn: list[tuple[str, str, Figure]] = []
    held_out = findings.held_out
    blocks, before, after = held_out.problem.blocks, held_out.before, held_out.after
    rows = make_rows(replace(held_out.problem, candidates=()))
    floors = noise_floors(rows, after, rows.target - rows.stack(list(after))).tolist()
    sizes = [_size(*one) for one in zip(blocks, before, floors, strict=True)]
    shown = [index for index in np.argsort(sizes)[::-1].tolist() if kept_rows(blocks[index]).samples.size]
    for index in shown[:MOST_RESIDUALS]:
        block = blocks[index]
        models = {"before": before[index]}
        if findings.causes:
            models["with the causes"] = after[index]
        channel = "" if block.channel is Channel.DYNAMIC else f" ({block.channel})"
        title = f"{block.step} · {block.coordinate}{channel}: {significant(sizes[index], 2)} times the noise"
        drawn.append((f"residual-{index}", title, _residual(block, models, floors[index])))
    return drawn


def _shade(half: float) -> Figure:
    """Over the whole width, so far about zero."""
    edges = {"x0": 0, "x1": 1, "xref": "paper", "y0": -half, "y1": half, "yref": "y"}
    return {"type": "rect", "layer": "below", "fillcolor": STUCK, "line": {"width": 0}, **edges}


def _size(block: Block, model: Array, floor: float) -> float:
    """Rms over the noise of the gap as it is drawn, repeats averaged."""
    left = kept_rows(block).mean(block.target - model)
    return float(np.sqrt(np.mean(left**2))) / floor if left.size else 0.0


def _residual(block: Block, models: Mapping[str, Array], floor: float) -> Figure:
    """What models leave of a block, over the band of twice the noise of a mean of its repeats."""
    kept = kept_rows(block)
    band = 2 * floor / math.sqrt(len(kept.samples))
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
        "shapes": [_shade(band)],
    }
    colours = ((RESIDUAL, 1.2), (MODELLED, 1.6))
    lines = [line(model, name, *style) for (name, model), style in zip(models.items(), colours, strict=False)]
    return {"data": lines, "layout": layout}
