"""Runs the cases of a trace one after the other, and writes down what came of each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hil.conformance.cases import NOT_APPLICABLE, OWN_TESTS
from hil.conformance.replay import Outcome, Replay
from hil.conformance.trace import Case

_HEAD = """# CiA's conformance test

The trace of a run of CiA's conformance tool that CANopenDemo publishes (Apache-2.0, a CiA 401 device), replayed frame
by frame against an emulated drive (node 4). Of {cases} cases {replayed} are replayed, and {passed} of them pass; {own}
are shown by tests of ours, because the tool skipped or failed them for its device, or the trace does not hold what
counts; {idle} do not apply. Compared is what the protocol fixes: kind and toggle of every answer, abort codes (that of
the trace, or another that the tool accepts), values of the objects of CiA 301, NMT states, error codes, SYNCs. PDO
mapping entries of the CiA 401 device are replaced by those of a drive of the same length and direction.

Written by `quasiomni conformance TRACE --out docs/conformance.md`.

"""


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
        return f"passed, answers compared: {self.outcome.answers}{absent}"


def run_cases(cases: Iterable[Case], replay: Replay) -> list[Verdict]:
    """Replay every case that a replay can say something about, in the order of the trace."""
    elsewhere = {*OWN_TESTS, *NOT_APPLICABLE}
    return [Verdict(case, None if case.number in elsewhere or not case.frames else replay.run(case)) for case in cases]


def write_page(verdicts: Sequence[Verdict]) -> str:
    """A Markdown page with all cases."""
    replayed = [verdict for verdict in verdicts if verdict.outcome is not None]
    passed = sum(verdict.passed for verdict in replayed)
    own = sum(verdict.case.number in OWN_TESTS for verdict in verdicts)
    idle = sum(verdict.case.number in NOT_APPLICABLE for verdict in verdicts)
    head = _HEAD.format(cases=len(verdicts), replayed=len(replayed), passed=passed, own=own, idle=idle)
    rows = [
        f"| {verdict.case.number} | {verdict.case.name} | {_cell(verdict.case.purpose)} | {verdict.case.verdict} "
        f"| {_cell(str(verdict))} |"
        for verdict in verdicts
    ]
    return (
        head
        + "\n".join(("| case | name | purpose | device of the trace | drive |", "|---|---|---|---|---|", *rows))
        + "\n"
    )


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "/").split())
