"""Scenario files in a user's project: tests by themselves, and a fixture beside a master under test."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

# Each run in this process forgets what it has loaded; what is heavy and loaded here stays.
import hil.pytest_plugin.recording
import hil.pytest_plugin.scenarios
import hil.testing  # noqa: F401

pytest_plugins = ["pytester"]

STAYS = '[[expect]]\nthat = "at_rest"\nthroughout = 0.1\n'
NODS = "[[setpoint]]\nat = 0.05\ntorque = 0.01\n"


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeini("[pytest]\naddopts = -p no:cacheprovider\n")
    return pytester


def written(project: pytest.Pytester, name: str, text: str) -> Path:
    path = project.path / name
    path.write_text(text)
    return path


def test_every_scenario_file_is_a_test_and_says_what_it_found(project: pytest.Pytester) -> None:
    written(project, "stays.scenario.toml", NODS + STAYS)
    written(project, "flies.scenario.toml", f"{NODS}[[expect]]\nthat = 'moving'\nfaster_than = 9\nwithin = 0.1\n")
    written(project, "wrong.scenario.toml", "[[expect]]\nthat = 'atrest'\n")
    written(project, "other.toml", "[table]\n")
    result = project.runpytest("--junitxml=junit.xml")
    result.assert_outcomes(passed=1, failed=2)
    result.stdout.fnmatch_lines(
        [
            "*FAIL: the vehicle to be faster than 9 m/s within 0.1 s from 0 s on; at 0.1*it moves at 0.0*",
            "*timeline: hil-artifacts*flies*.svg",
            "*wrong.scenario.toml: expect?1?.that = 'atrest' is not known.*",
        ]
    )
    values = [one.attrib["value"] for one in ElementTree.parse(project.path / "junit.xml").iter("property")]
    assert any(value.startswith("pass: the vehicle to be at rest") for value in values)


def test_a_scenario_runs_beside_a_master_under_test(project: pytest.Pytester) -> None:
    written(project, "beside.toml", STAYS)
    written(project, "fails.toml", "[[expect]]\nthat = 'moving'\nfaster_than = 9\nwithin = 0.05\n")
    project.makepyfile(
        """
        import pytest
        from hil.master import Master

        @pytest.fixture
        def driving(bench):
            master = Master(bench.bus, bench.clock, bench.network)
            master.boot()
            master.enable()
            bench.every_cycle(lambda: master.exchange((0.0,) * 4))

        def test_holds(driving, scenario):
            assert scenario("beside.toml").passed

        def test_fails(driving, scenario):
            scenario("fails.toml")
        """
    )
    result = project.runpytest()
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*FAIL: the vehicle to be faster than 9 m/s*"])
