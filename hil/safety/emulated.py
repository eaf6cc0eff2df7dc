"""The trial on the emulated vehicle, in lockstep inside this process."""

from __future__ import annotations

import math
from pathlib import Path

from emulator.engine.choice import ENGINES
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.bench.prototypes import load_emulated
from hil.safety.report import MasterDeathReport, evaluate
from hil.safety.trial import DeathOfMaster, StopSettings
from ident.extras import EngineName, default_engine


class _Odometer:
    """Way of the chassis over the floor, as only the simulation knows it."""

    def __init__(self, vehicle: EmulatedVehicle) -> None:
        self._vehicle = vehicle
        self._start = vehicle.ground_truth().pose

    def __call__(self) -> float:
        """Distance from the start [m]; the trial drives straight."""
        x, y, _ = self._vehicle.ground_truth().pose
        return math.hypot(x - self._start[0], y - self._start[1])


def let_master_die(
    prototype: str, network: Path, settings: StopSettings, seed: int = 1, engine: EngineName | None = None
) -> MasterDeathReport:
    """Carry out the trial on an emulated prototype, on an engine or on the default one.

    Raises:
        DataFileError: prototype or network file is missing or malformed.
        TrialError: the speed is not reached.
    """
    emulated = load_emulated(prototype, network)
    loaded, described = emulated.prototype, emulated.network
    make = ENGINES[engine or default_engine()]
    with EmulatedVehicle(loaded, seed=seed, make_engine=make) as vehicle, LockstepBench(vehicle, network) as bench:
        trial = DeathOfMaster(bench.bus, bench.clock, described, loaded.geometry.wheel_radius, _Odometer(vehicle))
        return evaluate(trial.run(settings), settings, described)
