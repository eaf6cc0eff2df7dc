"""Faults of the record in words: a few lines for the terminal, a page for the shelf."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ident.faults import Fault
from ident.report.digits import quantity_text
from ident.report.page import render
from ident.writing import write_whole


def headline(faults: Sequence[Fault]) -> str:
    """What is wrong, in one sentence; the surest fault."""
    more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
    return f"The record is at fault: {faults[0].text}{more}."


def fault_lines(faults: Sequence[Fault]) -> list[str]:
    """The verdict, every fault with its evidence and its set, and what to do."""
    lines = [headline(faults)]
    lines += [f"  {_number(fault)}{evidence_text(fault)}{_also(fault)}." for fault in faults]
    lines += [f"Next: {remedy}" for remedy in dict.fromkeys(fault.remedy for fault in faults)]
    return [*lines, "Effects of the machine were not looked for: mend the record, and diagnose again."]


def evidence_text(fault: Fault) -> str:
    """How sure it is, and whether the rest is sound."""
    undone = "undone, the record fits" if fault.undo_fits else "the record does not fit with it undone"
    return f"{fault.name}@{fault.channel}: log odds {fault.evidence:.0f}; {undone}"


def _number(fault: Fault) -> str:
    return f"{quantity_text(fault.value, fault.std, fault.unit)} " if fault.std > 0 else ""


def _also(fault: Fault) -> str:
    return f"; the same in these records: {', '.join(fault.also)}" if fault.also else ""


def render_fault_report(faults: Sequence[Fault], records: Sequence[str]) -> str:
    """The whole page as a string; styles inline, nothing is loaded from anywhere."""
    return render("faults.html.j2", headline=headline(faults), faults=faults, records=records, evidence=evidence_text)


def write_fault_report(faults: Sequence[Fault], records: Sequence[str], path: Path) -> None:
    """Write the page whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(render_fault_report(faults, records), path)
