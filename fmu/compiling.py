"""C sources to shared libraries, by the cross compiler `ziglang` or, for this computer alone, the system's."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

from fmu.platforms import Platform, host_platform
from ident.errors import UserError

HEADERS: Final = Path(__file__).parent / "headers"
"""The header files of FMI 2.0.4 and 3.0.1, by the Modelica Association, 2-clause BSD licence."""

FLAGS: Final = (
    "-std=c99",
    "-O2",
    # The same operations in the same order on every processor: no fused multiply-add where others have none.
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fvisibility=hidden",
    "-shared",
)
"""Of every platform; nothing that depends on the place of the sources, so that builds repeat byte for byte."""

_WINDOWS_UNIT: Final = "windows.c"
"""What libraries for Windows need beyond the C runtime of Windows, when the cross compiler's C library stays out."""

_INCLUDE: Final = re.compile(rb'^#include "([^"]+)"', re.MULTILINE)

_UNIVERSAL_ALIGNMENT: Final = 14
"""Binary logarithm of the page of arm64 macOS, where the slices of a universal binary start."""

_UNIVERSAL_TYPES: Final = {"x86_64-darwin": (0x01000007, 3), "aarch64-darwin": (0x0100000C, 0)}
"""Processor type and subtype in a universal binary (mach/machine.h)."""


@dataclass(frozen=True)
class Compiler:
    """How a compiler is called.

    Attributes:
        name: for people.
        command: what to call, before the flags.
        cross: whether it builds for every platform.
    """

    name: str
    command: tuple[str, ...]
    cross: bool


def find_compiler() -> Compiler:
    """The cross compiler where it is installed, else the system's.

    Raises:
        UserError: there is none.
    """
    if importlib.util.find_spec("ziglang") is not None:
        return Compiler("ziglang", (sys.executable, "-m", "ziglang", "cc"), cross=True)
    for name in ("cc", "gcc", "clang"):
        path = shutil.which(name)
        if path is not None:
            return Compiler(name, (path,), cross=False)
    raise UserError("There is no C compiler.", "Install one: pip install 'quasiomni[ziglang]'.")


def check_platforms(compiler: Compiler, platforms: Sequence[Platform]) -> None:
    """Refuse platforms that a compiler cannot build for.

    Raises:
        UserError: one of them is not this computer, and the compiler builds for nothing else.
    """
    others = [platform.name for platform in platforms if platform != host_platform()]
    if others and not compiler.cross:
        raise UserError(
            f"{compiler.name} builds for this computer alone, not for {', '.join(others)}.",
            "Install the cross compiler: pip install 'quasiomni[ziglang]', or build with --platforms host.",
        )


def compile_libraries(
    sources: Mapping[str, bytes],
    platforms: Sequence[Platform],
    compiler: Compiler,
    progress: Callable[[Platform], None],
    cache: Path | None = None,
) -> dict[str, bytes]:
    """Shared libraries of C sources, by the names of the platforms.

    The cross compiler keeps objects and the C libraries of its targets. It knows an object by the place and content of
    its source, so each source lies in a folder named by its content: the equations are compiled once for all vehicles.
    The first build for a platform compiles its C library. For Windows that takes two minutes a processor, so there
    the C runtime that comes with Windows is used alone.

    Args:
        sources: file name -> text, `.c` files and the headers that they include.
        platforms: what to build for.
        compiler: from `find_compiler`.
        progress: called with each platform that is done.
        cache: folder for sources; None for the user's cache folder.

    Raises:
        UserError: the compiler cannot build for a platform, or reports an error; the message quotes its last lines.
    """
    check_platforms(compiler, platforms)
    place = cache or user_cache_path("quasiomni") / "fmu"
    units = [_keep(place, name, sources) for name in sorted(sources) if name.endswith(".c")]
    windows = {_WINDOWS_UNIT: (resources.files("fmu") / "data" / _WINDOWS_UNIT).read_bytes()}
    more = [_keep(place, _WINDOWS_UNIT, windows)] if any(_bare(platform, compiler) for platform in platforms) else []

    def build(platform: Platform) -> bytes:
        library = _compile(place, [*units, *(more if _bare(platform, compiler) else [])], platform, compiler)
        progress(platform)
        return library

    with ThreadPoolExecutor(max_workers=max(1, os.cpu_count() or 1)) as pool:
        built = list(pool.map(build, platforms))
    return {platform.name: library for platform, library in zip(platforms, built, strict=True)}


