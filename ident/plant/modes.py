"""Motion modes, equation (9)."""

from __future__ import annotations

import enum
from typing import Final


class Mode(enum.IntEnum):
    """k of (9), numbered as in Fig. 3."""

    ALIGNMENT = 1
    STEERED = 2
    LATERAL = 3
    ROTATION = 4


MODE_TOLERANCE: Final = 0.02
"""By which steering angles may miss those of a mode, where nobody says how far [rad]."""
