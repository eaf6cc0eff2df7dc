"""Files that are whole or not there."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from ident.errors import UserError


def refuse_folder(path: Path) -> None:
    """Refuse the name of a folder for a file that is to be written.

    Raises:
        UserError: it is one.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder.", "Name the file to write, in it or elsewhere.")


def write_whole(content: str | bytes, path: Path) -> None:
    """Write a file; a reader of `path` sees the old one or the new one, never half of it.

    Raises:
        UserError: it cannot be written, or is a folder.
    """
    refuse_folder(path)
    part = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise UserError(f"{path} cannot be written: {error.strerror}.", "Name a place that can be written.") from error
