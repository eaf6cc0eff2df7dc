"""What this computer has of what commands need: interpreter, packages, engine, compiler, CAN of the kernel."""

from __future__ import annotations

import enum
import platform
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from packaging.requirements import Requirement

from fmu.compiling import find_compiler
from ident.errors import UserError
from ident.extras import PURPOSES, Extra, missing_modules

PYTHON: Final = (3, 11)
"""Oldest interpreter."""

WHEELS: Final = (3, 11)
"""The newest interpreter for which PyBullet has ready wheels on Linux."""

_ENGINE_SECONDS: Final = 60.0

_CAN_DEVICE: Final = "280"
"""ARPHRD_CAN, the type of a CAN interface (linux/if_arp.h)."""


class CheckName(enum.StrEnum):
    """What is looked at."""

    PYTHON = "python"
    PACKAGES = "packages"
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
    COMPILER = "compiler"
    SOCKETCAN = "socketcan"
    CAN_UTILS = "can-utils"


_TRIALS: Final[Mapping[CheckName, str]] = MappingProxyType(
    {
        CheckName.EMULATOR: "import pybullet; pybullet.disconnect(pybullet.connect(pybullet.DIRECT))",
        CheckName.MUJOCO: "import mujoco; mujoco.MjData(mujoco.MjModel.from_xml_string('<mujoco/>'))",
    }
)
"""The least that an engine has to do."""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: what.
        found: it is there, and works.
        detail: version or place, or what is wrong.
        purpose: what needs it.
        remedy: what to do where it is missing.
    """

    name: CheckName
    found: bool
    detail: str
    purpose: str
    remedy: str

    def as_json(self) -> dict[str, Any]:
        """Plain values; the remedy only where there is something to mend."""
        return {**vars(self), "name": str(self.name), "remedy": None if self.found else self.remedy}


def examine(names: Sequence[CheckName]) -> list[Check]:
    """Look at some things."""
    return [_CHECKS[name](name) for name in names]


def _python(name: CheckName) -> Check:
    found = sys.version_info[:2] >= PYTHON
    hint = "" if sys.version_info[:2] <= WHEELS else "; PyBullet has no wheel for it: take MuJoCo, the extra mujoco"
    detail = f"{platform.python_implementation()} {platform.python_version()}{hint}"
    return Check(name, found, detail, "everything", "Install Python 3.11 or newer.")


def _packages(name: CheckName) -> Check:
    lacking, there = _lacking(_requirements(None))
    remedy = "Install them: pip install --upgrade quasiomni."
    return Check(name, not lacking, ", ".join(lacking or there), "everything", remedy)


def _extra(name: CheckName) -> Check:
    extra = Extra(name)
    lacking, there = _lacking(_requirements(extra))
    # A package may be there in name alone, or be brought by an extra of another package.
    lacking += [f"{module} cannot be imported" for module in missing_modules(extra) if not lacking]
    remedy = f"Install the extra: pip install 'quasiomni[{extra}]'."
    return Check(name, not lacking, ", ".join(lacking or there), PURPOSES[extra], remedy)


def _engine(name: CheckName) -> Check:
    """The engine is tried in a process of its own: a build that does not fit the computer ends it."""
    check = _extra(name)
    if not check.found:
        return check
    try:
        done = subprocess.run(
            [sys.executable, "-c", _TRIALS[name]], capture_output=True, text=True, timeout=_ENGINE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return Check(name, False, "the engine does not answer", check.purpose, check.remedy)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return Check(name, False, f"the engine does not start: {last}", check.purpose, check.remedy)
    return check


def _compiler(name: CheckName) -> Check:
    purpose, remedy = "fmu, can exec", "Install one: apt install gcc libc6-dev, or pip install 'quasiomni[ziglang]'."
    try:
        compiler = find_compiler()
    except UserError as error:
        return Check(name, False, error.what, purpose, remedy)
    reach = "all platforms" if compiler.cross else "this computer alone"
    return Check(name, True, f"{compiler.name}, for {reach}", purpose, remedy)


def _socketcan(name: CheckName) -> Check:
    purpose = "--bus socketcan:...; unix: buses need none of it"
    remedy = "Load it: modprobe can_raw vcan && ip link add vcan0 type vcan && ip link set vcan0 up; or use unix:PATH."
    family = getattr(socket, "AF_CAN", None)
    if family is None:
        return Check(name, False, f"{sys.platform} has none", purpose, "Use another interface of python-can, or unix:.")
    try:
        socket.socket(family, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        return Check(name, False, f"the kernel has none ({error.strerror})", purpose, remedy)
    found = sorted(path.parent.name for path in Path("/sys/class/net").glob("*/type") if _is_can(path))
    return Check(name, bool(found), ", ".join(found) or "no interface", purpose, remedy)


def _is_can(path: Path) -> bool:
    try:
        return path.read_text(encoding="ascii").strip() == _CAN_DEVICE
    except OSError:
        # An interface may go while it is looked at.
        return False


def _can_utils(name: CheckName) -> Check:
    path = shutil.which("candump")
    return Check(name, path is not None, path or "no candump", "can exec -- candump", "apt install can-utils.")


def _requirements(extra: Extra | None) -> Iterable[Requirement]:
    """What the package asks for: without an extra, or for one alone."""
    for text in requires("quasiomni") or ():
        requirement = Requirement(text)
        plain, asked = (
            requirement.marker is None or requirement.marker.evaluate({"extra": name}) for name in ("", str(extra))
        )
        if plain if extra is None else asked and not plain:
            yield requirement


def _lacking(requirements: Iterable[Requirement]) -> tuple[list[str], list[str]]:
    """What is missing or too old of some requirements, and what is there."""
    lacking, there = [], []
    for requirement in requirements:
        try:
            installed = version(requirement.name)
        except PackageNotFoundError:
            lacking.append(f"{requirement.name} is missing")
            continue
        if requirement.specifier.contains(installed, prereleases=True):
            there.append(f"{requirement.name} {installed}")
        else:
            lacking.append(f"{requirement.name} {installed} is not {requirement.specifier}")
    return lacking, there


_CHECKS: Final[Mapping[CheckName, Callable[[CheckName], Check]]] = MappingProxyType(
    {
        **{CheckName(extra): _extra for extra in Extra},
        CheckName.PYTHON: _python,
        CheckName.PACKAGES: _packages,
        **dict.fromkeys(_TRIALS, _engine),
        CheckName.COMPILER: _compiler,
        CheckName.SOCKETCAN: _socketcan,
        CheckName.CAN_UTILS: _can_utils,
    }
)
