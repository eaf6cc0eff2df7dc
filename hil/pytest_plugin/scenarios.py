"""Scenario files under pytest: each `*.scenario.toml` with set-points is a test."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import pytest

from hil.pytest_plugin import plugin
from hil.scenario.bench import chosen_by, run_alone
from hil.scenario.reader import read_scenario
from hil.scenario.report import lines
from hil.scenario.running import ScenarioReport
from ident.errors import UserError
from ident.extras import named_engine


def hold(report: ScenarioReport) -> None:
    """See that everything was as expected.

    Raises:
        AssertionError: it was not; with every expectation, its time and what was found.
    """
    __tracebackhide__ = True
    if not report.passed:
        raise AssertionError("\n".join(lines(report)))


class ScenarioFile(pytest.File):
    """A scenario file."""

    def collect(self) -> Iterable[pytest.Item]:
        """Its one test."""
        yield ScenarioItem.from_parent(self, name=self.path.name.removesuffix(".scenario.toml"))


class ScenarioItem(pytest.Item):
    """A scenario on a bench of its own."""

    def runtest(self) -> None:
        """Run it.

        Raises:
            UserError: the file cannot be read or run.
            AssertionError: something was not as expected.
        """
        scenario = read_scenario(self.path)
        engine = self.config.getoption("--hil-engine")
        choice = replace(chosen_by(scenario), engine=None if engine is None else named_engine(engine))
        report, world = run_alone(scenario, choice)
        plugin.keep(self, world)
        plugin.describe(self, world, choice.seed)
        self.user_properties += [("hil_expectation", str(outcome)) for outcome in report.outcomes]
        hold(report)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *_: Any) -> str:
        """What was expected and found, or what is wrong with the file, without a traceback."""
        error = excinfo.value
        if isinstance(error, UserError):
            return f"{error.what}\n{error.remedy}"
        return str(error) if isinstance(error, AssertionError) else str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Any, int | None, str]:
        """Where it is, and what it is called."""
        return self.path, None, f"scenario: {self.name}"
