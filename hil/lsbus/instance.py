"""An FMU with a bus terminal as an importer runs it in event mode: operations in and out, and time between."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from fmu.bus.description import FRAMES_LOST, RX_CLOCK, RX_DATA, SEED, TX_CLOCK, TX_DATA
from hil.cosimulation.instance import FmuError, FmuInstance

_CHANGED: Final = 2
"""fmi3IntervalChanged."""

_NOT_YET_KNOWN: Final = 0
"""fmi3IntervalNotYetKnown."""


class BusFmuInstance(FmuInstance):
    """A co-simulation instance of FMI 3.0 with a bus terminal `CAN`.

    It is in event mode except within `advance`.

    Args:
        path: of the FMU.
        start: start values by name.
        seed: of the noise of its readings.

    Raises:
        FmuError: as `FmuInstance`, or the FMU has no bus terminal.
    """

    def __init__(self, path: Path, start: Mapping[str, float], *, seed: int = 1) -> None:
        self._seed = seed
        super().__init__(path, start)
        try:
            self._rx, self._rx_clock, self._tx, self._tx_clock = (
                self.port([name]).references[0] for name in (RX_DATA, RX_CLOCK, TX_DATA, TX_CLOCK)
            )
        except FmuError as error:
            self.close()
            raise FmuError(f"{path} has no CAN bus terminal.", "Name an FMU of `quasiomni fmu --bus`.") from error
        clock = next(row for row in self._description.modelVariables if row.name == TX_CLOCK)
        self._triggered = clock.causality == "output"
        self._next: float | None = None
        self._ask()

    @property
    def next_tick(self) -> float:
        """When Tx_Clock is to tick [s], infinite where that is not known."""
        return float("inf") if self._next is None else self._next

    @property
    def lost(self) -> int:
        """Frames of the devices that found the queue full."""
        return int(self._call(self._instance.getUInt32, [self._variables[FRAMES_LOST]])[0])

    def give(self, operations: bytes) -> None:
        """Put operations into Rx_Data; Rx_Clock ticks."""
        self._call(self._instance.setClock, [self._rx_clock], [True])
        self._call(self._instance.setBinary, [self._rx], [operations])
        self._update()

    def take(self) -> bytes:
        """Let Tx_Clock tick, and return Tx_Data."""
        if not self._triggered:
            self._call(self._instance.setClock, [self._tx_clock], [True])
        data: bytes = self._call(self._instance.getBinary, [self._tx])[0] or b""
        self._update()
        return data

    def advance(self, instant: float) -> bool:
        """Step up to `instant` [s]; whether the FMU asks for an event there."""
        self._call(self._instance.enterStepMode)
        needed = bool(self._call(self._instance.doStep, self.time, instant - self.time)[0])
        self.time = instant
        self._call(self._instance.enterEventMode)
        self._ask()
        return needed

    def _open(self) -> Any:
        if not self._is_fmi3:
            raise FmuError(f"{self._path} is of FMI 2.0.", "Name an FMU of `quasiomni fmu --bus`.")
        return self._instantiate(event_mode_used=True)

    def _begin(self, start: Mapping[str, float]) -> None:
        self._call(self._instance.enterInitializationMode)
        self.write(self.port(list(start)), list(start.values()))
        if SEED in self._variables:
            self._call(self._instance.setInt32, [self._variables[SEED]], [self._seed])
        self._call(self._instance.exitInitializationMode)

    def _update(self) -> None:
        self._call(self._instance.updateDiscreteStates)
        self._ask()

    def _ask(self) -> None:
        """What Tx_Clock says now: the time of its countdown, or whether it ticks."""
        if self._triggered:
            self._next = self.time if self._call(self._instance.getClock, [self._tx_clock])[0] else None
            return
        reference, interval, qualifier = (
            (ctypes.c_uint32 * 1)(self._tx_clock),
            (ctypes.c_double * 1)(),
            (ctypes.c_int * 1)(),
        )
        self._call(self._instance.getIntervalDecimal, reference, interval, qualifier)
        if qualifier[0] == _CHANGED:
            self._next = round(self.time + interval[0], 9)
        elif qualifier[0] == _NOT_YET_KNOWN:
            self._next = None
