"""Paths of Unix sockets: what may be replaced there, what may be removed, and nothing else.

A path that a user has mistyped may name a file of theirs. Only a socket of our own that nobody serves any more is
replaced, and only the socket that was bound here is removed. The folder is locked meanwhile, so that of two that start
at once one is refused, and neither removes the socket of the other.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_KINDS: Final[tuple[tuple[Callable[[int], bool], str], ...]] = (
    (stat.S_ISREG, "a file"),
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


@dataclass(frozen=True)
class BoundSocket:
    """A socket that listens at a path.

    Attributes:
        socket: listening.
        path: where.
        place: device and inode, by which it is known again.
    """

    socket: socket.socket
    path: Path
    place: tuple[int, int]

    def close(self) -> None:
        """Listen no more; what is at the path goes if it is still this socket, and stays if it is another thing."""
        self.socket.close()
        with contextlib.suppress(OSError), _alone_in(self.path.parent):
            found = os.lstat(self.path)
            if (found.st_dev, found.st_ino) == self.place:
                os.unlink(self.path)


def listen(path: Path) -> BoundSocket:
    """Listen at a path for packets; a socket of one's own that is not served any more is replaced.

    Raises:
        OSError: another process listens there, or something else is there, which is left as it is; or the path cannot
            be used.
    """
    server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        with _alone_in(path.parent):
            _remove_dead(path)
            server.bind(str(path))
            server.listen()
            found = os.lstat(path)
    except BaseException:
        server.close()
        raise
    return BoundSocket(server, path, (found.st_dev, found.st_ino))


@contextlib.contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """The only one of our programs that replaces sockets in a folder; ends with the process, leaves nothing."""
    import fcntl  # where there are Unix sockets

    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _remove_dead(path: Path) -> None:
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(found.st_mode):
        kind = next((name for is_kind, name in _KINDS if is_kind(found.st_mode)), "something")
        raise OSError(errno.EEXIST, f"{kind} is there, which is left as it is")
    if _is_served(path):
        raise OSError(errno.EADDRINUSE, "another process serves it")
    if found.st_uid != os.geteuid():
        raise OSError(errno.EPERM, "the socket of another user is there, which is left as it is")
    os.unlink(path)


def _is_served(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            return False
        except OSError:
            # Its queue is full, or it is of another kind: somebody is behind it.
            return True
    return True
