"""Drives a campaign of an exam on the emulator, over CAN; the record is decoded from the frames."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from emulator.effects.injection import AnyEffect
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench import LockstepBench
from hil.campaign.folder import Run, RunFolder, network_file_of
from hil.campaign.reading import read_driven
from hil.campaign.runner import CampaignRunner
from hil.network import load_network
from hil.recorder import Recorder
from ident.campaign.plan import Plan
from ident.records.record import Record, Step


class NobodyThere:
    """Hands that are not needed: no step of an exam lifts the vehicle."""

    def lift(self) -> None:
        """Not asked for."""
        raise AssertionError("an exam has no lifted step")

    def lower(self) -> None:
        """Not asked for."""
        raise AssertionError("an exam has no lifted step")


def drive(plan: Plan, prototype: str, seed: int, effects: Sequence[AnyEffect], noise_scale: float = 1.0) -> Record:
    """Record of a plan driven by a vehicle with effects.

    The alignments between the steps are left out: how many there were depends on the effect.

    Args:
        plan: the campaign.
        prototype: of the emulator, by name.
        seed: of all noise.
        effects: that the vehicle has.
        noise_scale: factor on every random source of the emulator.

    Raises:
        UserError: the vehicle cannot have the effects, or cannot drive with them.
    """
    network = load_network(network_file_of(prototype))
    with tempfile.TemporaryDirectory() as scratch:
        folder = RunFolder(Path(scratch))
        run = Run(folder, plan, network, seed, "", prototype, None)
        recorder = Recorder(folder.frames)
        try:
            with (
                EmulatedVehicle(
                    load_prototype(prototype), seed=seed, effects=effects, noise_scale=noise_scale
                ) as vehicle,
                LockstepBench(vehicle, network.path) as bench,
            ):
                CampaignRunner(run, bench.bus, bench.clock, recorder, NobodyThere(), lambda *_: None).drive()
        finally:
            recorder.close()
        record = read_driven(run)
    segments = [segment for segment in record.segments if segment.step != Step.ALIGNMENT]
    return replace(record, segments=segments, source="record")
