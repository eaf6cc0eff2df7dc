"""Replays test cases of a trace against a node: sends what the tool sent, waits for what the device answered."""

from __future__ import annotations

import struct
from collections import Counter, defaultdict, deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import can

from hil.bus.clock import Clock
from hil.conformance.expectations import (
    OBJECT_MISSING,
    SUBINDEX_MISSING,
    UPLOADED,
    SdoExpectation,
    abort_code,
)
from hil.conformance.trace import Case, TracedFrame, Way
from hil.network.cia import SDO_ABORT, Service

NODE_ID = 4
"""Node id of the device in the trace, and of the node under test."""

_SDO_REQUEST, _SDO_ANSWER = Service.SDO_REQUEST + NODE_ID, Service.SDO_ANSWER + NODE_ID
_ERROR_CONTROL, _EMERGENCY, _SYNC = Service.HEARTBEAT + NODE_ID, Service.EMERGENCY + NODE_ID, Service.SYNC
_FIRST_TPDO = Service.TPDO_1 + NODE_ID

_PATIENCE = {_ERROR_CONTROL: 25.0, _SYNC: 12.0, _FIRST_TPDO: 1.5}
"""Longest wait for a frame [s]: the tool's longest heartbeat is 20 s, its longest SYNC period 10 s."""

_SDO_PATIENCE = 2.0

_MAY_BE_OWED = {_SYNC: 2, _FIRST_TPDO: 2}
"""Frames that a case may miss at its end: the trace logs what was under way while the tool went on, and with which
SYNC a TPDO of type n begins is up to the device."""

_RANDOM_WRITES = frozenset(("9.1",))
"""Cases that write random values, to see that a reset undoes them: which of them a device takes is its own affair."""

_STANDARD_ERRORS = frozenset((0x8210, 0x8220, 0x8130, 0x8240, 0x8250))
"""EMCY codes of CiA 301 that a device of any profile sends; others are the device's own."""

_MISSING = (OBJECT_MISSING, SUBINDEX_MISSING)

_SEGMENT_REQUEST, _SEGMENT_MASK = 0x60, 0xEF

_UNANSWERED = (SDO_ABORT, 0xA1)
"""First bytes of requests without an answer: abort, end of a block upload."""


@dataclass(frozen=True)
class Deviation:
    """Where a node did not do what the trace shows.

    Attributes:
        position: number of the frame in the case.
        expected: frame of the trace.
        got: what came instead, None for nothing.
    """

    position: int
    expected: TracedFrame
    got: bytes | None

    def __str__(self) -> str:
        got = "nothing" if self.got is None else self.got.hex(" ").upper()
        return f"frame {self.position}: {self.expected.can_id:03X} {self.expected.data.hex(' ').upper()}, got {got}"


@dataclass
class Outcome:
    """What came of a case.

    Attributes:
        deviations: empty where the node did all that the trace shows.
        answers: answers compared.
        absent: those among them about objects that the node has not, refused as such.
    """

    deviations: list[Deviation] = field(default_factory=list)
    answers: int = 0
    absent: int = 0

    @property
    def passed(self) -> bool:
        """The node did what the trace shows."""
        return not self.deviations


