"""Files as a user hands them over: regular, bounded in size, and of plain values, or refused with their name."""

from __future__ import annotations

import json
import re
import stat
import struct
import tomllib
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ident.errors import DataFileError, UserError

LARGEST_TEXT: Final = 4 << 20
"""Bytes that a file of settings (TOML, JSON, EDS) may have."""
LARGEST_RECORD: Final = 512 << 20
"""Bytes that a record or a log may have, as it lies on the disk and unpacked: half an hour of a busy bus."""
DEEPEST: Final = 24
"""Tables and lists in each other that a file of settings may have."""
PARSER_ERRORS: Final = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RuntimeError,
    SystemError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)
"""What parsers of others raise on damaged content, where they have no error of their own for it."""

_INTEGERS: Final = range(-(2**63), 2**63)
"""What TOML guarantees, and what a float or a counter can take."""
CONTROL: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]")
"""Control characters, but those that lay a text out."""
_DOTTED: Final = re.compile(rf"(?:[\w\"'-]+[ \t]*\.[ \t]*){{{2 * DEEPEST}}}")
"""A dotted key beyond any depth: refused before a parser takes the square of its length in time."""

_Kind = type[UserError]


def refuse_unreadable(path: Path, limit: int, kind: _Kind = DataFileError) -> int:
    """See that a path is a regular file of bounded size; nothing of it is read, so a pipe or a device cannot block.

    Args:
        path: the file.
        limit: bytes that it may have.
        kind: of the error.

    Returns:
        Its size [bytes].

    Raises:
        UserError: it is missing, a folder, a device, a pipe, or larger.
    """
    try:
        found = path.stat()
    except FileNotFoundError as error:
        raise kind(f"{path} does not exist.", "Name an existing file.") from error
    except (OSError, ValueError) as error:
        raise kind(f"{path} cannot be read: {getattr(error, 'strerror', error)}.", "Name a readable file.") from error
    if not stat.S_ISREG(found.st_mode):
        raise kind(f"{path} cannot be read: it is no regular file.", "Name a file, no folder, device or pipe.")
    if found.st_size > limit:
        raise kind(
            f"{path} has {found.st_size} bytes; at most {limit} are read.", "Name another file, or split this one."
        )
    return found.st_size


def read_bounded(path: Path, limit: int = LARGEST_TEXT, kind: _Kind = DataFileError) -> bytes:
    """The bytes of a regular file of bounded size.

    Raises:
        UserError: of that kind; as `refuse_unreadable`.
    """
    refuse_unreadable(path, limit, kind)
    try:
        with path.open("rb") as file:
            # Bounded once more: files of /proc say that they are empty, and a file may grow meanwhile.
            content = file.read(limit + 1)
    except OSError as error:
        raise kind(f"{path} cannot be read: {error.strerror}.", "Name a readable file.") from error
    if len(content) > limit:
        raise kind(f"{path} has more than the {limit} bytes that are read.", "Name another file, or split this one.")
    return content


def read_text(path: Path, kind: _Kind = DataFileError) -> str:
    """The text of a file of settings: UTF-8, a byte order mark is passed over.

    Raises:
        UserError: of that kind; as `refuse_unreadable`, or it is no UTF-8 (says in which line).
    """
    content = read_bounded(path, kind=kind)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise kind(
            f"{path} is no UTF-8 text: byte {content[error.start]:02X}h in line {line}.", "Save it as UTF-8."
        ) from error


def read_toml(path: Path) -> dict[str, Any]:
    """Parse a TOML file into plain values: integers of 64 bits, names and texts without control characters.

    Raises:
        DataFileError: the file cannot be read, is not TOML, or holds what no setting can be; says where.
    """
    document: dict[str, Any] = _parsed(path, "TOML", tomllib.loads)
    return document


def parse_toml(content: bytes, where: str) -> dict[str, Any]:
    """Parse TOML that stands in another file, such as an archive, as `read_toml` does.

    Raises:
        DataFileError: it is too large, is not TOML, or holds what no setting can be; says where.
    """
    if len(content) > LARGEST_TEXT:
        raise DataFileError(f"{where} has more than {LARGEST_TEXT} bytes.", "Name another file.")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataFileError(f"{where} is no UTF-8 text.", "Name another file.") from error
    document: dict[str, Any] = _parsed_text(text, Path(where), "TOML", tomllib.loads)
    return document


def read_json(path: Path) -> Any:
    """Parse a JSON file, as `read_toml`; NaN and infinity are refused.

    Raises:
        DataFileError: as `read_toml`.
    """
    return _parsed(path, "JSON", lambda text: json.loads(text, parse_constant=_refuse_constant))


def _parsed(path: Path, language: str, parse: Callable[[str], Any]) -> Any:
    return _parsed_text(read_text(path), path, language, parse)


def _parsed_text(text: str, path: Path, language: str, parse: Callable[[str], Any]) -> Any:
    if _DOTTED.search(text):
        raise _too_deep(path)
    try:
        document = parse(text)
    except RecursionError as error:
        raise _too_deep(path) from error
    except ValueError as error:
        # Not the parsers' own errors alone: Python refuses to convert integers of thousands of digits by itself.
        raise DataFileError(f"{path} is not valid {language}: {error}.", "Mend the file at that place.") from error
    _refuse_odd_values(document, path)
    return document


def _too_deep(path: Path) -> DataFileError:
    return DataFileError(
        f"{path} nests tables or lists deeper than a file of settings does.", f"Use at most {DEEPEST} in each other."
    )


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is no number")


def _refuse_odd_values(document: Any, path: Path) -> None:
    """Walk all values with a stack of our own: a document may nest deeper than Python recurses."""
    waiting: list[tuple[str, int, Any]] = [("", 0, document)]
    while waiting:
        where, depth, value = waiting.pop()
        if depth > DEEPEST:
            raise _too_deep(path)
        _refuse_odd_value(value, f"{path}: {where}")
        waiting += [(name, depth + 1, item) for name, item in _members(value, where, path)]


def _members(value: Any, where: str, path: Path) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, item in value.items():
            if CONTROL.search(name):
                raise DataFileError(
                    f"{path}: the name {name!r} holds control characters.", "Write it in letters, digits and _."
                )
            yield (f"{where}.{name}" if where else name), item
    elif isinstance(value, Sequence) and not isinstance(value, str):
        yield from ((f"{where}[{number}]", item) for number, item in enumerate(value))


def _refuse_odd_value(value: Any, where: str) -> None:
    if isinstance(value, int) and value not in _INTEGERS:
        raise DataFileError(f"{where} is an integer of more than 64 bits.", "Give a number that can be.")
    if isinstance(value, str) and CONTROL.search(value):
        raise DataFileError(f"{where} is a text with control characters.", "Write it without them.")
