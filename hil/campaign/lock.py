"""One campaign at a time in a run folder.

The lock is the operating system's, on a file in the folder: it ends with the process that holds it, however that ends,
so a killed campaign leaves nothing that has to be cleared away.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from ident.errors import CampaignError

LOCK_FILE: Final = ".quasiomni.lock"
"""Name of the file in a run folder; it says who drives."""

_LONGEST: Final = 200


@contextlib.contextmanager
def driving(folder: Path) -> Iterator[None]:
    """Inside, no other process drives into the folder, which is made; it goes again if nothing was put into it.

    Raises:
        CampaignError: another process drives there; named. Or the folder cannot be made or locked.
    """
    missing = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = _locked(folder / LOCK_FILE)
    except OSError as error:
        raise CampaignError(
            f"{folder} cannot be made a run folder: {error.strerror or error}.",
            "Name a folder that can be written to (--out).",
        ) from error
    try:
        yield
    finally:
        # While it is still locked: whoever opens the file in the meantime sees that it is not the folder's any more.
        with contextlib.suppress(OSError):
            os.unlink(folder / LOCK_FILE)
            if missing:
                folder.rmdir()
        os.close(descriptor)


def refuse_driven(folder: Path) -> None:
    """Refuse a folder into which another process drives, before work is put into a plan for it.

    Raises:
        CampaignError: with the process.
    """
    if (folder / LOCK_FILE).is_file():
        with driving(folder):
            pass


def _locked(path: Path) -> int:
    """Descriptor of the lock file, locked; the lock ends when it is closed."""
    import fcntl  # not on every system that identifies, and only who drives needs it

    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(descriptor, path):
                _sign(descriptor)
                return descriptor
        except OSError as error:
            holder = os.pread(descriptor, _LONGEST, 0).decode(errors="replace").strip()
            os.close(descriptor)
            if error.errno == errno.EWOULDBLOCK:
                raise _refusal(path.parent, holder) from error
            raise
        # Its holder has taken the file away between our two calls.
        os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.lstat(path))
    except FileNotFoundError:
        return False


def _sign(descriptor: int) -> None:
    """Say who holds the lock; on a disk without room for that it holds all the same."""
    with contextlib.suppress(OSError):
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)


def _refusal(folder: Path, holder: str) -> CampaignError:
    return CampaignError(
        f"{folder} is being driven by {holder or 'another process'}.",
        "Wait until that has ended, or name another folder (--out).",
    )
