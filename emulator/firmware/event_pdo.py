"""Event-driven sending of a TPDO (transmission types 254 and 255), with inhibit time and event timer."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.timers import Timer, Timers
from emulator.firmware.tpdo import Tpdo

LOOKS_EVERY = 0.001
"""Period at which a node compares the mapped process values with those that it has sent [s]."""


class EventSender:
    """Sends one TPDO when a mapped value has changed, and on its event timer; never within the inhibit time.

    A change that the application tells of is looked at at once, every other one within `LOOKS_EVERY`.

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
        self._look: Timer | None = None
        self._enabled = False
        self._sent = b""
        self._overdue = False

    def enable(self, enabled: bool) -> None:
        """Start (again) or stop; an event-driven TPDO is sent once when it starts."""
        for timer in (self._event_timer, self._inhibit, self._look):
            if timer is not None:
                timer.cancel()
        self._event_timer = self._inhibit = self._look = None
        self._overdue = False
        starting, self._enabled = enabled and not self._enabled, enabled
        if starting:
            self._transmit(self.tpdo.data())
        elif enabled:
            self._restart_event_timer()
            self._look_later()

    def event(self) -> None:
        """An event has happened: send what is new now, or when the inhibit time is over."""
        self.tpdo.event_pending = True
        if self._enabled and self._inhibit is None:
            self._send_news()

    def _send_news(self) -> None:
        self.tpdo.event_pending = False
        data = self.tpdo.data()
        if data != self._sent:
            self._transmit(data)

    def _transmit(self, data: bytes) -> None:
        self.tpdo.event_pending = self._overdue = False
        self._sent = data
        self._send(self.tpdo.can_id, data)
        if self.tpdo.inhibit_time > 0.0:
            # Nothing is looked at meanwhile: whatever changes goes out at the end of it.
            self._stop_looking()
            self._inhibit = self._timers.after(self.tpdo.inhibit_time, self._release)
        elif self._look is None:
            self._look_later()
        self._restart_event_timer()

    def _release(self) -> None:
        self._inhibit = None
        if self._overdue:
            self._transmit(self.tpdo.data())
        else:
            self._compare()

    def _compare(self) -> None:
        self._look = None
        self._send_news()
        if self._inhibit is None and self._look is None:
            self._look_later()

    def _look_later(self) -> None:
        self._look = self._timers.after(LOOKS_EVERY, self._compare)

    def _stop_looking(self) -> None:
        if self._look is not None:
            self._look.cancel()
            self._look = None

    def _expire(self) -> None:
        self._event_timer = None
        if self._inhibit is None:
            self._transmit(self.tpdo.data())
        else:
            self._overdue = True

    def _restart_event_timer(self) -> None:
        if self._event_timer is not None:
            self._event_timer.cancel()
            self._event_timer = None
        if self.tpdo.event_timer > 0.0:
            self._event_timer = self._timers.after(self.tpdo.event_timer, self._expire)