def _keep(place: Path, unit: str, sources: Mapping[str, bytes]) -> str:
    """Put a C file and what it includes into the folder of their content; the file's place below `place`."""
    names = sorted(_included(unit, sources))
    digest = hashlib.sha256(b"".join(name.encode() + b"\0" + sources[name] for name in names)).hexdigest()[:20]
    folder = place / digest
    if not folder.is_dir():
        place.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(dir=place))
        try:
            for name in names:
                (made / name).write_bytes(sources[name])
            made.rename(folder)
        except OSError:
            shutil.rmtree(made)
            if not folder.is_dir():
                raise
            # Another build has put the same content there in the meantime.
    return f"{digest}/{unit}"


def _included(unit: str, sources: Mapping[str, bytes]) -> set[str]:
    """A C file and all sources that it includes, directly or not."""
    found, new = {unit}, {unit}
    while new:
        named = {match.decode() for name in new for match in _INCLUDE.findall(sources[name])}
        new = {name for name in named if name in sources} - found
        found |= new
    return found


def _bare(platform: Platform, compiler: Compiler) -> bool:
    """Whether a library is linked with the C runtime of Windows alone."""
    return compiler.cross and platform.suffix == ".dll"


def _bare_flags() -> tuple[str, ...]:
    """Of the cross compiler: its C library stays out, its headers of that stay in."""
    return ("-nostdlib", "-isystem", str(_zig_folder() / "lib" / "libc" / "include" / "any-windows-any"))


def _zig_folder() -> Path:
    spec = importlib.util.find_spec("ziglang")
    if spec is None or not spec.submodule_search_locations:
        raise UserError("The cross compiler is gone.", "Install it: pip install 'quasiomni[ziglang]'.")
    return Path(spec.submodule_search_locations[0])


def _compile(place: Path, units: Sequence[str], platform: Platform, compiler: Compiler) -> bytes:
    windows = platform.suffix == ".dll"
    target = ("-target", platform.target, "-s") if compiler.cross else ("-s",)
    bare = _bare(platform, compiler)
    kind = _bare_flags() if bare else () if windows else ("-fPIC",)
    libraries = ("-lucrtbase",) if bare else () if windows else ("-lm",)
    flags = (*FLAGS, *platform.flags, *target, *kind, "-I", str(HEADERS))
    with tempfile.TemporaryDirectory(prefix="quasiomni-") as folder:
        # A macOS library carries its own name, which must not depend on where it is built.
        name = () if not platform.name.endswith("darwin") else ("-install_name", f"@rpath/model{platform.suffix}")
        output = Path(folder) / f"model{platform.suffix}"
        call = (*compiler.command, *flags, *name, "-o", str(output), *units, *libraries)
        done = subprocess.run(call, cwd=place, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            tail = " / ".join(done.stderr.strip().splitlines()[-3:])
            raise UserError(
                f"{compiler.name} cannot build for {platform.name}: {tail}",
                "Mend the compiler, or leave that platform out (--platforms).",
            )
        return output.read_bytes()


def universal_binary(slices: Mapping[str, bytes]) -> bytes:
    """One macOS library for several processors (mach-o/fat.h), of libraries by the names of their platforms."""
    page = 1 << _UNIVERSAL_ALIGNMENT
    header = struct.pack(">II", 0xCAFEBABE, len(slices))
    body = b""
    for name, library in slices.items():
        offset = page + len(body)
        header += struct.pack(">IIIII", *_UNIVERSAL_TYPES[name], offset, len(library), _UNIVERSAL_ALIGNMENT)
        body += library + bytes(-len(library) % page)
    return header.ljust(page, b"\0") + body
