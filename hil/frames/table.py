"""Frames of a log as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

NOT_DATA: Final = 0xFFFFFFFF
"""Identifier given to remote, error and extended frames, none of which the network sends in a cycle."""


@dataclass(frozen=True)
class FrameTable:
    """N frames in the order of the log: stamp [s], identifier, length and bytes (N, 8) of each."""

    time: NDArray[np.float64]
    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]
    data: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.time)
