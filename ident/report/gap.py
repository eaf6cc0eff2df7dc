"""The HTML report of a diagnosis: gap map, ranked causes with their odds, before and after, what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from plotly import offline

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.diagnosis import Diagnosis
from ident.diagnosis.vehicle.outcome import HORIZON
from ident.report import digits
from ident.report.commands import Asked, next_commands
from ident.report.curves import cause_curves
from ident.report.gap_figures import map_figure, residual_figures
from ident.report.gap_summary import next_text, numbers_text, rivals_of
from ident.report.headline import ABOVE, effect_words, headline, place_words
from ident.report.judged import judged_steps, scale_ticks
from ident.report.page import render, script_json
from ident.report.rivals import rival_charts
from ident.report.sketch import axis_sketch, mark_of, vehicle_sketch
from ident.vehicle.geometry import Geometry
from ident.writing import write_whole

BIASED: Final = 2.0
"""Shift of a parameter, in standard deviations, from which it is said to be biased."""

LARGEST: Final = 2
"""Traces that stand with the answer; the others follow below."""

AXIS: Final = "axis"
"""With it the coordinates of servo axes begin."""

REPEATS: Final = 0.05
"""What repeats, in units of the noise, from which it is worth a line."""


@dataclass(frozen=True)
class GapReport:
    """What the page is made of.

    Attributes:
        findings: everything that was found.
        diagnosis: the answer.
        records, confirm: names of the records.
        model: name of the model under test; None where the parameters were refitted.
        asked: what commands that come next need beside that; None: the names above alone.
        geometry: of the vehicle, for the proportions of its sketch; None where it is not at hand.
    """

    findings: Findings
    diagnosis: Diagnosis
    records: Sequence[str]
    confirm: Sequence[str]
    model: str | None = None
    asked: Asked | None = None
    geometry: Geometry | None = None

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, where the records are of axes."""
        names = dict.fromkeys(block.coordinate for block in self.findings.problem.blocks)
        return tuple(name for name in names if name.partition("_")[0] == AXIS)


@dataclass(frozen=True)
class Row:
    """A cause as a table row.

    Attributes:
        name, where: what and where.
        probability: that the name is right.
        numbers: parameters with standard deviations.
        log_odds: that it is there against nothing in its place, by all records.
        closed: share of the held-out gap.
        rivals: what these records do not tell apart from it.
        biased: parameters that shift by more than BIASED standard deviations when it is left out.
    """

    name: str
    where: str
    probability: float
    numbers: str
    log_odds: float
    closed: float
    rivals: str
    biased: str


def render_gap_report(content: GapReport) -> str:
    """The whole page as a string; scripts, styles and data inline, nothing is loaded from anywhere."""
    findings, diagnosis = content.findings, content.diagnosis
    curves, residuals = cause_curves(findings), residual_figures(findings)
    figures = {curve.key: curve.figure for curve in curves} | {key: figure for key, _, figure in residuals}
    if _has_gap(diagnosis):
        figures["map"] = map_figure(diagnosis.where)
    titles = [(key, title) for key, title, _ in residuals]
    return render(
        "gap.html.j2",
        sketch=_sketch(content),
        curves=curves,
        charts=rival_charts(findings),
        largest=titles[:LARGEST],
        residuals=titles[LARGEST:],
        figures=script_json(figures),
        plotly=Markup(offline.get_plotlyjs()),
        **_answer(content),
        **_details(content),
    )


def _answer(content: GapReport) -> dict[str, Any]:
    """What is said first."""
    findings, diagnosis = content.findings, content.diagnosis
    lines = judged_steps(diagnosis)
    return {
        "headline": headline(diagnosis),
        "verdict": str(diagnosis.verdict),
        "nothing": findings.nothing,
        "gap": diagnosis.gap,
        "effects": [(place_words(one.where), effect_words(one), one) for one in diagnosis.effects],
        "judged_steps": lines,
        "ticks": scale_ticks(lines),
        "above": ABOVE,
        "horizon": HORIZON,
        "next": next_text(diagnosis),
        "commands": next_commands(diagnosis, content.asked or Asked(content.records, content.confirm, content.model)),
        "invisible": diagnosis.invisible,
    }


def _details(content: GapReport) -> dict[str, Any]:
    """What stands below."""
    findings = content.findings
    return {
        "rows": [_row(cause, content) for cause in findings.causes],
        "believed": content.diagnosis.verdict.explains,
        "parameters": _parameters(findings),
        "remainder": findings.remainder,
        "repeated": _repeated(findings),
        "judged": content.model,
        "records": content.records,
        "confirm": content.confirm,
        "has_map": _has_gap(content.diagnosis),
    }


def _sketch(content: GapReport) -> Markup:
    """With the places of what is part of the answer; what is merely nearest is marked nowhere."""
    marks = [mark_of(number, one) for number, one in enumerate(content.diagnosis.effects, 1)]
    return axis_sketch(marks, content.axes) if content.axes else vehicle_sketch(marks, content.geometry)


def write_gap_report(content: GapReport, path: Path) -> None:
    """Write the page whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(render_gap_report(content), path)


def _has_gap(diagnosis: Diagnosis) -> bool:
    return any(share.share > 0 for share in diagnosis.where)


def _row(cause: Cause, content: GapReport) -> Row:
    name = str(cause.candidate.effect)
    named = next((e for e in content.diagnosis.effects if (e.name, e.where) == (name, cause.candidate.where)), None)
    rivals = rivals_of(named) if named else []
    biased = [(symbol, shift) for symbol, shift in cause.biased.items() if abs(shift) > BIASED]
    return Row(
        name=name,
        where=cause.candidate.where,
        probability=cause.probability,
        numbers=numbers_text(cause.quantities),
        log_odds=cause.log_odds,
        closed=cause.closed,
        rivals=", ".join(rivals) or "–",
        biased=", ".join(f"{symbol} by {shift:+.1f} std" for symbol, shift in biased) or "–",
    )


def _parameters(findings: Findings) -> list[tuple[str, str, str, str]]:
    after, nominal = findings.after, findings.problem.nominal
    values, deviations = findings.before.baseline, findings.before.baseline_std
    if nominal is not None:
        values, deviations = nominal.values, nominal.std
    return [
        (
            name,
            digits.with_std(float(values[index]), float(deviations[index])),
            digits.with_std(float(after.baseline[index]), float(after.baseline_std[index])),
            digits.unit_text(unit),
        )
        for index, (name, unit) in enumerate(zip(findings.problem.names, findings.problem.units, strict=True))
    ]


def _repeated(findings: Findings) -> list[tuple[str, float, float]]:
    """Coordinates with something that repeats, before or after."""
    found, after = findings.repeated_before, findings.repeated_after
    pairs = [(label, before, after.get(label, 0.0)) for label, before in found.items()]
    return [(label, before, now) for label, before, now in pairs if max(before, now) >= REPEATS]
