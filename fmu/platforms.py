"""The platforms that an FMU carries binaries for: names in both FMI versions, and compiler targets."""

from __future__ import annotations

import platform
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from ident.errors import UserError


@dataclass(frozen=True)
class Platform:
    """An operating system on a processor.

    Attributes:
        name: platform tuple of FMI 3.0, section 2.5.1.4.1.
        folder_fmi2: folder below `binaries/` in FMI 2.0; 2.0 names none for arm, importers look for the tuple.
        suffix: of a shared library.
        target: of the cross compiler; oldest system that the binary runs on.
        flags: beyond those that all platforms share.
    """

    name: str
    folder_fmi2: str
    suffix: str
    target: str
    flags: tuple[str, ...] = ()


# 32-bit x86 computes in 80 bits unless told to use the same registers as everyone else.
_SSE: Final = ("-msse2", "-mfpmath=sse")

_ALL: Final = (
    Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
    Platform("aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu.2.17"),
    Platform("x86-linux", "linux32", ".so", "x86-linux-gnu.2.17", _SSE),
    Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu"),
    Platform("aarch64-windows", "aarch64-windows", ".dll", "aarch64-windows-gnu"),
    Platform("x86-windows", "win32", ".dll", "x86-windows-gnu", _SSE),
    Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos.10.13"),
    Platform("aarch64-darwin", "darwin64", ".dylib", "aarch64-macos.11.0"),
)
PLATFORMS: Final[Mapping[str, Platform]] = MappingProxyType({entry.name: entry for entry in _ALL})
"""Every platform by its name."""

_SYSTEMS: Final = {"linux": "linux", "win32": "windows", "darwin": "darwin"}
_PROCESSORS: Final = {"x86_64": "x86_64", "amd64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64", "i686": "x86"}


def host_platform() -> Platform:
    """The platform of this computer.

    Raises:
        UserError: it is none of the platforms above.
    """
    system, processor = _SYSTEMS.get(sys.platform, ""), _PROCESSORS.get(platform.machine().lower(), "")
    try:
        return PLATFORMS[f"{processor}-{system}"]
    except KeyError:
        raise UserError(
            f"FMUs are not built on {platform.machine()} under {sys.platform}.",
            f"Platforms: {', '.join(PLATFORMS)}.",
        ) from None


def parse_platforms(text: str) -> tuple[Platform, ...]:
    """`all`, `host`, or names parted by commas.

    Raises:
        UserError: a name is not known.
    """
    if text == "all":
        return _ALL
    names = [name.strip() for name in text.split(",")]
    chosen = []
    for name in names:
        if name != "host" and name not in PLATFORMS:
            raise UserError(f"There is no platform {name!r}.", f"Use all, host, or some of {', '.join(PLATFORMS)}.")
        chosen.append(host_platform() if name == "host" else PLATFORMS[name])
    return tuple(dict.fromkeys(chosen))
