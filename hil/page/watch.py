"""Looks at a vehicle from time to time for the page, and does what is asked there."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from hil.faults import Fault, FaultKind, parse_fault
from hil.faults.injector import Injected
from hil.page.channel import Channel, ClosedError
from hil.page.shown import Action, ActiveFault, Asked, Sketch, Snapshot, Told
from ident.errors import UserError

PERIOD: Final = 0.04
"""Between two looks [s]."""


class Injector(Protocol):
    """Where faults are injected."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def pending(self) -> list[Injected]:
        """Faults that last, or are still to come."""

    def add(self, fault: Fault | str) -> int:
        """Inject a fault; gives its number."""

    def remove(self, number: int) -> bool:
        """End a fault; whether there was one."""

    def clear(self) -> None:
        """End all faults."""


class View(Protocol):
    """Looks at what is shown."""

    def sketch(self) -> Sketch:
        """What does not change."""

    def look(self, wall: float, faults: tuple[ActiveFault, ...], stopped: bool) -> Snapshot:
        """What there is to be seen now."""


class Watch:
    """What the loop calls as often as it likes; it looks at most every 40 ms, and never waits.

    Args:
        channel: to the page.
        view: of the vehicle.
        faults: what is asked for is injected there.
        monotonic: [s].

    Attributes:
        looks: so far.
        late: looks that found no room in the channel: the page shows later ones.
        gone: the page has ended by itself.
    """

    def __init__(
        self, channel: Channel, view: View, faults: Injector, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        self._channel = channel
        self._view = view
        self._faults = faults
        self._monotonic = monotonic
        self._next = 0.0
        self._actions: Mapping[Action, Callable[[str], str]] = {
            Action.INJECT: self._inject,
            Action.END: self._end,
            Action.END_ALL: self._end_all,
            Action.STOP: self._stop,
            Action.RELEASE: self._release,
        }
        self.looks = 0
        self.late = 0
        self.gone = False
        self._try(lambda: channel.send(view.sketch()))

    def attend(self) -> None:
        """Between two steps of the vehicle: do what was asked, and look, if it is time."""
        now = self._monotonic()
        if now < self._next or self.gone:
            return
        self._next = now + PERIOD
        self._try(lambda: self._attend(now))

    def _try(self, talk: Callable[[], object]) -> None:
        try:
            talk()
        except ClosedError:
            # Whoever drives goes on without it.
            self.gone = True

    def _attend(self, now: float) -> None:
        for message in self._channel.receive():
            if isinstance(message, Asked):
                self._channel.send(self._do(message))
        instant = self._faults.time
        pending = self._faults.pending
        faults = tuple(ActiveFault(one.number, str(one.fault), one.begin <= instant) for one in pending)
        stopped = any(_is_stop(one) and one.begin <= instant for one in pending)
        self.looks += 1
        self.late += not self._channel.send(self._view.look(now, faults, stopped))

    def _do(self, asked: Asked) -> Told:
        try:
            return Told(self._actions[asked.action](asked.argument))
        except UserError as error:
            return Told(f"{error.what} {error.remedy}", refused=True)

    def _inject(self, text: str) -> str:
        fault = parse_fault(text)
        return f"Fault {self._faults.add(fault)}: {fault}"

    def _end(self, number: str) -> str:
        ended = self._faults.remove(int(number))
        return f"Fault {number} ended" if ended else f"Fault {number} had ended already"

    def _end_all(self, _: str) -> str:
        for one in self._faults.pending:
            # The stop has a button of its own: nobody releases it by the way.
            if not _is_stop(one):
                self._faults.remove(one.number)
        return "All faults ended"

    def _stop(self, _: str) -> str:
        if not any(map(_is_stop, self._faults.pending)):
            self._faults.add(Fault(FaultKind.ESTOP, "vehicle"))
        return "Emergency stop: the drives have no power"

    def _release(self, _: str) -> str:
        for one in self._faults.pending:
            if _is_stop(one):
                self._faults.remove(one.number)
        return "Emergency stop released: the master has to reset the faults"


def _is_stop(one: Injected) -> bool:
    return one.fault.kind is FaultKind.ESTOP
