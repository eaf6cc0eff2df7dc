"""What to drive next."""

from __future__ import annotations

from collections.abc import Sequence

from ident.gap.judge import Findings


def next_experiment(findings: Findings, steps: Sequence[str]) -> str | None:
    """x."""
    return None
