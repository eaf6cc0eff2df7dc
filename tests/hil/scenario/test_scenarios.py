"""Scenarios on the bench: what is expected and comes true, what does not, when, and what was found."""

from __future__ import annotations

import json
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.bench.serving import VehicleServer
from hil.bus.clock import WallClock
from hil.bus.unix import UnixHub
from hil.master import Master
from hil.network import Network
from hil.scenario.bench import chosen_by, run_alone
from hil.scenario.reader import read_scenario
from hil.scenario.report import as_json, write_junit
from hil.scenario.running import ScenarioReport, run_scenario
from hil.scenario.serving import ServedScenario, ServedWorld
from hil.testing import World
from ident.errors import BusError, DataFileError, UserError

DRIVES = "[[setpoint]]\nat = 0.1\ntorque = 0.6\nover = 0.1\n"


def scenario_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "day.scenario.toml"
    path.write_text(text)
    return path


def run(tmp_path: Path, text: str) -> ScenarioReport:
    scenario = read_scenario(scenario_file(tmp_path, text))
    return run_alone(scenario, chosen_by(scenario))[0]


STOPS = f"""
{DRIVES}
[[fault]]
at = 1.0
inject = "trip@drive_fl:code=0x2310"

[[expect]]
at = 0.9
that = "moving"
faster_than = 0.05

[[expect]]
at = 0.2
that = "value"
node = "drive_fl"
object = 0x6077
at_least = 400
within = 0.2

[[expect]]
at = 1.0
that = "emergency"
node = "drive_fl"
code = 0x2310
within = 0.01

[[expect]]
at = 0.5
that = "all_drives"
state = "operation enabled"
throughout = 0.4

[[expect]]
at = 1.0
that = "at_rest"
within = 2.0

[[expect]]
at = 0.0
that = "emergency"
node = "drive_rr"
never_within = 0.9
"""


def test_a_scenario_that_holds_says_when_and_by_what(tmp_path: Path) -> None:
    report = run(tmp_path, STOPS)
    assert report.passed, [str(outcome) for outcome in report.outcomes]
    moving, torque, emergency, enabled, rest, quiet = report.outcomes
    assert moving.time == pytest.approx(0.9, abs=1e-6)
    assert 0.2 <= (torque.time or 0.0) < 0.26
    assert emergency.time == pytest.approx(1.0, abs=0.0041)
    assert emergency.found == "it sent 2310h"
    assert enabled.time == pytest.approx(0.9, abs=0.0021)
    assert 1.0 < (rest.time or 0.0) < 2.5
    assert quiet.found == "it sent none"
    assert any("scenario's master stopped" in note and "drive_fl" in note for note in report.notes)


def test_the_same_file_says_the_same_again_to_the_last_digit(tmp_path: Path) -> None:
    one, other = (as_json(run(tmp_path, STOPS)) for _ in range(2))
    assert one == other


FAILS = {
    "a speed that is not reached": ("that = 'moving'\nfaster_than = 5\nwithin = 0.3\n", 0.3, "it moves at"),
    "a state that ends": (
        "that = 'all_drives'\nstate = 'operation enabled'\nthroughout = 0.4\n",
        0.2,
        "drive_fl is fault",
    ),
    "an emergency that comes": ("that = 'emergency'\nnode = 'drive_fl'\nnever_within = 0.4\n", 0.2, "it sent 7121h"),
    "a value out of bounds": ("that = 'value'\nnode = 'drive_fl'\nobject = 0x6077\nat_most = -5\n", 0.0, "it is"),
    "a frame that nobody sends": ("that = 'frame'\nid = 0x123\nwithin = 0.1\n", 0.1, "none of the"),
}


@pytest.mark.parametrize(("expected", "when", "found"), FAILS.values(), ids=FAILS)
def test_what_does_not_hold_fails_when_it_is_decided(tmp_path: Path, expected: str, when: float, found: str) -> None:
    fault = '[[fault]]\nat = 0.4\ninject = "trip@drive_fl:code=0x7121"\n'
    report = run(tmp_path, f"{DRIVES}{fault}[[expect]]\nat = 0.2\n{expected}")
    (outcome,) = report.outcomes
    assert not outcome.passed
    assert outcome.time == pytest.approx(0.2 + when, abs=0.0121)
    assert found in outcome.found
    assert str(outcome).startswith("FAIL: ")


def test_objects_are_written_when_they_are_due(tmp_path: Path) -> None:
    """A drive that may give 200 per mille at most does so from then on."""
    limit = "[[setpoint]]\nat = 0.5\nnode = 'drive_rl'\nobject = 0x6072\nvalue = 200\n"
    bounds = "[[expect]]\nat = {}\nthat = 'value'\nnode = 'drive_rl'\nobject = 0x6077\n{}\n"
    report = run(tmp_path, DRIVES + limit + bounds.format(0.45, "at_least = 400") + bounds.format(0.7, "at_most = 250"))
    assert report.passed, [str(outcome) for outcome in report.outcomes]


