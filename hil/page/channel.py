"""Messages between the loop and the process of the page: nobody waits for anybody."""

from __future__ import annotations

import contextlib
import pickle
import select
import socket
from typing import Final, cast

from hil.page.shown import Message, Messages

_LARGEST: Final = 1 << 17
_AT_ONCE: Final = 256
"""Most messages taken at once."""


class ClosedError(Exception):
    """The other side has gone."""


class Channel:
    """One end. Both belong to this program, so that what comes may be unpickled.

    Args:
        connection: a socket that keeps packets apart (SOCK_SEQPACKET); it becomes non-blocking.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self._socket = connection

    def send(self, message: Message) -> bool:
        """Send a message; whether there was room for it.

        Raises:
            ClosedError: the other side has gone.
        """
        try:
            self._socket.send(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))
        except BlockingIOError:
            return False
        except OSError as error:
            raise ClosedError from error
        return True

    def receive(self) -> Messages:
        """All messages that are there, oldest first.

        Raises:
            ClosedError: the other side has gone, and everything from it has been taken.
        """
        found: list[Message] = []
        with contextlib.suppress(BlockingIOError):
            while len(found) < _AT_ONCE:
                packet = self._take()
                if not packet:
                    if found:
                        break
                    raise ClosedError
                found.append(cast(Message, pickle.loads(packet)))
        return found

    def wait(self, timeout: float) -> None:
        """Wait until there is something to receive, or the other side has gone; at most `timeout` [s]."""
        select.select([self._socket], [], [], timeout)

    def close(self) -> None:
        """The other side is told so."""
        self._socket.close()

    def _take(self) -> bytes:
        try:
            return self._socket.recv(_LARGEST)
        except BlockingIOError:
            raise
        except OSError:
            return b""


def make_pair() -> tuple[socket.socket, socket.socket]:
    """Two sockets that are connected."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
