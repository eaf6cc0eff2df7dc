"""The pytest plugin: fixtures of a bench, recordings and pictures of failures, the health of the bus.

Loaded by pytest in every project, it imports nothing heavy before a test asks for a fixture.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    import can

    from emulator.vehicle import EmulatedVehicle
    from hil.bench.prototypes import Emulated
    from hil.bus.clock import SimulatedClock
    from hil.faults import FaultInjector
    from hil.pytest_plugin.expectations import Expect
    from hil.pytest_plugin.health import Symptom
    from hil.pytest_plugin.recording import Artifacts
    from hil.pytest_plugin.world import World
    from hil.scenario.running import ScenarioReport

_WORLD: Final[pytest.StashKey[World]] = pytest.StashKey()
_ARTIFACTS: Final[pytest.StashKey[Artifacts]] = pytest.StashKey()
_ALLOWED: Final[pytest.StashKey[set[Symptom]]] = pytest.StashKey()
_FAILED: Final[pytest.StashKey[bool]] = pytest.StashKey()
_SCENARIO: Final = ".scenario.toml"
"""How the names of files end that are tests by themselves."""
_CHOICES: Final = {
    "prototype": "prototype",
    "network": None,
    "seed": 1,
    "delays": False,
    "noise": 1.0,
    "engine": None,
}
"""What the marker can say, and what holds where it does not."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Where recordings go, and which tests leave them."""
    group = parser.getgroup("hil", "hardware in the loop")
    group.addoption("--hil-artifacts", default="hil-artifacts", help="Folder for recordings and timelines.")
    group.addoption("--hil-engine", help="Physics engine: pybullet or mujoco. Default: the first that is installed.")
    group.addoption(
        "--hil-keep", choices=("failed", "all"), default="failed", help="Which tests leave a recording and a timeline."
    )


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    choices = ", ".join(f"{name}={value!r}" for name, value in _CHOICES.items())
    config.addinivalue_line("markers", f"hil({choices}): what the fixture `bench` is built of")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach recording and timeline to the report of a test that failed."""
    report = yield
    world = item.stash.get(_WORLD, None)
    if world is None:
        return report
    if report.when != "teardown":
        # A fixture that drives, and fails, is a test that has failed.
        item.stash[_FAILED] = report.failed
    keep = item.config.getoption("--hil-keep") == "all" and report.when == "call"
    if report.failed or keep:
        _attach(item, report)
    return report


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A scenario file is a test."""
    if not file_path.name.endswith(_SCENARIO):
        return None
    from hil.pytest_plugin.scenarios import ScenarioFile

    collected: pytest.Collector = ScenarioFile.from_parent(parent, path=file_path)
    return collected


@pytest.fixture
def vehicle(request: pytest.FixtureRequest) -> Iterator[EmulatedVehicle]:
    """An emulated vehicle on the floor, at rest; the marker `hil` says which."""
    from emulator.engine.choice import ENGINES
    from emulator.vehicle import EmulatedVehicle
    from ident.extras import named_engine, require_engine

    asked = _asked(request)
    named = asked["engine"] or request.config.getoption("--hil-engine")
    engine = require_engine(None if named is None else named_engine(named), "The fixture `vehicle`")
    with EmulatedVehicle(
        _emulated(asked).prototype,
        seed=int(asked["seed"]),
        noise_scale=float(asked["noise"]),
        make_engine=ENGINES[engine],
    ) as emulated:
        yield emulated


@pytest.fixture
def bench(request: pytest.FixtureRequest, vehicle: EmulatedVehicle) -> Iterator[World]:
    """The vehicle behind a bus in lockstep; at the end the bus has to be well, see the fixture `allow`."""
    from hil.bench.lockstep import LockstepBench
    from hil.pytest_plugin.world import World

    asked = _asked(request)
    seed, delays = int(asked["seed"]), bool(asked["delays"])
    network = _emulated(asked).network
    with LockstepBench(vehicle, network.path, ground=vehicle, seed=seed, delays=delays) as lockstep:
        world = World(lockstep, vehicle, network)
        keep(request.node, world)
        yield world
        describe(request.node, world, seed)
        _assert_health(request.node, world)


@pytest.fixture
def bus(bench: World) -> can.BusABC:
    """The endpoint of the test's own master."""
    return bench.bus


@pytest.fixture
def clock(bench: World) -> SimulatedClock:
    """Simulated time."""
    return bench.clock


@pytest.fixture
def faults(bench: World) -> FaultInjector:
    """What can go wrong: `faults.add("power@drive_fl:from=1s,to=1.5s")`."""
    return bench.faults


