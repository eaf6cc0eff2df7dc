"""One self-contained HTML file: what was identified, how well, and everything needed to doubt it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from markupsafe import Markup
from plotly import offline

from ident.assessment import Assessment
from ident.campaign.plan import Plan
from ident.estimate.noise import torque_unit
from ident.estimate.result import Identification
from ident.records.record import Record
from ident.report import digits, figures
from ident.report.assessment import headline
from ident.report.comparison import Comparison, comparisons, folded
from ident.report.driven_path import Leg, covered_floor, driven_legs
from ident.report.excitation import phase_planes
from ident.report.page import render, script_json
from ident.report.paper import load_paper_result
from ident.report.rows import Role, loop_rows, parameter_rows, step_rows
from ident.report.summary import summarise
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters
from ident.writing import write_whole


@dataclass(frozen=True)
class ReportContent:
    """What a report is made of.

    Attributes:
        title: heading of the page.
        identification: the result.
        assessment: whether it can be true.
        record: what it was found from.
        vehicle: geometry, priors and limits.
        truth: true parameters, where they are known.
        plan: of the campaign, where there was one; shows loops, excitation limits and room.
        provenance: what the reader must know to repeat it: run, versions, files, seed, by name.
        warnings: to be shown in front of those that the report finds itself.
        paper: whether Table 2 of the paper stands beside the result.
    """

    title: str
    identification: Identification
    assessment: Assessment
    record: Record
    vehicle: VehicleDescription
    truth: Parameters | None
    plan: Plan | None
    provenance: Mapping[str, str]
    warnings: Sequence[str]
    paper: bool = True


@dataclass(frozen=True)
class _Panel:
    """A figure with its heading and what it shows, in words."""

    key: str
    heading: str
    caption: str
    figure: figures.Figure


def render_report(content: ReportContent) -> str:
    """The whole page as a string; scripts, styles and data inline, nothing is loaded from anywhere."""
    panels = {name: make(content) for name, make in _SECTIONS.items()}
    drawn = {panel.key: panel.figure for section in panels.values() for panel in section}
    paper = load_paper_result()
    rows = parameter_rows(content.identification, content.truth, paper.parameters if content.paper else None)
    steps = step_rows(content.identification)
    summary = summarise(content.vehicle.name, content.identification, content.record, rows, steps)
    return render(
        "report.html.j2",
        content=content,
        identification=content.identification,
        summary=summary,
        headline=headline(content.assessment),
        warnings=[*content.warnings, *summary.warnings],
        rows=rows,
        steps=steps,
        checks=[row for row in steps if row.role is Role.VALIDATION],
        panels=panels,
        names=PARAMETER_NAMES,
        paper=paper if content.paper else None,
        loops=loop_rows(content.plan.designs) if content.plan else [],
        room=content.plan.room() if content.plan else None,
        settings=_settings(content),
        figures=script_json(drawn),
        plotly=Markup(offline.get_plotlyjs()),
    )


def write_report(content: ReportContent, path: Path) -> None:
    """Write the page; a reader of `path` sees the old file or the new one, never half of it.

    Raises:
        UserError: the folder cannot be made or written.
    """
    write_whole(render_report(content), path)


def _settings(content: ReportContent) -> dict[str, str]:
    """Filters and thresholds of the estimate, where B_w comes from, and how late torques act."""
    processing, lag = content.identification.processing, content.identification.lag
    inertia = content.identification["B_w"]
    late = {} if lag is None else {"Torques act later by": digits.quantity_text(lag.value, lag.std, "s")}
    return {
        "Record": content.record.source,
        "Filter on Θ and τ": f"zero-phase Butterworth, {processing.cutoff:g} rad/s",
        "Filter on positions": f"zero-phase Butterworth, {processing.signal_cutoff:g} rad/s",
        "Stiction": f"rows with a joint slower than {processing.moving:g} rad/s are left out, "
        f"and {processing.guard:g} s around them",
        "Source of B_w": f"{inertia.method}: {digits.with_std(inertia.value, inertia.std)} kg m²",
        **late,
    }


def _torque_panels(content: ReportContent, roles: Sequence[Role]) -> list[_Panel]:
    processing = content.identification.processing
    return [
        _Panel(
            key=f"torque-{index}",
            heading=f"{comparison.step} · {comparison.coordinate}",
            caption=_torque_caption(comparison),
            figure=figures.torque_figure(comparison, processing),
        )
        for index, comparison in enumerate(comparisons(content.identification))
        if comparison.role in roles
    ]


def _torque_caption(comparison: Comparison) -> str:
    duration = len(comparison.time) * comparison.sample_time
    return f"{duration:.1f} s, {digits.percent(float(comparison.moving.mean()))} of the rows outside of stiction."


def _folded_panels(content: ReportContent) -> list[_Panel]:
    identification = content.identification
    panels = []
    for index, (comparison, floor) in enumerate(zip(comparisons(identification), identification.floors, strict=True)):
        fold = folded(comparison) if comparison.role is Role.FIT else None
        if fold is None:
            continue
        unit = torque_unit(comparison.coordinate)
        panels.append(
            _Panel(
                key=f"folded-{index}",
                heading=f"{comparison.step} · {comparison.coordinate}",
                caption=f"Noise {digits.significant(floor.noise)} {unit}, "
                f"model error {digits.significant(floor.model_error)} {unit} rms.",
                figure=figures.folded_figure(comparison, fold, identification.processing),
            )
        )
    return panels


def _excitation_panels(content: ReportContent) -> list[_Panel]:
    identification = content.identification
    planes = phase_planes(content.record, identification.equations, content.vehicle.geometry, identification.processing)
    return [
        _Panel(f"excitation-{index}", f"{plane.step} · {plane.coordinate}", "", figures.excitation_figure(plane))
        for index, plane in enumerate(planes)
    ]


def _path_panels(content: ReportContent) -> list[_Panel]:
    legs = driven_legs(content.record, content.vehicle.geometry, content.identification.processing)
    if not legs:
        return []
    figure = figures.path_figure(legs, content.vehicle.geometry)
    return [_Panel("driven-path", "Centre of the chassis", _path_caption(legs), figure)]


def _path_caption(legs: Sequence[Leg]) -> str:
    along, across = covered_floor(legs)
    return f"The centre moved over {along:.2f} m along and {across:.2f} m across the heading at the start."


def _interval_panels(content: ReportContent) -> list[_Panel]:
    rows = parameter_rows(content.identification, content.truth)
    return [_Panel("intervals", "", "", figures.interval_figure(rows))]


_SECTIONS: Final[Mapping[str, Callable[[ReportContent], list[_Panel]]]] = {
    "intervals": _interval_panels,
    "identification": partial(_torque_panels, roles=(Role.FIT,)),
    "validation": partial(_torque_panels, roles=(Role.VALIDATION,)),
    "lifted": partial(_torque_panels, roles=(Role.INERTIA, Role.SHOWN)),
    "folded": _folded_panels,
    "excitation": _excitation_panels,
    "path": _path_panels,
}
"""Figures of every section of the page."""
