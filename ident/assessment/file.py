"""The assessment in `parameters.toml`, and the refusal of what it calls unusable."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from ident.assessment.verdict import Assessment, Verdict
from ident.errors import UserError

TABLE: Final = "assessment"


def assessment_text(assessment: Assessment) -> str:
    """Table `[assessment]` with one `[[assessment.reasons]]` each."""
    lines = ["", f"[{TABLE}]", f'verdict = "{assessment.verdict}"']
    for reason in assessment.reasons:
        lines += ["", f"[[{TABLE}.reasons]]", f'code = "{reason.code}"', f"channel = {json.dumps(reason.channel)}"]
        lines += [f"value = {_number(reason.value)}", f"limit = {_number(reason.limit)}"]
        lines += [f'verdict = "{reason.verdict}"', f"text = {json.dumps(reason.text)}"]
    return "\n".join(lines) + "\n"


def refuse_unusable(document: Mapping[str, Any], where: str, *, force: bool) -> None:
    """Refuse parameters that were assessed as unusable; a file without assessment, by hand for one, passes.

    Args:
        document: a parsed `parameters.toml`.
        where: what it is, for the message.
        force: take it all the same.

    Raises:
        UserError: it is unusable; with the first reason.
    """
    table = document.get(TABLE)
    if force or not isinstance(table, Mapping) or table.get("verdict") != Verdict.UNUSABLE:
        return
    reasons = table.get("reasons")
    first = reasons[0] if isinstance(reasons, list) and reasons and isinstance(reasons[0], Mapping) else {}
    raise UserError(
        f"{where} was assessed as unusable. {first.get('text', '')}".rstrip(),
        "Mend the record or the vehicle file and identify again, or take it all the same: --force.",
    )


def _number(value: float) -> str:
    """As TOML writes it, whole numbers with a point."""
    return repr(float(f"{value:.6g}"))
