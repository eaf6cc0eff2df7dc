"""Builds the library that is preloaded into SocketCAN programs, once, and says how it is preloaded."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

from ident.errors import BusError

_UNITS: Final = ("preload", "interfaces", "sending", "receiving", "descriptors", "broadcast", "isotp", "isotp_transfer")
_HEADERS: Final = ("real", "interfaces", "sockets", "broadcast", "isotp", "isotp_transfer")

SOURCES: Final = tuple(Path(__file__).with_name(f"{name}.c") for name in _UNITS)
"""The library's sources; their headers stand beside them."""

HEADERS: Final = tuple(Path(__file__).with_name(f"{name}.h") for name in _HEADERS)
"""The headers of the library's sources."""
_OPTIONS: Final = ("-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror")
_LONGEST_NAME: Final = 15
_SYSTEM_COMPILERS: Final = ("cc", "gcc", "clang")


def compilers() -> list[list[str]]:
    """The C compilers found here as commands, the system's before that of the package `ziglang`."""
    found = [[path] for name in _SYSTEM_COMPILERS if (path := shutil.which(name)) is not None]
    if importlib.util.find_spec("ziglang") is not None:
        found.append([sys.executable, "-m", "ziglang", "cc"])
    return found


def build_library(cache: Path | None = None, compiler: list[str] | None = None) -> Path:
    """The library, built if this source was not built before.

    Args:
        cache: folder that keeps it, made if missing; the user's cache folder unless given.
        compiler: command of a C compiler, the first one of `compilers` unless given.

    Raises:
        BusError: this is not Linux, there is no C compiler, or it fails.
    """
    if sys.platform != "linux":
        raise BusError("SocketCAN programs exist on Linux only.", "Use python-can's own interfaces instead.")
    content = b"".join(path.read_bytes() for path in (*SOURCES, *HEADERS))
    digest = hashlib.sha256(content).hexdigest()[:16]
    target = (cache or user_cache_path("quasiomni")) / f"socketcan-{digest}.so"
    if not target.is_file():
        _compile(compiler or _any_compiler(), target)
    return target


def environment(environ: Mapping[str, str], library: Path, interfaces: Mapping[str, Path]) -> dict[str, str]:
    """Environment in which a program finds the hubs of `unix:` buses as CAN interfaces.

    Args:
        environ: what else is in it.
        library: see `build_library`.
        interfaces: name of each interface, such as `can0`, and the path of its hub.

    Raises:
        BusError: a name or a path cannot be given to the library.
    """
    for name, path in interfaces.items():
        if not 0 < len(name) <= _LONGEST_NAME or "," in f"{name}{path}" or "=" in name:
            raise BusError(f"{name}={path} cannot be a CAN interface.", "Use a name like can0, and no commas.")
    preloaded = [str(library), *filter(None, [environ.get("LD_PRELOAD")])]
    named = ",".join(f"{name}={path.absolute()}" for name, path in interfaces.items())
    return {**environ, "LD_PRELOAD": ":".join(preloaded), "QUASIOMNI_CAN": named}


def is_served(hub: Path) -> bool:
    """Whether the hub of a `unix:` bus is there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        try:
            probe.connect(str(hub))
        except OSError:
            return False
    return True


def _any_compiler() -> list[str]:
    found = compilers()
    if not found:
        raise BusError(
            "There is no C compiler to build the SocketCAN library with.",
            "Install gcc (Debian: apt install gcc libc6-dev), or pip install 'quasiomni[ziglang]'.",
        )
    return found[0]


def _compile(compiler: list[str], target: Path) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        # Built beside its place and then moved: two processes may build at once.
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            built = Path(folder) / target.name
            command = [*compiler, *_OPTIONS, *map(str, SOURCES), "-o", str(built), "-ldl", "-lpthread"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise BusError(
                    f"{compiler[0]} cannot build the SocketCAN library: {done.stderr.strip()[:500]}.",
                    "Install the C headers (Debian: libc6-dev, linux-libc-dev), or pip install 'quasiomni[ziglang]'.",
                )
            os.replace(built, target)
    except OSError as error:
        raise BusError(
            f"The SocketCAN library cannot be built in {target.parent}: {error.strerror}.",
            "Set XDG_CACHE_HOME to a folder that can be written to.",
        ) from error
