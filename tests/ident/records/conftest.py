from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.records.table import COMMANDS, REQUIRED, STEERING_ANGLES, TORQUES, WHEEL_ANGLES

Table = dict[str, NDArray]


@pytest.fixture(scope="session")
def table_of() -> Callable[..., Table]:
    """A table of all channels with random contents, its steps behind each other."""

    def make(steps: tuple[str, ...] = ("straight",), samples: int = 20, seed: int = 0) -> Table:
        generator = np.random.default_rng(seed)
        count = samples * len(steps)
        numbers = (*TORQUES, *WHEEL_ANGLES, *STEERING_ANGLES, *COMMANDS)
        table: Table = {
            "time": 3.0 + 0.002 * np.arange(count),
            "step": np.repeat(np.array(steps), samples),
            **{name: generator.normal(size=count) for name in numbers},
            "period": np.tile(np.repeat([-1, 0, 1, -1], samples // 4), len(steps)),
            "temperature": generator.normal(size=count),
        }
        assert set(REQUIRED) <= table.keys()
        return table

    return make
