"""Whether there is a display to show a window on."""

from __future__ import annotations

import sys
from collections.abc import Mapping

from ident.errors import UserError


def require_display(environment: Mapping[str, str]) -> None:
    """Refuse a window where the environment names no display; the engine would end the whole process.

    Raises:
        UserError: Linux without DISPLAY.
    """
    if sys.platform == "linux" and not environment.get("DISPLAY"):
        raise UserError(
            "There is no display to show the vehicle on.", "Run without --gui, or set DISPLAY to an X server."
        )
