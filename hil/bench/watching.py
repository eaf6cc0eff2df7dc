"""The page of an emulated vehicle: what it shows of a server, of a bench in this process, or of anything between."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final

from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.bench.serving import VehicleServer
from hil.bus.report import ListenerReport
from hil.bus.traffic import Traffic
from hil.faults import FaultInjector
from hil.network import Network
from hil.page.emulated import Around, EmulatedView
from hil.page.opening import Page
from hil.page.shown import BusNow, CyclesNow, Doing
from hil.page.watch import Watch
from hil.video.film import FilmedVehicle
from ident.errors import UserError

_SHORTEST_WAIT: Final = 0.005
"""For less than that it is not worth to sleep [s]."""

_LONGEST_WAIT: Final = 0.02
"""Without looking what is asked on the page [s]."""


def watch(page: Page, title: str, vehicle: object, faults: FaultInjector, network: Network, around: Around) -> Watch:
    """Show a vehicle on a page; whoever moves it calls `attend` of what this gives, between any two steps.

    Args:
        page: that is open.
        title: of the page.
        vehicle: the emulated vehicle, filmed or not.
        faults: its nodes, with everything in reach that can go wrong.
        network: names and units of the nodes, complete.
        around: bus, step and cycles.

    Raises:
        UserError: it is no emulated vehicle, and has no pose.
    """
    if not isinstance(vehicle, EmulatedVehicle | FilmedVehicle):
        raise UserError("An FMU knows no place in the world that a page could show.", "Leave out --web or --plant.")
    return Watch(page.channel, EmulatedView(title, vehicle, faults.devices, network, around), faults)


def watch_server(
    page: Page,
    title: str,
    vehicle: object,
    server: VehicleServer,
    network: Network,
    traffic: Traffic,
    clients: Callable[[], Sequence[ListenerReport]] = tuple,
) -> Watch:
    """Show the vehicle of a server; `attend` belongs into what its `serve` asks for its end.

    Args:
        page, title, vehicle, network: see `watch`.
        server: of the vehicle.
        traffic: the frames that it counts.
        clients: of its bus.

    Raises:
        UserError: see `watch`.
    """
    report = server.report

    def bus() -> BusNow:
        return BusNow(traffic.frames, traffic.bits, tuple(clients()))

    def cycles() -> CyclesNow:
        return CyclesNow(report.syncs, report.overruns, report.worst_lag)

    return watch(page, title, vehicle, server.faults, network, Around(bus, cycles=cycles))


def watch_bench(
    page: Page, title: str, vehicle: object, bench: LockstepBench, network: Network, doing: Callable[[], Doing]
) -> Watch:
    """Show the vehicle of a bench in this process, which attends from now on by itself.

    Args:
        page, title, vehicle, network: see `watch`.
        bench: of the vehicle.
        doing: the step that is driven.

    Raises:
        UserError: see `watch`.
    """

    def bus() -> BusNow:
        return BusNow(bench.load.frames, (bench.load.bits, bench.load.bits))

    watched = watch(page, title, vehicle, bench.faults, network, Around(bus, doing))
    bench.attend(watched.attend)
    return watched


class Pace:
    """What to call between two moves of time, so that simulated time passes no faster than it is to be watched.

    Args:
        simulated: simulated time [s].
        pace: simulated seconds a second at most.
        meanwhile: called at least once, and again while there is to be waited.
        monotonic, sleep: the operating system's clock functions.
    """

    def __init__(
        self,
        simulated: Callable[[], float],
        pace: float,
        meanwhile: Callable[[], None],
        monotonic: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._simulated = simulated
        self._pace = pace
        self._meanwhile = meanwhile
        self._monotonic = monotonic
        self._sleep = sleep
        self._due = monotonic() - simulated() / pace

    def attend(self) -> None:
        """Wait as long as simulated time is ahead; where it is behind, nothing is made up for later."""
        self._meanwhile()
        while (ahead := self._ahead()) > _SHORTEST_WAIT:
            self._sleep(min(ahead, _LONGEST_WAIT))
            self._meanwhile()
        self._due -= min(ahead, 0.0)

    def _ahead(self) -> float:
        return self._due + self._simulated() / self._pace - self._monotonic()
