"""Runs a scenario on a bench in this process: by its own master, or beside a master that is under test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import canopen

from hil.faults import Fault
from hil.master import Master
from hil.network import DRIVES
from hil.network.cia import DriveState
from hil.pytest_plugin.world import Observed, World
from hil.scenario.scenario import Begin, Scenario, Writing
from hil.scenario.watching import Outcome, Watch
from ident.errors import BusError, DataFileError, UserError

ENABLING_TIME = 30.0
"""Longest time that a master under test may take to enable all drives [s]."""


@dataclass(frozen=True)
class ScenarioReport:
    """What came of a scenario.

    Attributes:
        scenario: that was run.
        outcomes: of its expectations, in the order of the file.
        begin: instant of the bench from which its times count [s].
        notes: what else happened.
    """

    scenario: Scenario
    outcomes: tuple[Outcome, ...]
    begin: float
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Everything was as expected."""
        return all(outcome.passed for outcome in self.outcomes)


def run_scenario(scenario: Scenario, world: World, faults: Sequence[Fault] = ()) -> ScenarioReport:
    """Run a scenario on a bench: with its own master where it has set-points, else by what drives the bench already.

    The vehicle stands on the floor; without set-points, the step given to `world.every_cycle` is the master.

    Args:
        scenario: what to run.
        world: the bench.
        faults: beside those of the scenario.

    Raises:
        UserError: a fault cannot be injected, an object not be written, or nobody enables the drives in time.
    """
    if scenario.lifted:
        world.vehicle.lift()
    if scenario.drives:
        own = _OwnMaster(scenario, world)
        own.start()
        begin = world.now
        world.every_cycle(lambda: own.step(world.now - begin))
        return _watched(scenario, world, faults, own.notes)
    if scenario.begin is Begin.ENABLED and world.run_until(lambda: all_enabled(world), ENABLING_TIME) is None:
        raise UserError(
            f"{scenario.path}: the drives were not enabled within {ENABLING_TIME:g} s.",
            'Let the master enable them, add [[setpoint]] entries, or set begin = "start".',
        )
    return _watched(scenario, world, faults, [])


def _watched(scenario: Scenario, world: World, faults: Sequence[Fault], notes: list[str]) -> ScenarioReport:
    begin = world.now
    inject_faults(scenario, world.faults.add)
    for fault in faults:
        world.faults.add(fault)
    watch = Watch(world, scenario.expected, begin)

    def look() -> bool:
        watch.look()
        return False

    world.run_until(look, scenario.duration)
    watch.look()
    outcomes = watch.outcomes()
    for outcome in outcomes:
        world.note(begin + (outcome.time or 0.0), str(outcome) if outcome.passed else f"FAILED: {outcome}")
    return ScenarioReport(scenario, outcomes, begin, tuple(notes))


def all_enabled(world: Observed) -> bool:
    """Whether all drives are in operation enabled."""
    return all(world.drive_state(role) is DriveState.OPERATION_ENABLED for role in DRIVES)


def inject_faults(scenario: Scenario, add: Callable[[Fault], int]) -> None:
    """Inject the faults of a scenario, whose times count from now.

    Raises:
        DataFileError: there is no such place.
    """
    for fault in scenario.faults:
        try:
            add(fault)
        except UserError as error:
            raise DataFileError(f"{scenario.path}: fault {fault}: {error.what}", error.remedy) from error


class _OwnMaster:
    """The master of a scenario that has set-points.

    Args:
        scenario: what it does.
        world: the bench.

    Attributes:
        notes: what stopped it.

    Raises:
        DataFileError: an object that is to be written is not in the EDS of its node, or cannot have the value.
    """

    def __init__(self, scenario: Scenario, world: World) -> None:
        self._scenario = scenario
        self._world = world
        self._master = Master(world.bus, world.clock, world.network)
        self._waiting = sorted(scenario.writings, key=lambda one: one.at)
        self.notes: list[str] = []
        for one in self._waiting:
            _refuse_unwritable(scenario, one, world)

    def start(self) -> None:
        """Boot and enable.

        Raises:
            BusError: a node does not come up.
        """
        self._master.boot()
        self._master.enable()

    def step(self, time: float) -> None:
        """One cycle at an instant of the scenario [s]; once the network has failed, the drives are stopped for good."""
        if self.notes:
            self._world.bus.recv(self._world.network.cycle_period)
            return
        before = self._world.now
        try:
            while self._waiting and self._waiting[0].at <= time:
                self._write(self._waiting.pop(0))
            self._master.exchange(self._scenario.torques_at(time))
        except BusError as error:
            time += self._world.now - before
            self.notes.append(f"At {time:.3f} s the scenario's master stopped: {error.what}")
            self._master.emergency_stop()

    def _write(self, one: Writing) -> None:
        node = self._world.network.node(one.role)
        self._master.object_access(node).write(one.index, one.subindex, one.value)


def _refuse_unwritable(scenario: Scenario, one: Writing, world: World) -> None:
    node = world.network.node(one.role)
    variable = node.object_dictionary.get_variable(one.index, one.subindex)
    if variable is None or not variable.writable:
        raise DataFileError(
            f"{scenario.path}: {one} cannot be written: {node.eds.name} has no such object, or it is read only.",
            "Look the object up in the EDS of the node, or take that [[setpoint]] out.",
        )
    signed = variable.data_type in canopen.objectdictionary.SIGNED_TYPES
    low = -(1 << len(variable) - 1) if signed else 0
    if not low <= one.value < low + (1 << len(variable)):
        raise DataFileError(
            f"{scenario.path}: {one} does not fit into {len(variable)} bits.",
            f"Give {low} to {low + (1 << len(variable)) - 1}.",
        )
