"""Motors that ring on the compliance of their gears and do not rattle in a play: their wheels are not hammered loose.

Such a record is taken as it was measured, for its rolling rows tell the compliance better: from the rows of motors that
rattle it came out 4 to 19 % too large.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.gap.linear import least_squares
from ident.gap.vehicle.context import Context
from ident.gap.vehicle.contribution import contribution_of
from ident.gap.vehicle.rattling import UNTOLD, untold
from ident.gap.vehicle.sources import Source, rattling_sources
from ident.gap.vehicle.transforms import transform_cause
from ident.vehicle.effects import DRIVES, EffectName

Array = NDArray[np.float64]

BETTER: Final = 0.5
"""What a play must leave of the motion of a motor, over what a compliance alone leaves, to be more than that [-]."""


def with_rattling(sources: Sequence[Source], context: Context) -> list[Source]:
    """The sources and the rows of motors that rattle; records whose motors only ring as they were measured."""
    rattling = rattling_sources(sources, context.processing)
    hammered = {source.record for source in rattling if not _only_rings(source, context)}
    kept = [source if source.record in hammered else source.as_recorded() for source in sources]
    return [*kept, *rattling_sources(kept, context.processing)]


def _only_rings(source: Source, context: Context) -> bool:
    """Whether a compliance explains what all motors do that rattle, and a play does so hardly better."""
    rows = context.filtered(context.plain(source)[..., 0], source)
    return all(_rings(source, place, rows[:, place], context) for place in range(len(source.rattling)))


def _rings(source: Source, place: int, rows: Array, context: Context) -> bool:
    cause = transform_cause(EffectName.BACKLASH, DRIVES[source.rattling[place]])
    exact = contribution_of(cause, [True], [source], context)
    used = source.moving[place][:: source.factor]
    row, added = rows[used], [exact(sizes, context.parameters)[place] for sizes in np.diag(cause.probes)]
    columns = np.stack([np.zeros(len(row)) if one is None else one[used] for one in added], axis=1)
    play, compliance = (_left(row, some) for some in (columns, columns[:, 1:]))
    plain, next_to_nothing = untold(row, UNTOLD), untold(row, UNTOLD / 10)
    return compliance <= next_to_nothing or (compliance <= plain and play > BETTER * compliance)


def _left(row: Array, columns: Array) -> float:
    """Rms that least squares leave; nothing of no rows."""
    return float(np.sqrt(np.mean((row - columns @ least_squares(columns, row)) ** 2))) if row.size else 0.0