WRONG = {
    "an object that is not there": ("node = 'drive_fl'\nobject = 0x2FFF\nvalue = 1\n", "no such object"),
    "an object that is read only": ("node = 'drive_fl'\nobject = 0x6064\nvalue = 1\n", "read only"),
    "a value that does not fit": ("node = 'drive_fl'\nobject = 0x6072\nvalue = 70000\n", "16 bits"),
}


@pytest.mark.parametrize(("keys", "said"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_written_is_refused_before_anything_moves(tmp_path: Path, keys: str, said: str) -> None:
    with pytest.raises(DataFileError, match=said):
        run(tmp_path, f"[[setpoint]]\nat = 5\n{keys}[[expect]]\nthat = 'at_rest'\n")


def test_places_and_objects_that_are_not_there_are_named_with_the_file(tmp_path: Path) -> None:
    fault = "[[fault]]\ninject = 'power@drive_xx'\n"
    with pytest.raises(DataFileError, match=r"day\.scenario\.toml.*drive_xx"):
        run(tmp_path, f"{DRIVES}{fault}[[expect]]\nthat = 'at_rest'\n")
    nothing = "[[expect]]\nthat = 'value'\nnode = 'drive_fl'\nobject = 0x2FFF\nat_most = 1\n"
    with pytest.raises(UserError, match=r"expect\[1\].*2FFF"):
        run(tmp_path, DRIVES + nothing)


def test_nobody_drives_a_file_without_set_points(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"no \[\[setpoint\]\]"):
        run(tmp_path, "[[expect]]\nthat = 'at_rest'\n")


def test_junit_has_a_case_an_expectation(tmp_path: Path) -> None:
    report = run(tmp_path, f"{DRIVES}[[expect]]\nthat = 'at_rest'\n[[expect]]\nat = 0.3\nthat = 'at_rest'\n")
    write_junit(report, tmp_path / "junit.xml")
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()[0]
    assert (suite.attrib["tests"], suite.attrib["failures"]) == ("2", "1")
    cases = suite.findall("testcase")
    assert [case.find("failure") is None for case in cases] == [True, False]
    assert "it moves at" in cases[1].find("failure").attrib["message"]  # type: ignore[union-attr]
    assert json.loads(json.dumps(as_json(report), allow_nan=False))["passed"] is False


BESIDE = """
[[fault]]
at = 0.2
inject = "trip@drive_rl"

[[expect]]
at = 0.1
that = "all_drives"
state = "operation enabled"

[[expect]]
at = 0.2
that = "emergency"
node = "drive_rl"
code = 0x2310
within = 0.3

[[expect]]
at = 0.2
that = "frame"
id = 0x123
within = 0.1
"""


def test_what_passes_on_a_served_bus_is_watched_beside_the_master_that_drives(tmp_path: Path, network: Network) -> None:
    """In simulated time: what is served is a bench, so that no busy machine makes a master late."""
    scenario = read_scenario(scenario_file(tmp_path, BESIDE))
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle, ground=vehicle) as bench:
        world = ServedWorld(vehicle, network)
        watched = ServedScenario(scenario, world)
        world.server = bench
        bench.listen(lambda message: world.hear(message.arbitration_id, bytes(message.data)))
        master = Master(bench.bus, bench.clock, network)
        master.boot()
        assert not watched.over(), "nobody has enabled the drives yet"
        master.enable()
        while not watched.over():
            try:
                master.exchange((0.2,) * 4)
            except BusError:
                bench.bus.recv(0.002)
    enabled, emergency, foreign = watched.report().outcomes
    assert enabled.passed
    assert emergency.passed
    assert emergency.found == "it sent 2310h"
    assert not foreign.passed


def test_a_served_scenario_that_nobody_enabled_has_failed_in_all_of_it(tmp_path: Path, network: Network) -> None:
    scenario = read_scenario(scenario_file(tmp_path, BESIDE))
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, UnixHub(tmp_path / "bus") as hub:
        world = ServedWorld(vehicle, network)
        watched = ServedScenario(scenario, world)
        world.server = VehicleServer(vehicle, hub, WallClock(), network.path, hear=world.hear)
        end = time.monotonic() + 0.2
        world.server.serve(lambda: watched.over() or time.monotonic() > end)
    assert [outcome.found for outcome in watched.report().outcomes] == ["the drives were never enabled"] * 3


def test_a_master_under_test_drives_where_the_file_does_not(tmp_path: Path, network: Network) -> None:
    scenario = read_scenario(scenario_file(tmp_path, BESIDE))
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle, ground=vehicle) as bench:
        world = World(bench, vehicle, network)
        master = Master(world.bus, world.clock, network)
        master.boot()
        master.enable()

        def step() -> None:
            try:
                master.exchange((0.2,) * 4)
            except BusError:
                world.bus.recv(0.002)

        world.every_cycle(step)
        report = run_scenario(scenario, world)
    assert [outcome.passed for outcome in report.outcomes] == [True, True, False]
    assert any(note.text.startswith("FAILED: ") for note in world.notes)
