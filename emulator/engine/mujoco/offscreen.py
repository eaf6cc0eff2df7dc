"""OpenGL without a display, for pictures: by the processor (OSMesa) or by a graphics card's driver (EGL)."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from ctypes.util import find_library
from typing import Any, Final

import mujoco

from ident.errors import UserError

BACKENDS: Final[Mapping[str, Sequence[str]]] = {
    "linux": ("osmesa", "egl", "glfw"),
    "darwin": ("cgl", "glfw"),
}
"""What MuJoCo draws with on a system, as its variable MUJOCO_GL calls it; what needs no display comes first."""

_ELSEWHERE: Final = ("glfw",)
_LIBRARIES: Final[Mapping[str, str]] = {"osmesa": "OSMesa", "egl": "EGL"}
"""What some of them need of the system."""

_REMEDY: Final = "Install one: apt install libosmesa6; or take --engine pybullet."


def choose_backend(environment: Mapping[str, str], platform: str, has_library: Callable[[str], bool]) -> str:
    """What to draw with: what MUJOCO_GL names, otherwise the first that needs no display and whose library is there.

    One has to be chosen: PyOpenGL keeps to the first that was tried.

    Args:
        environment: variables.
        platform: as `sys.platform` has it.
        has_library: whether the system has a library.

    Raises:
        UserError: MUJOCO_GL names something else, or no library is there.
    """
    known = BACKENDS.get(platform, _ELSEWHERE)
    asked = environment.get("MUJOCO_GL", "").lower().strip()
    if asked and asked not in known:
        raise UserError(f"MUJOCO_GL is {asked!r}: with that no video is drawn.", f"Unset it, or take {_either(known)}.")
    if asked:
        return asked
    there = (name for name in known if name not in _LIBRARIES or has_library(_LIBRARIES[name]))
    chosen = next(there, "glfw")
    if platform == "linux" and chosen == "glfw":
        raise UserError("MuJoCo draws by OpenGL, and there is none here that needs no display.", _REMEDY)
    return chosen


def open_context(environment: Mapping[str, str], model: Any, width: int, height: int) -> tuple[Any, Any]:
    """OpenGL, current in this thread, and MuJoCo's `MjrContext` of a model in it.

    Args:
        environment: variables.
        model: MuJoCo's.
        width, height: of what is drawn [pixels].

    Raises:
        UserError: it cannot be had.
    """
    name = choose_backend(environment, sys.platform, lambda library: find_library(library) is not None)
    try:
        opengl = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
        opengl.make_current()
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
    except Exception as error:  # what a driver lacks shows as anything from ImportError to FatalError
        raise UserError(f"MuJoCo cannot draw with {name}: {error or type(error).__name__}.", _REMEDY) from error
    return opengl, context


def _either(names: Sequence[str]) -> str:
    return " or ".join(names)
