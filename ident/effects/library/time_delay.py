"""A drive whose torque, or an encoder whose angle, comes later than it says."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import DRIVES, ENCODERS, with_groups
from ident.plant.symbolic import Expression


class _TimeDelay(EffectTerm):
    def delays(self) -> Mapping[str, Expression]:
        """The dead time."""
        return self.everywhere("delay")


EFFECT: Final = EffectKind(
    name="time_delay",
    rank=110,
    places=with_groups(DRIVES, ENCODERS),
    parameters=(EffectParameter("delay", "s", "torque acts, or angle is reported, so much later"),),
    term=_TimeDelay,
    words="{delay} late",
    usual=lambda vehicle, where: 0.02,
    always=False,
    same_records=MappingProxyType({"unsynchronised@torque": DRIVES, "unsynchronised@alpha": ENCODERS}),
)
