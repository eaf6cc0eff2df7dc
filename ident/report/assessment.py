"""The assessment in words, shared by terminal and HTML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from rich.text import Text

from ident.assessment import Assessment, Verdict

_MEANINGS: Final[Mapping[Verdict, str]] = {
    Verdict.GOOD: "nothing speaks against this result",
    Verdict.DOUBTFUL: "do not build on this result before its reasons are understood",
    Verdict.UNUSABLE: "this result cannot be true",
}
_STYLES: Final[Mapping[Verdict, str]] = {
    Verdict.GOOD: "bold green",
    Verdict.DOUBTFUL: "bold yellow",
    Verdict.UNUSABLE: "bold red",
}


def headline(assessment: Assessment) -> str:
    """The verdict and what it means, one sentence."""
    verdict = assessment.verdict
    return f"{verdict.value.capitalize()}: {_MEANINGS[verdict]}."


def assessment_lines(assessment: Assessment, command: str) -> list[Text]:
    """First lines for the terminal: the verdict, its reasons, and what to run next where it is not good.

    Args:
        assessment: of a result.
        command: that looks for the cause.
    """
    lines = [Text(headline(assessment), style=_STYLES[assessment.verdict])]
    lines += [Text(f"  {reason.verdict}: {reason.text}") for reason in assessment.reasons]
    if assessment.reasons:
        lines.append(Text.assemble("Next: ", (command, "bold")))
    return lines
