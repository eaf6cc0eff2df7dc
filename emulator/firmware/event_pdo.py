"""Event-driven sending of a TPDO (transmission types 254 and 255), with inhibit time and event timer."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.timers import Timer, Timers
from emulator.firmware.tpdo import Tpdo


class EventSender:
    """Sends one TPDO on events and on its event timer, never within the inhibit time.

    Args:
        tpdo: what to send.
        timers: simulated time.
        send: transmits a frame.
    """

    def __init__(self, tpdo: Tpdo, timers: Timers, send: Callable[[int, bytes], None]) -> None:
        self.tpdo = tpdo
        self._timers = timers
        self._send = send
        self._event_timer: Timer | None = None
        self._inhibit: Timer | None = None
        self._enabled = False

    def enable(self, enabled: bool) -> None:
        """Start (again) or stop; an event-driven TPDO is sent once when it starts."""
        for timer in (self._event_timer, self._inhibit):
            if timer is not None:
                timer.cancel()
        self._event_timer = self._inhibit = None
        starting, self._enabled = enabled and not self._enabled, enabled
        if starting:
            self.event()
        elif enabled:
            self._restart_event_timer()

    def event(self) -> None:
        """An event has happened: send now, or when the inhibit time is over."""
        self.tpdo.event_pending = True
        if self._enabled and self._inhibit is None:
            self._transmit()

    def _transmit(self) -> None:
        self.tpdo.event_pending = False
        self._send(self.tpdo.can_id, self.tpdo.data())
        if self.tpdo.inhibit_time > 0.0:
            self._inhibit = self._timers.after(self.tpdo.inhibit_time, self._release)
        self._restart_event_timer()

    def _release(self) -> None:
        self._inhibit = None
        if self.tpdo.event_pending:
            self._transmit()

    def _restart_event_timer(self) -> None:
        if self._event_timer is not None:
            self._event_timer.cancel()
            self._event_timer = None
        if self.tpdo.event_timer > 0.0:
            self._event_timer = self._timers.after(self.tpdo.event_timer, self.event)
