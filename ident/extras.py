"""What beyond the core packages some commands need, asked for before the work starts."""

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
    RECORDS = "records"
    DBC = "dbc"
    ZIGLANG = "ziglang"
    COSIM = "cosim"
    EXAM = "exam"
    CLUSTER = "cluster"


MODULES: Final[Mapping[Extra, Sequence[str]]] = MappingProxyType(
    {
        Extra.EMULATOR: ("pybullet", "durand"),
        Extra.RECORDS: ("pyarrow", "asammdf"),
        Extra.DBC: ("cantools",),
        Extra.ZIGLANG: ("ziglang",),
        Extra.COSIM: ("fmpy",),
        Extra.EXAM: ("cryptography", "pyarrow"),
        Extra.CLUSTER: ("distributed",),
    }
)
"""What an extra brings, by the names that are imported."""

PURPOSES: Final[Mapping[Extra, str]] = MappingProxyType(
    {
        Extra.EMULATOR: "demo, emulate, safety, conformance, and campaign without --bus",
        Extra.RECORDS: "Parquet and MF4 records, MF4 logs",
        Extra.DBC: "dbc",
        Extra.ZIGLANG: "fmu for other platforms than this computer",
        Extra.COSIM: "cosim, and an FMU as --plant",
        Extra.EXAM: "exam",
        Extra.CLUSTER: "exam --scheduler",
    }
)
"""What an extra is for, in commands and options."""


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
