"""What came of a scenario: lines, JSON, JUnit XML."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

from hil.scenario.running import ScenarioReport
from hil.scenario.watching import Outcome
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.scenario/1"


def headline(report: ScenarioReport) -> str:
    """How many expectations held, in one sentence."""
    passed = sum(outcome.passed for outcome in report.outcomes)
    return f"{report.scenario.name}: {passed} of {len(report.outcomes)} expectations hold."


def lines(report: ScenarioReport) -> Iterator[str]:
    """One line for each expectation, with time and value, and what else happened."""
    yield headline(report)
    yield from (f"  {outcome}" for outcome in report.outcomes)
    yield from report.notes


def as_json(report: ScenarioReport) -> dict[str, Any]:
    """All of it; times in s from the beginning of the scenario."""
    return {
        "schema": SCHEMA,
        "scenario": str(report.scenario.path),
        "name": report.scenario.name,
        "passed": report.passed,
        "begin": report.begin,
        "notes": list(report.notes),
        "expectations": [
            {
                "text": str(outcome.expected),
                "passed": outcome.passed,
                "time": outcome.time,
                "found": outcome.found,
                "at": outcome.expected.at,
                "span": str(outcome.expected.span),
                "duration": outcome.expected.duration,
            }
            for outcome in report.outcomes
        ],
    }


def write_json(report: ScenarioReport, path: Path) -> None:
    """Write `as_json`, whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(json.dumps(as_json(report), indent=2, ensure_ascii=False, allow_nan=False) + "\n", path)


def write_junit(report: ScenarioReport, path: Path) -> None:
    """Write JUnit XML, one test case an expectation, whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(ElementTree.tostring(_suites(report), encoding="utf-8", xml_declaration=True), path)


def _suites(report: ScenarioReport) -> ElementTree.Element:
    failures = sum(not outcome.passed for outcome in report.outcomes)
    counts = {"tests": str(len(report.outcomes)), "failures": str(failures), "errors": "0", "skipped": "0"}
    suites = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": report.scenario.name, **counts})
    for outcome in report.outcomes:
        _case(suite, report, outcome)
    if report.notes:
        ElementTree.SubElement(suite, "system-out").text = "\n".join(report.notes)
    return suites


def _case(suite: ElementTree.Element, report: ScenarioReport, outcome: Outcome) -> None:
    duration = max((outcome.time or 0.0) - outcome.expected.at, 0.0)
    named = {"classname": report.scenario.name, "name": str(outcome.expected), "time": f"{duration:.6f}"}
    case = ElementTree.SubElement(suite, "testcase", named)
    if outcome.passed:
        ElementTree.SubElement(case, "system-out").text = str(outcome)
    else:
        failure = ElementTree.SubElement(case, "failure", {"message": str(outcome)})
        failure.text = f"{report.scenario.path}: {outcome}"