@pytest.fixture
def expect(bench: World) -> Expect:
    """Begins a sentence: `expect(at_rest()).within(3.0)`."""
    from hil.pytest_plugin.expectations import Expect

    return Expect(bench)


@pytest.fixture
def scenario(request: pytest.FixtureRequest, bench: World) -> Callable[[str | Path], ScenarioReport]:
    """Runs a scenario file, named from the test's own folder: `scenario("bad_day.toml")`; fails where it does."""
    from hil.pytest_plugin.scenarios import hold
    from hil.scenario.reader import read_scenario
    from hil.scenario.running import run_scenario

    def run(path: str | Path) -> ScenarioReport:
        report = run_scenario(read_scenario(request.path.parent / path), bench)
        hold(report)
        return report

    return run


@pytest.fixture
def allow(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Symptoms that this test provokes on purpose: `allow("lost heartbeat", "error frames")`."""
    from hil.pytest_plugin.health import symptom

    allowed = request.node.stash.setdefault(_ALLOWED, set())

    def allow_symptoms(*symptoms: str) -> None:
        allowed.update(map(symptom, symptoms))

    return allow_symptoms


def _asked(request: pytest.FixtureRequest) -> dict[str, Any]:
    from ident.errors import UserError

    marker = request.node.get_closest_marker("hil")
    given = {} if marker is None else dict(marker.kwargs)
    for wrong in [*map(repr, marker.args if marker else ()), *(name for name in given if name not in _CHOICES)]:
        raise UserError(f"The marker hil takes no {wrong}.", f"Use NAME=VALUE with one of {', '.join(_CHOICES)}.")
    return {**_CHOICES, **given}


def _emulated(asked: Mapping[str, Any]) -> Emulated:
    """The prototype and the network that were asked for; they agree."""
    from hil.bench.prototypes import load_emulated
    from hil.network import network_file_of

    prototype = str(asked["prototype"])
    return load_emulated(prototype, Path(asked["network"] or network_file_of(prototype)))


def _file_name(node_id: str) -> str:
    return re.sub(r"[^\w.-]+", "_", node_id.rpartition("/")[2])


def describe(item: pytest.Item, world: World, seed: int) -> None:
    """What JUnit XML tells of the test."""
    load = world.bench.load
    faults = [str(injected.fault) for injected in world.injected]
    item.user_properties += [
        ("hil_seed", seed),
        ("hil_simulated_seconds", round(world.now, 6)),
        ("hil_frames", len(world.frames)),
        ("hil_error_frames", load.errors),
        ("hil_bus_load_mean", round(load.mean, 4)),
        ("hil_bus_load_peak", round(load.peak, 4)),
        *(("hil_fault", fault) for fault in faults),
    ]


def _assert_health(item: pytest.Item, world: World) -> None:
    """The bus was well, or the test allows that it was not; a test that has failed already says enough."""
    from hil.pytest_plugin.health import examine

    if item.stash.get(_FAILED, False):
        return
    allowed = item.stash.get(_ALLOWED, set())
    findings = examine(world.frames, world.bench.load.peak, world.network, world.now)
    wrong = [finding for finding in findings if finding.symptom not in allowed]
    if wrong:
        listed = "\n".join(f"  {finding.symptom}: {finding.what}" for finding in wrong)
        symptoms = ", ".join(dict.fromkeys(f'"{finding.symptom}"' for finding in wrong))
        pytest.fail(f"The bus was not well:\n{listed}\nIf the test provokes that: allow({symptoms}).", pytrace=False)


def keep(item: pytest.Item, world: World) -> None:
    """Let an item that builds a bench by itself have what the fixture `bench` gives: artifacts, numbers."""
    from hil.pytest_plugin.recording import Artifacts

    item.stash[_WORLD] = world
    folder = Path(item.config.getoption("--hil-artifacts"))
    item.stash[_ARTIFACTS] = Artifacts(folder / _file_name(item.nodeid), item.nodeid)


def _attach(item: pytest.Item, report: pytest.TestReport) -> None:
    artifacts = item.stash[_ARTIFACTS]
    files = artifacts.write(item.stash[_WORLD])
    report.sections.append(("hil", "\n".join(f"{name}: {path}" for name, path in files.items())))
    # On the item: what JUnit XML tells comes with the report of the teardown.
    known = dict(item.user_properties)
    item.user_properties += [(f"hil_{name}", str(path)) for name, path in files.items() if f"hil_{name}" not in known]
    report.user_properties = list(item.user_properties)
