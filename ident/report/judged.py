"""Everything that was judged without having been fitted, over its noise: before and with the causes, on one scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ident.diagnosis.diagnosis import Diagnosis, Gap
from ident.report.headline import CHANNELS, STEPS

LOWEST: Final = 0.5
"""Times the noise, at which the scale begins; what is below stands there."""

HIGHEST: Final = 4.0
"""At which it ends, or later."""

MOST: Final = 1000.0
"""At which it ends at the latest; what is above stands there. A model that runs away says no more by how far."""

TICKS: Final = (3.0, 10.0, 30.0, 100.0, 300.0)

WHOLE: Final = "all rows held out"


@dataclass(frozen=True)
class Judged:
    """One line: steps and channel, and where its values stand on the scale.

    Attributes:
        steps, channel: in words.
        gap: in units of the noise.
        before, after, noise: places on the scale, 0 to 1.
    """

    steps: str
    channel: str
    gap: Gap
    before: float
    after: float
    noise: float


def judged_steps(diagnosis: Diagnosis) -> list[Judged]:
    """The whole gap, then that of each kind of steps and channel."""
    entries = [(WHOLE, "", diagnosis.gap)]
    entries += [(STEPS[one.steps], CHANNELS[one.channel], one.gap) for one in diagnosis.unseen]
    finite = [one for one in entries if all(map(math.isfinite, (one[2].before, one[2].after, one[2].floor)))]
    top = _top([gap for _, _, gap in finite])
    return [
        Judged(steps, channel, gap, *(_place(value, top) for value in (gap.before, gap.after, gap.floor)))
        for steps, channel, gap in finite
    ]


def scale_ticks(lines: Sequence[Judged]) -> list[tuple[float, float]]:
    """Times the noise, and their places on the scale."""
    top = _top([one.gap for one in lines])
    return [(value, _place(value, top)) for value in (1.0, *(tick for tick in TICKS if tick <= 0.9 * top))]


def _top(gaps: Sequence[Gap]) -> float:
    return min(max([HIGHEST, *(max(gap.before, gap.after) for gap in gaps)]), MOST)


def _place(value: float, top: float) -> float:
    """On a logarithmic scale from LOWEST to `top`."""
    return math.log(min(max(value, LOWEST), top) / LOWEST) / math.log(top / LOWEST)
