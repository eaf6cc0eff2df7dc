"""What hands did beside the vehicle between the sessions of a campaign: no frame tells of it, names of logs do."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from hil.campaign.runner import Operator, Session, session_of
from hil.frames.recorder import INTERLUDE
from hil.network.cia import NmtCommand, Service
from hil.replay.recording import Part, Recording
from ident.campaign.steps import DRIVING_ORDER
from ident.errors import RecordError

_STEPS = frozenset(map(str, DRIVING_ORDER))


def resets_node(can_id: int, data: bytes) -> bool:
    """Whether a frame is the NMT command that begins a session."""
    return can_id == Service.NMT and data[:1] == bytes((NmtCommand.RESET_NODE,))


class Hands:
    """Lifts, lowers, loads and unloads where a campaign let it be done: before a session begins by resetting the nodes.

    Args:
        recording: of a run folder.
        operator: has the hands.
        payload: mass of the load of loaded steps [kg].

    Raises:
        RecordError: sessions come again, so the run was stopped and gone on with.
    """

    def __init__(self, recording: Recording, operator: Operator, payload: float) -> None:
        self._sessions = iter(_sessions(recording))
        self._operator = operator
        self._payload = payload
        self._resetting = False
        self._lifted = self._loaded = False

    def before(self, _part: str, can_id: int, data: bytes) -> None:
        """Called before each frame of the master."""
        resets = resets_node(can_id, data)
        if resets and not self._resetting:
            self._prepare(next(self._sessions))
        self._resetting = resets

    def _prepare(self, session: Session) -> None:
        if session is Session.LIFTED:
            self._operator.lift()
        elif self._lifted:
            self._operator.lower()
        self._lifted = session is Session.LIFTED
        if session is Session.LOADED:
            self._operator.load(self._payload)
        elif self._loaded and session is Session.VALIDATION:
            self._operator.unload()
        self._loaded = session is Session.LOADED


def _sessions(recording: Recording) -> list[Session]:
    """Of every reset of the nodes, the session that begins there."""
    found: list[Session] = []
    begun = 0
    for part in recording.parts:
        begun += _resets(part)
        step = step_named(part.name)
        if step is not None and begun > len(found):
            found += [session_of(step)] * (begun - len(found))
    found += found[-1:] * (begun - len(found))
    if any(after <= before for before, after in pairwise(found)):
        raise RecordError(
            f"{recording.source} was stopped and gone on with: nobody knows what was done to the vehicle meanwhile.",
            "Name its finished logs one by one, each is a replay of its own.",
        )
    return found


def _resets(part: Part) -> int:
    commands = [resets_node(can_id, data) for _, can_id, data in part.frames()]
    return sum(now and not before for before, now in pairwise([False, *commands]))


def step_named(name: str) -> str | None:
    """The step that a log holds by its name, as a `Recorder` gives it; None for an interlude or a log of others."""
    words = name.partition("_")[2].partition(".")[0]
    return words if words != INTERLUDE and words in _STEPS else None


def is_lifted(names: Sequence[str]) -> bool:
    """Whether logs are, by their names, of wheels in the air."""
    steps = [step for step in map(step_named, names) if step is not None]
    return bool(steps) and all(session_of(step) is Session.LIFTED for step in steps)
