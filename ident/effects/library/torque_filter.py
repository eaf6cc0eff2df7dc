"""A drive whose torque follows the one that it reports, as a current loop of low bandwidth does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign
from ident.plant.places import DRIVES, with_groups
from ident.plant.symbolic import Expression


class _TorqueFilter(EffectTerm):
    def lags(self) -> Mapping[str, Expression]:
        """The time constant."""
        return self.everywhere("time")


EFFECT: Final = EffectKind(
    name="torque_filter",
    rank=230,
    places=with_groups(DRIVES),
    parameters=(EffectParameter("time", "s", "in which 63 % of a step of the torque reported act"),),
    term=_TorqueFilter,
    words="a torque that follows the one reported within {time}",
    usual=lambda vehicle, where: 0.02,
    sign=Sign.NOT_NEGATIVE,
    always=False,
)
