"""Tables for the terminal; every function returns something that rich can print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from rich import box
from rich.table import Table
from rich.text import Text

from ident.campaign.plan import Plan
from ident.estimate.axis import AxisIdentification
from ident.estimate.result import Identification
from ident.report.digits import MISSING, digits, percent, quantity_text, significant, unit_text, with_std
from ident.report.paper import PaperResult, load_paper_result
from ident.report.rows import ParameterRow, StepRow, loop_rows, parameter_rows, step_rows
from ident.vehicle.parameters import Parameters

WARNING_STYLE = "bold yellow"

_MARKED: Final = {
    "impossible": "no mass, inertia or friction is negative",
    "poor": "the interval is wider than half the value, too little excitation to build on",
}


def parameter_table(identification: Identification, truth: Parameters | None = None) -> Table:
    """Value, standard deviation and 95 % interval of p (18), beside the truth where it is known."""
    rows = parameter_rows(identification, truth)
    headings = ["", "value", "std", "95 % interval", "unit"]
    headings += ["truth", "error", "in std"] if truth else []
    table = _table("Parameters", headings, left=(0, 4))
    for row in rows:
        table.add_row(*_parameter_cells(row), style=WARNING_STYLE if row.estimate.poor else None)
    captions = [text for quality, text in _MARKED.items() if any(row.estimate.quality == quality for row in rows)]
    if captions:
        table.caption = f"Marked: {'; '.join(captions)}."
    return table


def axis_table(label: str, found: AxisIdentification) -> Table:
    """Value, standard deviation and 95 % interval of M, Fv, Fc and offset of one axis."""
    table = _table(f"Parameters of the {label}", ["", "value", "std", "95 % interval", "unit"], left=(0, 4))
    for one in found.estimates:
        low, high = (digits(bound, one.std) for bound in one.ci95)
        unit = unit_text(one.unit)
        table.add_row(one.name, digits(one.value, one.std), digits(one.std, one.std), f"{low} … {high}", unit)
    table.caption = f"Relative error {percent(found.relative_error)}, cond {found.condition:.3g}."
    return table


def _parameter_cells(row: ParameterRow) -> list[str]:
    estimate = row.estimate
    low, high = (digits(bound, estimate.std) for bound in estimate.ci95)
    cells = [
        estimate.name,
        digits(estimate.value, estimate.std),
        digits(estimate.std, estimate.std),
        f"{low} … {high}",
        unit_text(estimate.unit),
    ]
    if row.truth is not None and row.error is not None:
        cells += [digits(row.truth, estimate.std), percent(row.error, signed=True), _signed(row.error_in_std)]
    return cells


def paper_table(identification: Identification, paper: PaperResult | None = None) -> Table:
    """The result beside Table 2 of the paper."""
    table = _table("Beside Table 2 of the paper", ["", "identified", "Table 2", "difference", "unit"], left=(0, 4))
    published = (paper or load_paper_result()).parameters
    for row in parameter_rows(identification):
        estimate = row.estimate
        value, std = published[estimate.name], published.std_of(estimate.name)
        table.add_row(
            estimate.name,
            with_std(estimate.value, estimate.std),
            with_std(value, std),
            percent(estimate.value / value - 1, signed=True),
            unit_text(estimate.unit),
        )
    return table


def excitation_table(identification: Identification) -> Table:
    """How well each parameter was excited, and what the textbook would have claimed of it.

    Independence 1 is excitation that nothing else imitates. The naive std takes residuals as white and of one size.
    """
    headings = ["", "independence", "std", "naive std", "ratio", "from B_w", "verdict", "method"]
    table = _table("Excitation and standard deviations", headings, left=(0, 6, 7))
    for row in parameter_rows(identification):
        estimate = row.estimate
        table.add_row(
            estimate.name,
            significant(estimate.independence, 2),
            digits(estimate.std, estimate.std),
            digits(estimate.naive_std, estimate.naive_std),
            significant(row.inflation, 2),
            percent(row.inertia_share),
            estimate.quality,
            estimate.method,
            style=WARNING_STYLE if estimate.poor else None,
        )
    return table


def step_table(identification: Identification) -> Table:
    """Signal, residual, noise and model error (rms over the rows kept) of every generalized torque, and NRMSE."""
    headings = ["step", "of", "use", "signal", "residual", "noise", "model\nerror", "unit", "kept", "NRMSE"]
    table = _table("Generalized torques, rms", headings, left=(0, 1, 2, 7))
    for row in step_rows(identification):
        table.add_row(*_step_cells(row))
    return table


def _step_cells(row: StepRow) -> list[str]:
    floor = row.floor
    sizes = [significant(size) for size in (floor.signal, floor.residual, floor.noise, floor.model_error)]
    return [floor.step, floor.coordinate, row.role.value, *sizes, row.unit, percent(row.kept), percent(floor.nrmse)]


def loop_table(plan: Plan) -> Table:
    """Crossovers and margins of every cascade, as designed from the prior parameters."""
    headings = [
        "loop",
        "velocity\nrad/s",
        "phase\n°",
        "gain\n-",
        "slipping\n°",
        "position\nrad/s",
        "phase\n°",
        "gain\n-",
    ]
    table = _table("Control loops: crossover and margins", headings, left=(0,))
    for row in loop_rows(plan.designs):
        design = row.design
        table.add_row(
            row.coordinate,
            significant(design.velocity_crossover),
            significant(design.velocity_phase_margin, 2),
            significant(design.velocity_gain_margin, 2),
            significant(design.slipping_phase_margin, 2),
            significant(design.position_crossover),
            significant(design.position_phase_margin, 2),
            significant(design.position_gain_margin, 2),
        )
    return table


def room_table(plan: Plan) -> Table:
    """Floor that the campaign covers from where it starts, beside the floor that the vehicle file allows."""
    room, limits = plan.room(), plan.vehicle.limits
    table = _table("Room needed, from the vehicle's centre", ["", "m", "of which", "floor there m"], left=(0, 2))
    for name, size, parts, there in (
        ("along", room.length, f"{room.ahead:.2f} ahead, {room.behind:.2f} behind", limits.floor_length),
        ("across", room.width, f"{room.left:.2f} left, {room.right:.2f} right", limits.floor_width),
    ):
        table.add_row(name, f"{size:.2f}", parts, f"{there:.2f}")
    return table


def condition_line(identification: Identification, paper: PaperResult | None = None) -> Text:
    """The condition number beside the paper's."""
    published = paper or load_paper_result()
    return Text.assemble(
        "cond(Θ₁ᵀΘ₁), unit-norm columns, rows as fitted: ",
        (f"{identification.condition:.2f}", "bold"),
        f"  (paper: {published.condition:.2f})",
    )


def lag_line(identification: Identification) -> Text | None:
    """How late all torques act, which is judged by `diagnose --model`; None where the record does not say."""
    lag = identification.lag
    if lag is None:
        return None
    return Text.assemble("Torques act later than they are recorded: ", (quantity_text(lag.value, lag.std, "s"), "bold"))


def _signed(value: float | None) -> str:
    return MISSING if value is None else f"{value:+.1f}"


def _table(title: str, headings: Sequence[str], left: Sequence[int]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, padding=0)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index in left else "right", no_wrap=True)
    return table
