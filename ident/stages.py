"""Which stage of long work runs, for whoever waits for it."""

from __future__ import annotations

from collections.abc import Callable

Stage = Callable[[str], None]
"""Called with what begins, in a few words."""


def untold(_stage: str) -> None:
    """Nobody waits."""
