"""Files that are whole or not there, and that are on the disk before they have their name."""

from __future__ import annotations

import errno
import math
import os
import secrets
import stat
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

from ident.errors import UserError

_STREAMS: Final = (stat.S_ISCHR, stat.S_ISFIFO)
"""What is written into and not replaced: a terminal, a pipe, `/dev/null`. Nothing that was in them can be lost."""

_NO_FOLDER_SYNC: Final = {errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EISDIR}
"""What file systems and systems answer that cannot put a folder on the disk by itself."""


def refuse_folder(path: Path) -> None:
    """Refuse the name of a folder for a file that is to be written.

    Raises:
        UserError: it is one.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder.", "Name the file to write, in it or elsewhere.")


def refuse_inputs(written: Iterable[Path | None], read: Iterable[Path | None]) -> None:
    """Refuse to write over what the same command reads, under whatever name, and two files under one.

    Args:
        written: files to write; None is passed over.
        read: files that are read; None and files that do not exist are passed over.

    Raises:
        UserError: named.
    """
    outputs = [path for path in written if path is not None]
    for path in outputs:
        if any(_is_same(path, one) for one in read if one is not None):
            raise UserError(f"{path} is read by this very command.", "Name another file to write: what is read stays.")
    places = [os.path.realpath(path) for path in outputs if not _is_stream(path)]
    twins = sorted({place for place in places if places.count(place) > 1})
    if twins:
        raise UserError(f"{twins[0]} is to be written twice.", "Give every file a name of its own.")


def refuse_unlike(path: Path, mark: bytes) -> None:
    """Refuse to write, under a name that was not asked for, over what is there and is something else.

    Args:
        path: to be written.
        mark: what is in every file of the kind that is to be written.

    Raises:
        UserError: a file of that name has no such mark.
    """
    try:
        is_other = path.is_file() and mark not in path.read_bytes()
    except OSError as error:
        raise unwritable(path, error) from error
    if is_other:
        raise UserError(
            f"{path} is there, and nothing that this command has written.", "Name another folder (--out), or move it."
        )


def _is_same(one: Path, other: Path) -> bool:
    try:
        return not _is_stream(one) and one.samefile(other)
    except OSError:
        return False


def write_whole(content: str | bytes, path: Path) -> None:
    """Write a file; a reader of `path` sees the old one or the new one, never half of it, whatever happens meanwhile.

    Raises:
        UserError: it cannot be written, or is a folder or a device.
    """
    refuse_folder(path)
    try:
        replace_whole(content, path)
    except OSError as error:
        raise unwritable(path, error) from error


def write_by(write: Callable[[Path], None], path: Path) -> None:
    """Write a file by a library that wants a path; whole or not there, as by `write_whole`.

    Args:
        write: writes the file whose path it is given; its suffix is that of `path`.
        path: to be written.

    Raises:
        UserError: it cannot be written, or is a folder or a device.
    """
    refuse_folder(path)
    try:
        _replace(write, path)
    except OSError as error:
        raise unwritable(path, error) from error


def replace_whole(content: str | bytes, path: Path) -> None:
    """`write_whole` for whoever has an answer of its own to a disk that is full.

    Raises:
        OSError: it cannot be written; what was there before is still there.
    """
    data = content.encode() if isinstance(content, str) else content
    _replace(lambda part: _write(part, data), path)


def finish(part: Path, path: Path) -> None:
    """Give a file that has been written its name, after its content is on the disk.

    Raises:
        OSError: the disk is full or gone; the file may still have its first name.
    """
    _sync(part)
    part.replace(path)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Put names that were given, or taken, in a folder on the disk.

    Raises:
        OSError: the disk is gone.
    """
    try:
        _sync(folder)
    except OSError as error:
        if error.errno not in _NO_FOLDER_SYNC:
            raise


def unwritable(path: Path, error: OSError) -> UserError:
    """What is said of a file that cannot be written."""
    return UserError(
        f"{path} cannot be written: {error.strerror or error}.", "Name a place that can be written, or free some space."
    )


def _replace(write: Callable[[Path], None], path: Path) -> None:
    target = _target(path)
    if target is None:
        write(path)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    # A name that nobody has: another process may write the same file now, or a killed one have left half of it.
    part = target.with_name(f".{target.stem[:200]}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        write(part)
        finish(part, target)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _write(path: Path, data: bytes) -> None:
    with path.open("wb") as file:
        file.write(data)


def _target(path: Path) -> Path | None:
    """The file that is replaced, a link followed to it; None for what is written into.

    Raises:
        OSError: it is something whose content must not be replaced by that of a file.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return Path(os.path.realpath(path))
    if stat.S_ISREG(mode):
        return Path(os.path.realpath(path))
    if any(is_kind(mode) for is_kind in _STREAMS):
        return None
    raise OSError(errno.EEXIST, "it is a device or a socket")


def _is_stream(path: Path) -> bool:
    with suppress(OSError):
        mode = path.stat().st_mode
        return any(is_kind(mode) for is_kind in _STREAMS)
    return False


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def json_number(value: float) -> float | None:
    """A number as JSON can hold it, which has no NaN and no infinity."""
    return float(value) if math.isfinite(value) else None
