"""What beyond the core packages some commands need, asked for before the work starts: extras, and physics engines."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from types import MappingProxyType
from typing import Final

from ident.errors import UserError


class Extra(enum.StrEnum):
    """Extras of the package, as pip knows them."""

    EMULATOR = "emulator"
    MUJOCO = "mujoco"
    RECORDS = "records"
    DBC = "dbc"
    ZIGLANG = "ziglang"
    COSIM = "cosim"
    EXAM = "exam"
    CLUSTER = "cluster"
    VIDEO = "video"
    MCAP = "mcap"
    WEB = "web"


MODULES: Final[Mapping[Extra, Sequence[str]]] = MappingProxyType(
    {
        Extra.EMULATOR: ("pybullet", "durand"),
        Extra.MUJOCO: ("mujoco", "durand"),
        Extra.RECORDS: ("pyarrow", "asammdf"),
        Extra.DBC: ("cantools",),
        Extra.ZIGLANG: ("ziglang",),
        Extra.COSIM: ("fmpy",),
        Extra.EXAM: ("cryptography", "pyarrow"),
        Extra.CLUSTER: ("distributed",),
        Extra.VIDEO: ("av", "PIL"),
        Extra.MCAP: ("mcap", "zstandard", "lz4"),
        Extra.WEB: ("viser",),
    }
)
"""What an extra brings, by the names that are imported."""

PURPOSES: Final[Mapping[Extra, str]] = MappingProxyType(
    {
        Extra.EMULATOR: "demo, emulate, safety, conformance, and campaign without --bus, on PyBullet",
        Extra.MUJOCO: "the same on MuJoCo",
        Extra.RECORDS: "Parquet and MF4 records, MF4 logs",
        Extra.DBC: "dbc",
        Extra.ZIGLANG: "fmu for other platforms than this computer",
        Extra.COSIM: "cosim, and an FMU as --plant",
        Extra.EXAM: "exam",
        Extra.CLUSTER: "exam --scheduler",
        Extra.VIDEO: "demo, campaign and emulate with --video",
        Extra.MCAP: "MCAP records and logs: convert, campaign --format .mcap",
        Extra.WEB: "campaign and emulate with --web",
    }
)
"""What an extra is for, in commands and options."""


class EngineName(enum.StrEnum):
    """Physics engines by the names that command line and files have for them."""

    PYBULLET = "pybullet"
    MUJOCO = "mujoco"


ENGINE_EXTRAS: Final[Mapping[EngineName, Extra]] = MappingProxyType(
    {EngineName.PYBULLET: Extra.EMULATOR, EngineName.MUJOCO: Extra.MUJOCO}
)
"""What brings an engine, and what the emulated vehicle needs beside it; the first that is installed is the default."""

TITLES: Final[Mapping[EngineName, str]] = MappingProxyType(
    {EngineName.PYBULLET: "PyBullet", EngineName.MUJOCO: "MuJoCo"}
)
"""The engines as people write them."""


def default_engine() -> EngineName:
    """The first engine that is installed; the first of all where none is."""
    installed = (name for name in EngineName if find_spec(name) is not None)
    return next(installed, EngineName.PYBULLET)


def named_engine(name: str) -> EngineName:
    """The engine of a name.

    Raises:
        UserError: there is none.
    """
    if name not in set(EngineName):
        raise UserError(f"There is no engine {name!r}.", f"Take one of: {', '.join(EngineName)}.")
    return EngineName(name)


def require_engine(asked: EngineName | None, what: str) -> EngineName:
    """The engine that was asked for, or the default, where it is installed.

    Args:
        asked: None for the default.
        what: needs it, the start of a sentence.

    Raises:
        UserError: it is not installed, or what the emulated vehicle needs beside it.
    """
    engine = asked or default_engine()
    missing = missing_modules(ENGINE_EXTRAS[engine])
    if missing:
        either = " or ".join(
            f"'quasiomni[{extra}]'" for extra in ([ENGINE_EXTRAS[asked]] if asked else ENGINE_EXTRAS.values())
        )
        raise UserError(
            f"{what} needs {' and '.join(missing)}, not installed here.", f"Install the extra: pip install {either}."
        )
    return engine


def missing_modules(extra: Extra) -> list[str]:
    """What is not installed of an extra; nothing is imported."""
    return [name for name in MODULES[extra] if find_spec(name) is None]


def require(extra: Extra, what: str, modules: Sequence[str] = ()) -> None:
    """Refuse what cannot work without an extra, before the work; nothing is imported.

    Args:
        extra: that is needed.
        what: needs it, the start of a sentence.
        modules: of the extra that are needed; none: all.

    Raises:
        UserError: one of them is not installed.
    """
    missing = [name for name in missing_modules(extra) if not modules or name in modules]
    if missing:
        raise UserError(
            f"{what} needs {' and '.join(missing)}, not installed here.",
            f"Install the extra: pip install 'quasiomni[{extra}]'.",
        )
