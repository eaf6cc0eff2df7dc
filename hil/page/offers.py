"""Which faults can be asked for on the page, and where."""

from __future__ import annotations

from collections.abc import Sequence

from hil.faults.fault import SPECIFICATIONS, Target
from hil.page.shown import Offer
from ident.vehicle.geometry import WHEELS


def offers(drives: Sequence[str], encoders: Sequence[str]) -> tuple[Offer, ...]:
    """All kinds of faults that have a place on the page; the emergency stop has a button of its own.

    Args:
        drives, encoders: names of the nodes.
    """
    places = _places(tuple(drives), (*drives, *encoders))
    return tuple(
        Offer(
            str(kind),
            places[one.target],
            one.what,
            tuple((name, known.what) for name, known in one.parameters.items()),
        )
        for kind, one in SPECIFICATIONS.items()
        if one.target in places
    )


def _places(drives: tuple[str, ...], nodes: tuple[str, ...]) -> dict[Target, tuple[str, ...]]:
    """Where a fault can be, in the words of its line; identifiers are those of an example."""
    return {
        Target.FRAMES: (*nodes, "master", "all", "0x181"),
        Target.IDENTIFIER: ("0x001", "0x080"),
        Target.SENDER: (*nodes, "master"),
        Target.NODE: nodes,
        Target.DRIVE: drives,
        Target.MASTER: ("master",),
        Target.GROUND: ("floor", *(f"wheel_{wheel}" for wheel in WHEELS)),
    }
