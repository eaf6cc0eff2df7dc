"""What is asked of the rates of a score."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

WITHOUT_TRUE: Final = "no confident wrong name without the true candidate"
PERMUTED: Final = "top-1 or in the set, answers permuted"

ASKED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "top-1 or in the set, size 0.5 and above": "at least 0.90",
        "set covers the truth where a name is given": "at least 0.95",
        "place or its side, of right names": "at least 0.90",
        "size within its 95 % interval": "at least 0.90",
        "false alarms on none": "at most 0.05",
        "unknown rejected": "at least 0.80",
        "invisible said to be invisible": "at least 0.95",
        "both of two named": "at least 0.70",
        WITHOUT_TRUE: "at least 0.80",
        PERMUTED: "chance",
    }
)
"""Name of a rate -> what is asked of it."""
