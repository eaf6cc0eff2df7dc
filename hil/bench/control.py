"""Commands to a running emulator over a socket beside its bus: faults injected, listed and ended while it serves."""

from __future__ import annotations

import contextlib
import json
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final, Protocol

from hil.bus.report import ListenerReport
from hil.bus.unix_paths import listen
from ident.errors import BusError, UserError

_LARGEST: Final = 1 << 16
_PATIENCE: Final = 5.0
"""Longest wait for an answer [s]; the emulator looks at its control socket every 20 ms."""

_PERIOD: Final = 0.02
_OK, _REFUSED = "ok", "refused"

Handler = Callable[[str], str]
"""Carries out a command with its argument; gives what to answer."""


class Injection(Protocol):
    """What can be commanded: the faults of an emulator."""

    def add(self, fault: str) -> int:
        """Inject a fault; gives its number."""

    def remove(self, number: int) -> bool:
        """End a fault; whether there was one."""

    def clear(self) -> None:
        """End all faults."""

    def describe(self) -> list[str]:
        """One line for each fault that lasts or is still to come."""


def control_path(bus: str) -> Path:
    """Where the emulator that serves a `unix:` bus takes commands.

    Raises:
        BusError: it is another bus, and has no such place.
    """
    interface, _, path = bus.partition(":")
    if interface != "unix" or not path:
        raise BusError(f"{bus} has no place for commands beside it.", "Give --control PATH on both sides.")
    return Path(f"{path}.control")


class ControlServer:
    """Takes commands when it is polled.

    Args:
        path: of its socket; one that a dead emulator of this user left there is replaced, nothing else.
        faults: what is commanded.
        clients: those of the bus, and what became of the frames for them.
        monotonic: paces the looks at the socket [s].

    Raises:
        BusError: somebody listens there, something else is there, or the path cannot be used.
    """

    def __init__(
        self,
        path: Path,
        faults: Injection,
        clients: Callable[[], Sequence[ListenerReport]] = tuple,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._faults = faults
        self._monotonic = monotonic
        self._next = 0.0
        self._handlers: Mapping[str, Handler] = {
            "add": lambda text: f"fault {faults.add(text)}",
            "remove": self._remove,
            "clear": self._clear,
            "list": lambda _: "\n".join(faults.describe()) or "no faults",
            "clients": lambda _: json.dumps([asdict(client) for client in clients()]),
        }
        try:
            self._bound = listen(path)
        except OSError as error:
            raise BusError(
                f"No commands can be taken at {path}: {error.strerror or error}.", "Give another --control."
            ) from error
        self._socket = self._bound.socket
        self._socket.setblocking(False)
        self._waiting: list[tuple[socket.socket, float]] = []

    def poll(self) -> None:
        """Answer whoever has a command, at most every 20 ms."""
        now = self._monotonic()
        if now < self._next:
            return
        self._next = now + _PERIOD
        with contextlib.suppress(OSError):
            client, _ = self._socket.accept()
            client.setblocking(False)
            self._waiting.append((client, now + _PATIENCE))
        # Whoever has connected may be held up before it says what it wants; nobody waits for it here.
        self._waiting = [(client, end) for client, end in self._waiting if not self._served(client, now > end)]

    def close(self) -> None:
        """Take no more commands."""
        for client, _ in self._waiting:
            client.close()
        self._bound.close()

    def _served(self, client: socket.socket, late: bool) -> bool:
        """Whether a client has its answer, has gone, or has waited too long."""
        try:
            command = client.recv(_LARGEST)
        except BlockingIOError:
            if late:
                client.close()
            return late
        except OSError:
            command = b""
        with client, contextlib.suppress(OSError):
            if command:
                client.send(self._answer(command.decode(errors="replace")).encode())
        return True

    def _answer(self, command: str) -> str:
        word, _, argument = command.partition(" ")
        handler = self._handlers.get(word)
        if handler is None:
            return f"{_REFUSED}\nThere is no command {word!r}.\nUse one of {', '.join(self._handlers)}."
        try:
            return f"{_OK}\n{handler(argument)}"
        except UserError as error:
            return f"{_REFUSED}\n{error.what}\n{error.remedy}"

    def _clear(self, _argument: str) -> str:
        self._faults.clear()
        return "all faults ended"

    def _remove(self, argument: str) -> str:
        if not argument.isdigit():
            raise UserError(f"{argument!r} is no number of a fault.", "List them first.")
        if not self._faults.remove(int(argument)):
            raise UserError(f"There is no fault {argument} that lasts or is still to come.", "List them first.")
        return f"fault {argument} ended"


def command(path: Path, text: str) -> str:
    """Send a command to the emulator that listens at `path`; gives its answer.

    Raises:
        BusError: nobody listens or answers there.
        UserError: the command is refused.
    """
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
            connection.settimeout(_PATIENCE)
            connection.connect(str(path))
            connection.send(text.encode())
            answer = connection.recv(_LARGEST).decode()
    except OSError as error:
        raise BusError(
            f"No emulator takes commands at {path}: {error.strerror or error}.",
            "Start it first: quasiomni emulate --bus unix:PATH.",
        ) from error
    verdict, _, rest = answer.partition("\n")
    if verdict != _OK:
        what, _, remedy = rest.partition("\n")
        raise UserError(what or "The emulator has closed the connection.", remedy)
    return rest


def clients(path: Path) -> tuple[ListenerReport, ...]:
    """The clients of the bus that the emulator at `path` serves.

    Raises:
        BusError: nobody listens or answers there.
    """
    return tuple(ListenerReport(**one) for one in json.loads(command(path, "clients")))
