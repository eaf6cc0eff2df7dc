"""Where the gap lies: parts of a coordinate are never more than the whole of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ident.diagnosis.check.remainder import shares
from ident.diagnosis.observations.rows import make_rows


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("hidden", [0.0, 0.5])
def test_a_region_holds_no_more_than_its_coordinate(world: type[Any], seed: int, hidden: float) -> None:
    """Noise alone exceeds its floor in one half as often as it stays below it."""
    rows = make_rows(world(seed=seed, hidden=hidden).problem(0))
    models = [block.baseline @ np.array([1.0, -2.0, 0.5]) for block, _ in rows.blocks]
    found = {(one.coordinate, one.region): one.share for one in shares(rows, np.ones(2), models)}
    whole = {coordinate: share for (coordinate, region), share in found.items() if region == "all"}
    assert sum(whole.values()) == pytest.approx(1.0) or sum(whole.values()) == 0.0
    assert all(share <= whole[coordinate] + 1e-12 for (coordinate, _), share in found.items())