class Replay:
    """One node under test; what a case leaves behind is there in the next one, as in the trace.

    Args:
        bus: an endpoint of its bus.
        clock: time of that bus.
        objects: (index, sub-index) that the node has.
        stand_ins: PDO mapping entry of the device in the trace -> one that the node has.
    """

    def __init__(
        self,
        bus: can.BusABC,
        clock: Clock,
        objects: Collection[tuple[int, int]],
        stand_ins: Mapping[int, int],
    ) -> None:
        self._bus = bus
        self._clock = clock
        self._objects = frozenset(objects)
        self._stand_ins = {struct.pack("<I", old): struct.pack("<I", new) for old, new in stand_ins.items()}
        self._received: dict[int, deque[bytes]] = defaultdict(deque)
        self._requests: deque[bytes] = deque()
        self._request = b""
        self._initiated = b""
        self._uploaded = True
        self._skip_answer = False
        self._owed: Counter[int] = Counter()
        self._random_writes = False

    def run(self, case: Case) -> Outcome:
        """Replay what precedes a case in the trace, and the case."""
        for frame in case.preparation:
            self._play(frame, case.abort_codes)
        while self._bus.recv(0) is not None:
            pass
        self._received.clear()
        self._owed.clear()
        self._random_writes = case.number in _RANDOM_WRITES
        outcome = Outcome()
        last = dict[int, Deviation]()
        for position, frame in enumerate(case.frames):
            fine, got = self._play(frame, case.abort_codes)
            if frame.way is Way.FROM_NODE:
                outcome.answers += 1
            if self._owed[frame.can_id]:
                last[frame.can_id] = Deviation(position, frame, None)
            if not fine and self._is_absent(frame.data, got):
                outcome.absent += 1
            elif not fine:
                outcome.deviations.append(Deviation(position, frame, got))
        outcome.deviations += [last[can_id] for can_id, owed in self._owed.items() if owed > _MAY_BE_OWED[can_id]]
        return outcome

    def _play(self, frame: TracedFrame, abort_codes: frozenset[int]) -> tuple[bool, bytes | None]:
        if frame.way is Way.TO_NODE:
            self._transmit(frame)
            return True, None
        if frame.can_id == _SDO_ANSWER:
            return self._expect_sdo(frame, abort_codes)
        if frame.can_id == _EMERGENCY:
            return self._expect_emergency(frame)
        if frame.can_id == _ERROR_CONTROL:
            return self._expect_state(frame)
        if frame.can_id in _MAY_BE_OWED:
            return self._expect_some_time(frame)
        # Other TPDOs of the device are off by default in a node under test, and other nodes are not under test.
        return True, None

    def _transmit(self, frame: TracedFrame) -> None:
        data = self._translated(frame.data)
        if frame.can_id == _SDO_REQUEST:
            if self._uploaded and data[0] & _SEGMENT_MASK == _SEGMENT_REQUEST:
                # The value of the node is shorter than that of the device in the trace: all of it has come already.
                self._skip_answer = True
                return
            if data[0] not in _UNANSWERED:
                self._requests.append(data)
        self._bus.send(
            can.Message(
                arbitration_id=frame.can_id,
                data=b"" if frame.remote else data,
                is_remote_frame=frame.remote,
                is_extended_id=False,
            )
        )

    def _expect_sdo(self, frame: TracedFrame, abort_codes: frozenset[int]) -> tuple[bool, bytes | None]:
        if self._skip_answer:
            self._skip_answer = False
            return True, None
        got = self._await(frame.can_id, _SDO_PATIENCE)
        if got is None:
            return False, None
        if self._requests:
            self._request = self._request_of(got)
            if self._request[0] >> 5 in (1, 2) or (self._request[0] >> 5 in (5, 6) and not self._request[0] & 1):
                self._initiated = self._request
        self._note_end_of_upload(got)
        expectation = SdoExpectation(self._request, self._translated(frame.data), abort_codes)
        return expectation.met_by(got) or (self._random_writes and expectation.decided_by(got)), got

    def _request_of(self, got: bytes) -> bytes:
        """The request that an answer belongs to; those before it have not been answered (a stopped node is silent)."""
        names = [request[1:4] for request in self._requests]
        skipped = names.index(got[1:4]) if got[1:4] in names else 0
        for _ in range(skipped):
            self._requests.popleft()
        return self._requests.popleft()

    def _note_end_of_upload(self, got: bytes) -> None:
        if self._request[0] & _SEGMENT_MASK == _SEGMENT_REQUEST:
            self._uploaded = got[0] == SDO_ABORT or bool(got[0] & 1)
        elif self._request[0] >> 5 == UPLOADED:
            self._uploaded = got[0] >> 5 == UPLOADED and bool(got[0] & 2)

    def _is_absent(self, expected: bytes, got: bytes | None) -> bool:
        """Refused because the node has no such object, or goes on with a transfer that was refused so."""
        if got is None or got[0] != SDO_ABORT or not self._initiated:
            return False
        if expected[0] == SDO_ABORT and abort_code(expected) in _MISSING:
            return False
        index, subindex = struct.unpack_from("<HB", self._initiated, 1)
        missing = abort_code(got) in _MISSING or self._request != self._initiated
        return missing and (index, subindex) not in self._objects

    def _expect_emergency(self, frame: TracedFrame) -> tuple[bool, bytes | None]:
        if struct.unpack_from("<H", frame.data)[0] not in _STANDARD_ERRORS:
            return True, None
        got = self._await(frame.can_id, _SDO_PATIENCE)
        return got is not None and got[:2] == frame.data[:2], got

    def _expect_state(self, frame: TracedFrame) -> tuple[bool, bytes | None]:
        # Heartbeats of the state before may have been under way.
        end = self._clock.now() + _PATIENCE[frame.can_id]
        got = self._await(frame.can_id, _PATIENCE[frame.can_id])
        while got is not None and got != frame.data and self._clock.now() < end:
            got = self._await(frame.can_id, _PATIENCE[frame.can_id])
        return got == frame.data, got

    def _expect_some_time(self, frame: TracedFrame) -> tuple[bool, bytes | None]:
        got = self._await(frame.can_id, _PATIENCE[frame.can_id])
        if got is None:
            self._owed[frame.can_id] += 1
        elif frame.can_id == _SYNC and got != frame.data:
            return False, got
        return True, got

    def _await(self, can_id: int, patience: float) -> bytes | None:
        end = self._clock.now() + patience
        while not self._received[can_id]:
            message = self._bus.recv(max(end - self._clock.now(), 0.0))
            if message is None:
                return None
            self._received[message.arbitration_id].append(bytes(message.data))
        return self._received[can_id].popleft()

    def _translated(self, data: bytes) -> bytes:
        """With the mapping entries that the node under test has."""
        mapping = len(data) == 8 and data[2] in (0x16, 0x1A) and data[3] > 0
        stand_in = self._stand_ins.get(data[4:8]) if mapping else None
        return data if stand_in is None else data[:4] + stand_in
