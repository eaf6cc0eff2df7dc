"""Faults between the connector and the nodes: frames on their way, nodes, sensors, ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from emulator.firmware.network import DeviceNetwork
from hil.faults.agenda import Agenda
from hil.faults.devices import PREPARATIONS, Begin, End, Reach, Slippery
from hil.faults.fault import Fault, parse_fault
from hil.faults.frames import FRAME_FAULTS, Flow, Frame, FrameRule
from hil.faults.hardware import TappedVehicle
from hil.faults.places import Places
from hil.network import Network


@dataclass(frozen=True)
class Injected:
    """A fault that was injected: its number, what it is, and when it begins and ends [s]."""

    number: int
    fault: Fault
    begin: float
    end: float


class FaultInjector:
    """The devices of a bus, with everything in reach that can go wrong; it stands where they would stand.

    Each fault has random numbers of its own, from the seed and its number: another fault beside it changes nothing
    about it. Frames are changed at the connector of the vehicle: what a node loses, a listener on the bus still sees.

    Args:
        make: builds the devices on a vehicle around the function by which they send.
        vehicle: the hardware, tapped.
        send: puts a frame of the devices on the bus; the identifier carries `ERROR_FRAME` for an error frame.
        network: names of the places.
        ground: under the wheels, None where there is none.
        seed: of all randomness.

    Attributes:
        devices: the nodes.
        receive: takes a data frame of the master (identifier, data); the nodes' own while no frame is to be changed.
        log: everything that was injected so far.
    """

    receive: Callable[[int, bytes], None]

    def __init__(
        self,
        make: Callable[[TappedVehicle, Callable[[int, bytes], None]], DeviceNetwork],
        vehicle: TappedVehicle,
        send: Callable[[int, bytes], None],
        network: Network,
        ground: Slippery | None = None,
        seed: int = 0,
    ) -> None:
        self._send = send
        self._seed = seed
        self._agenda = Agenda()
        self._rules: tuple[FrameRule, ...] = ()
        self._running: dict[int, End] = {}
        self._injected: dict[int, Injected] = {}
        self._count = 0
        self.log: list[Injected] = []
        self.devices = make(vehicle, self._from_node)
        self._set_rules(())
        self._reach = Reach(self.devices, vehicle, Places(network), ground, self._agenda, send)

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return self.devices.time

    @property
    def pending(self) -> list[Injected]:
        """Faults that last, or are still to come."""
        return list(self._injected.values())

    def add(self, fault: Fault | str) -> int:
        """Inject a fault, its times counted from now; gives its number, for `remove`.

        Raises:
            FaultError: there is no such fault or place.
        """
        fault = parse_fault(fault) if isinstance(fault, str) else fault
        begin = self._prepare(fault, np.random.default_rng((self._seed, self._count)))
        number, now = self._count, self.time
        self._count += 1
        self._injected[number] = injected = Injected(number, fault, now + fault.start, now + fault.end)
        self.log.append(injected)
        if fault.start > 0.0:
            self._agenda.at(now + fault.start, lambda: self._begin(number, begin))
        else:
            self._begin(number, begin)
        self._agenda.at(now + fault.end, lambda: self.remove(number))
        return number

    def remove(self, number: int) -> bool:
        """End a fault now; whether it had not ended yet."""
        end = self._running.pop(number, None)
        if end is not None:
            end()
        return self._injected.pop(number, None) is not None

    def clear(self) -> None:
        """End all faults now."""
        for number in tuple(self._injected):
            self.remove(number)

    def describe(self) -> list[str]:
        """One line for each fault that lasts or is still to come."""
        return [f"{one.number}: {one.fault}, from {one.begin:.3f} s to {one.end:.3f} s" for one in self.pending]

    def receive_remote(self, can_id: int) -> None:
        """Take a remote frame of the master; faults act on data frames only."""
        self.devices.receive_remote(can_id)

    def advance(self, to_time: float) -> None:
        """Let time pass up to `to_time` [s]: faults, physics, and the timers of the nodes."""
        while self._rules or self._agenda.next_event() <= to_time:
            due = min(self.next_event(), to_time)
            self.devices.advance(due)
            self._agenda.run(due)
            if due >= to_time:
                return
        self.devices.advance(to_time)

    def next_event(self) -> float:
        """Instant of the next timer or fault [s], infinite if there is none."""
        return min(self._agenda.next_event(), self.devices.next_event())

    def _from_master(self, can_id: int, data: bytes) -> None:
        self._pass(Frame(can_id, data, True))

    def _from_node(self, can_id: int, data: bytes) -> None:
        if self._rules:
            self._pass(Frame(can_id, data, False))
        else:
            self._send(can_id, data)

    def _pass(self, frame: Frame) -> None:
        flow: Flow = ((0.0, frame),)
        for rule in self._rules:
            flow = [(late + delay, out) for late, one in flow for delay, out in rule(one)]
        self._let_go(flow)

    def _let_go(self, flow: Flow) -> None:
        for delay, frame in flow:
            if delay > 0.0:
                self._agenda.at(self.time + delay, partial(self._deliver, frame))
            else:
                self._deliver(frame)

    def _deliver(self, frame: Frame) -> None:
        if frame.from_master:
            self.devices.receive(frame.can_id, frame.data)
        else:
            self._send(frame.can_id, frame.data)

    def _begin(self, number: int, begin: Begin) -> None:
        if number in self._injected:
            self._running[number] = begin()

    def _prepare(self, fault: Fault, rng: np.random.Generator) -> Begin:
        if fault.kind in FRAME_FAULTS:
            return partial(self._begin_rule, FrameRule(fault, self._reach.places.selection(fault), rng))
        return PREPARATIONS[fault.kind](fault, self._reach)

    def _set_rules(self, rules: tuple[FrameRule, ...]) -> None:
        self._rules = rules
        self.receive = self._from_master if rules else self.devices.receive

    def _begin_rule(self, rule: FrameRule) -> End:
        self._set_rules((*self._rules, rule))

        def end() -> None:
            self._set_rules(tuple(other for other in self._rules if other is not rule))
            self._let_go(rule.end())

        return end
