"""Transmit PDOs: with every n-th SYNC, with the SYNC after an event, on the event, or on request (CiA 301, 7.2.2)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from emulator.firmware.cob_ids import NO_REMOTE
from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.pdo import EVENT_DRIVEN, SYNCHRONOUS_MAX, PdoIndices, PdoParameters

SAMPLED_FOR_REMOTE = 252
"""Transmission type: the values of the last SYNC, sent when a remote frame asks for them."""

SENT_ON_REMOTE = 253
"""Transmission type: the values of the instant in which a remote frame asks for them."""

_INHIBIT_TIME, _EVENT_TIMER, _SYNC_START = 3, 5, 6
"""Sub-indices of the communication parameter."""


class Tpdo(PdoParameters):
    """A transmit PDO.

    Args:
        dictionary: the object dictionary of the node.
        indices: where its parameters are.
        changed: called when something was written that alters its behaviour.
    """

    def __init__(self, dictionary: Dictionary, indices: PdoIndices, changed: Callable[[], None]) -> None:
        super().__init__(dictionary, indices, changed)
        dictionary.on_write(indices.communication, _INHIBIT_TIME, self._write_inhibit_time)
        dictionary.on_write(indices.communication, _EVENT_TIMER, self._write_event_timer)
        dictionary.on_write(indices.communication, _SYNC_START, self._write_sync_start)
        self.inhibit_time = 0.0
        self.event_timer = 0.0
        self._sync_start = 0
        self._struct = struct.Struct("<")
        self._readers: Sequence[Callable[[], int]] = ()
        self._syncs = 0
        self._awaits_start = False
        self._sampled = b""
        self.event_pending = False

    @property
    def answers_remote(self) -> bool:
        """A remote frame makes it go out."""
        return not self.cob_id & NO_REMOTE

    @property
    def event_driven(self) -> bool:
        """It goes out when the application or the event timer says so."""
        return self.transmission_type in EVENT_DRIVEN

    def acyclic_types(self) -> tuple[int, ...]:
        """Event-driven always; on remote request where that is allowed."""
        return (SAMPLED_FOR_REMOTE, SENT_ON_REMOTE, *EVENT_DRIVEN) if self.answers_remote else EVENT_DRIVEN

    def load(self) -> None:
        """Take everything from the dictionary, as after a reset."""
        super().load()
        inhibit_time, event_timer, self._sync_start = (
            self._dictionary.value(self._indices.communication, subindex, default=0)
            for subindex in (_INHIBIT_TIME, _EVENT_TIMER, _SYNC_START)
        )
        self.inhibit_time, self.event_timer = inhibit_time * 1e-4, event_timer * 1e-3

    def compile(self) -> None:
        """Bind the mapped objects and start counting SYNCs."""
        self._struct = struct.Struct(self.codes())
        self._readers = [self._dictionary.reader(*key) for key in self.keys()]
        self._syncs = 0
        self._awaits_start = self._sync_start != 0
        self._sampled = self.data()
        self.event_pending = True

    def data(self) -> bytes:
        """The PDO with the values of this instant."""
        return self._struct.pack(*[read() for read in self._readers])

    def remote_data(self) -> bytes:
        """What a remote frame is answered with."""
        return self._sampled if self.transmission_type == SAMPLED_FOR_REMOTE else self.data()

    def sample(self) -> None:
        """SYNC: keep the values of this instant for the next remote frame."""
        self._sampled = self.data()

    def due_at_sync(self, counter: int) -> bool:
        """Count a SYNC; True when the PDO goes out with it.

        Args:
            counter: the number in the SYNC, 0 where SYNCs are not numbered.
        """
        if self.transmission_type == 1 and not self._awaits_start:
            return True
        if self.transmission_type == 0:
            return self._has_changed()
        if self._awaits_start and counter and not self._starts_with(counter):
            return False
        self._syncs += 1
        if self._syncs < self.transmission_type:
            return False
        self._syncs = 0
        return True

    def _has_changed(self) -> bool:
        """Whether an event, or another value than in the last one, is there for the SYNC of transmission type 0."""
        last, self._sampled = self._sampled, self.data()
        due, self.event_pending = self.event_pending or self._sampled != last, False
        return due

    def _starts_with(self, counter: int) -> bool:
        """The SYNC with the start value counts as the first one (CiA 301, 7.5.2.37), so the PDO goes out with it."""
        if counter != self._sync_start:
            return False
        self._awaits_start = False
        self._syncs = self.transmission_type - 1
        return True

    def _write_inhibit_time(self, value: int) -> None:
        self.refuse_while_valid()
        self.inhibit_time = value * 1e-4

    def _write_event_timer(self, value: int) -> None:
        self.event_timer = value * 1e-3
        self._alter()

    def _write_sync_start(self, value: int) -> None:
        self.refuse_while_valid()
        if value > SYNCHRONOUS_MAX:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._sync_start = value
