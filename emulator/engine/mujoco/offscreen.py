"""OpenGL without a display, for pictures: by a graphics card (EGL) or by the processor (OSMesa)."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping, Sequence
from typing import Any, Final

from ident.errors import UserError

_ON_LINUX: Final = ("egl", "osmesa")
_MODULES: Final[Mapping[str, str]] = {name: f"mujoco.{name}" for name in (*_ON_LINUX, "glfw", "cgl")}
"""MuJoCo's, by what its variable MUJOCO_GL calls them; each has a `GLContext`."""


def backends(environment: Mapping[str, str], platform: str) -> Sequence[str]:
    """What to try, in this order: what MUJOCO_GL names, otherwise what needs no display.

    Args:
        environment: variables.
        platform: as `sys.platform` has it.

    Raises:
        UserError: MUJOCO_GL names something else.
    """
    asked = environment.get("MUJOCO_GL", "").lower().strip()
    if not asked:
        return _ON_LINUX if platform == "linux" else ("cgl", "glfw") if platform == "darwin" else ("glfw",)
    if asked not in _MODULES:
        raise UserError(f"MUJOCO_GL is {asked!r}.", f"Unset it, or take one of: {', '.join(_MODULES)}.")
    return (asked,)


def open_context(environment: Mapping[str, str], width: int, height: int) -> Any:
    """MuJoCo's `GLContext` of the first backend that works here, made current.

    Args:
        environment: variables.
        width, height: of what is drawn [pixels].

    Raises:
        UserError: none does.
    """
    failures = []
    for name in backends(environment, sys.platform):
        try:
            context = importlib.import_module(_MODULES[name]).GLContext(width, height)
            context.make_current()
        except Exception as error:  # noqa: BLE001 - a library that is missing or lacks a function shows as anything
            failures.append(f"{name}: {error or type(error).__name__}")
        else:
            return context
    raise UserError(
        f"MuJoCo finds no OpenGL that draws without a display ({'; '.join(failures)}).",
        "Install one: apt install libosmesa6; or take --engine pybullet.",
    )
