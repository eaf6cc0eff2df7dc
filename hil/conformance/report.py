"""Runs the cases of a trace one after the other, and writes down what came of each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hil.conformance.cases import NOT_APPLICABLE, OWN_TESTS
from hil.conformance.replay import Outcome, Replay
from hil.conformance.trace import Case


@dataclass(frozen=True)
class Verdict:
    """What is known about a case.

    Attributes:
        case: the case.
        outcome: of its replay, None where it was not replayed.
    """

    case: Case
    outcome: Outcome | None

    @property
    def passed(self) -> bool:
        """Replayed, and the node did what the trace shows."""
        return self.outcome is not None and self.outcome.passed

    def __str__(self) -> str:
        number = self.case.number
        if number in NOT_APPLICABLE:
            return f"does not apply: {NOT_APPLICABLE[number]}"
        if number in OWN_TESTS:
            return f"own test: `{OWN_TESTS[number].rpartition('/')[2]}`"
        if self.outcome is None:
            return "no frames in the trace"
        if not self.outcome.passed:
            return f"**deviates**: {self.outcome.deviations[0]}"
        absent = f", {self.outcome.absent} of them about objects of another profile" if self.outcome.absent else ""
        return f"passed, {self.outcome.answers} answers{absent}"


def run_cases(cases: Iterable[Case], replay: Replay) -> list[Verdict]:
    """Replay every case that a replay can say something about, in the order of the trace."""
    elsewhere = {*OWN_TESTS, *NOT_APPLICABLE}
    return [Verdict(case, None if case.number in elsewhere or not case.frames else replay.run(case)) for case in cases]


def write_table(verdicts: Sequence[Verdict]) -> str:
    """A Markdown table of all cases."""
    rows = [
        f"| {verdict.case.number} | {verdict.case.name} | {_cell(verdict.case.purpose)} | {verdict.case.verdict} "
        f"| {_cell(str(verdict))} |"
        for verdict in verdicts
    ]
    return "\n".join(("| case | name | purpose | device of the trace | drive |", "|---|---|---|---|---|", *rows)) + "\n"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "/").split())
