"""Option codes of CiA 402-2: how the drive comes to rest, and where it goes from there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum, auto
from typing import Final


class StopKind(Enum):
    """A way of stopping."""

    DISABLE = auto()
    """Power off at once; the shaft coasts."""
    SLOW_DOWN = auto()
    """The slow-down ramp: speed to zero at 6084h; in the torque modes, torque to zero at 6087h."""
    QUICK_STOP = auto()
    """The quick stop ramp: speed to zero at 6085h in every mode."""
    CURRENT_LIMIT = auto()
    """Speed to zero with as much torque as 6072h and 6073h allow."""
    VOLTAGE_LIMIT = auto()
    """The same, with no more braking than the brake chopper can take from the DC link."""


class AbortConnection(IntEnum):
    """Values of 6007h: what the loss of the master leads to."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


@dataclass(frozen=True)
class QuickStop:
    """One value of 605Ah: how to stop, and whether to stay in quick stop active."""

    kind: StopKind
    stays: bool


_K = StopKind
QUICK_STOP_OPTIONS: Final[Mapping[int, QuickStop]] = {
    0: QuickStop(_K.DISABLE, False),
    1: QuickStop(_K.SLOW_DOWN, False),
    2: QuickStop(_K.QUICK_STOP, False),
    3: QuickStop(_K.CURRENT_LIMIT, False),
    4: QuickStop(_K.VOLTAGE_LIMIT, False),
    5: QuickStop(_K.SLOW_DOWN, True),
    6: QuickStop(_K.QUICK_STOP, True),
    7: QuickStop(_K.CURRENT_LIMIT, True),
    8: QuickStop(_K.VOLTAGE_LIMIT, True),
}
"""605Ah."""

SHUTDOWN_OPTIONS: Final[Mapping[int, StopKind]] = {0: _K.DISABLE, 1: _K.SLOW_DOWN}
"""605Bh, before transition 8."""

DISABLE_OPERATION_OPTIONS: Final[Mapping[int, StopKind]] = {0: _K.DISABLE, 1: _K.SLOW_DOWN}
"""605Ch, before transition 5."""

HALT_OPTIONS: Final[Mapping[int, StopKind]] = {
    1: _K.SLOW_DOWN,
    2: _K.QUICK_STOP,
    3: _K.CURRENT_LIMIT,
    4: _K.VOLTAGE_LIMIT,
}
"""605Dh; the drive stays in operation enabled."""

FAULT_REACTION_OPTIONS: Final[Mapping[int, StopKind]] = {0: _K.DISABLE, **HALT_OPTIONS}
"""605Eh, before transition 14."""
