"""Lag: by how much of a sample all torques act later, or earlier, than they are reported, as no cause explains.

Torques are held over a sample, or ramp to the next one; angles are read anywhere within it; contacts yield. Which it is
no record says, so that a part of a sample, the same at all drives, is fitted with everything else. A model that was
identified from other records of the vehicle says how much of it there was.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.causes.contribution import contribution_of
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import transform_cause
from ident.records.rates import nominal
from ident.vehicle.lag import Lag

Array = NDArray[np.float64]

LAG_NAME: Final = "lag"

LAG_STD: Final = 0.25
"""Standard deviation of it beforehand [samples]: a torque that is held acts half a sample late."""


def stated_lag(lag: Lag | None, sources: Sequence[Source]) -> Lag | None:
    """What a model says of the lag, where that holds for these records.

    They are sampled as those that it was identified from, and it is no more than sampling explains: what is later than
    that shall be found.
    """
    if lag is None or any(nominal(one.interval) != nominal(lag.interval) for one in sources):
        return None
    return lag if abs(lag.value) <= 2 * (LAG_STD * lag.interval + lag.std) else None


def lag_columns(sources: Sequence[Source], context: Context) -> list[Array]:
    """What a lag of one sample adds to the rows of every block, (N,) to first order."""
    late = contribution_of(transform_cause(EffectName.TIME_DELAY, "drives"), [True] * len(sources), sources, context)
    probe = min(source.interval for source in sources) / 2
    found: list[Array] = []
    series = iter(late(np.array([probe]), context.parameters))
    for source in sources:
        for _ in source.coordinates:
            column = next(series)
            length = len(source.inputs[:: source.factor])
            found.append(np.zeros(length) if column is None else column * source.interval / probe)
    return found
