"""Play of a gear, or between the two units of a steering side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign
from ident.plant.places import DRIVES, STEERING, with_groups
from ident.plant.symbolic import Expression


class _Backlash(EffectTerm):
    def gaps(self) -> Mapping[str, Expression]:
        """The whole play."""
        return self.everywhere("gap")


EFFECT: Final = EffectKind(
    name="backlash",
    rank=120,
    places=with_groups(DRIVES, STEERING),
    parameters=(EffectParameter("gap", "rad", "whole play, at the wheel or at the steering axis"),),
    term=_Backlash,
    words="a play of {gap}",
    usual=lambda vehicle, where: 0.03,
    sign=Sign.NOT_NEGATIVE,
    always=False,
)
