"""Readers of other people's formats in a process of their own, which may die of a file without taking this one along.

asammdf unpacks texts in C by offsets that stand in the file: where they are damaged, it ends by a segmentation fault.
A process for each file has no state to go wrong; it costs half a second.
"""

from __future__ import annotations

import importlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from ident.reading import PARSER_ERRORS

MEMORY: Final = 6 << 30
"""Address space of the reading process [bytes]; its libraries take a third of it."""
SECONDS: Final = 60.0
"""Time for any file."""
SECONDS_PER_BYTE: Final = 1e-5
"""Further time for a large one; reading takes a hundredth of it."""
_PROGRAM: Final = "import sys; sys.path[:] = sys.argv[4:]; from ident.records.apart import answer; answer()"

Result = TypeVar("Result")


def read_apart(read: Callable[[Path], Result], path: Path) -> Result:
    """What a function of a module reads from a file, in another process.

    Raises:
        ValueError: it could not be read, the reader died of it, or it took too long.
    """
    command = [sys.executable, "-c", _PROGRAM, read.__module__, read.__qualname__, str(path.absolute()), *sys.path]
    seconds = SECONDS + SECONDS_PER_BYTE * path.stat().st_size
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=seconds
        )
    except subprocess.TimeoutExpired as late:
        raise ValueError(f"its reader took more than {seconds:.0f} s") from late
    if not done.stdout:
        raise ValueError(f"its reader died of it (exit {done.returncode})")
    result, error = pickle.loads(done.stdout)
    if error:
        raise ValueError(error)
    read_result: Result = result
    return read_result


def answer() -> None:
    """In the other process: read, and write the result, or what the error says, to standard output."""
    _limit_memory()
    module, name, path = sys.argv[1:4]
    # What the reader prints is no part of the answer.
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)
        try:
            found = getattr(importlib.import_module(module), name)(Path(path)), ""
        except PARSER_ERRORS as error:
            found = None, str(error) or type(error).__name__
        output.write(pickle.dumps(found, protocol=pickle.HIGHEST_PROTOCOL))


def _limit_memory() -> None:
    try:
        import resource  # not on Windows
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
