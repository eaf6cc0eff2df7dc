"""Drives a campaign of an exam on the emulator, over CAN; the record is decoded from the frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import can
import numpy as np

from emulator.vehicle import EmulatedVehicle
from hil.bench.emulation import BenchOperator
from hil.bench.lockstep import LockstepBench
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import segment_of
from hil.campaign.runner import CampaignRunner
from hil.frames import FrameTable, decode_frames
from hil.network import Network
from ident.campaign.plan import Plan
from ident.records.record import Record, Step

_SOURCE = "record"


Frame = tuple[float, int, bytes]
"""Stamp [s], identifier, data."""


class FramesInMemory:
    """A recorder that keeps the frames of each step; those between steps are let go."""

    def __init__(self) -> None:
        self.steps: list[tuple[str, list[Frame]]] = []
        self._frames: list[Frame] | None = None

    def __call__(self, message: can.Message) -> None:
        """Take a frame: what it holds now, for a master may send the same object again."""
        if self._frames is not None:
            self._frames.append((message.timestamp, message.arbitration_id, bytes(message.data)))

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """The frames inside belong to this step."""
        self._frames = []
        self.steps.append((name, self._frames))
        try:
            yield
        finally:
            self._frames = None

    def settle(self) -> None:
        """Nothing is ever on its way to a disk."""


def drive(plan: Plan, vehicle: EmulatedVehicle, network: Network, name: str, seed: int) -> Record:
    """Record of a plan.

    The alignments between the steps are no part of it: how many there were depends on the effect.

    Args:
        plan: the campaign.
        vehicle: that drives it.
        network: its drives.
        name: of the vehicle.
        seed: of all noise.

    Raises:
        UserError: the vehicle cannot drive it.
    """
    run = Run(RunFolder(Path(_SOURCE)), plan, network, seed, "", name, None)
    frames = FramesInMemory()
    with LockstepBench(vehicle, network.path) as bench:
        CampaignRunner(
            run, bench.bus, bench.clock, frames, BenchOperator(vehicle), lambda *_: None, spare_alignments=True
        ).drive()
    return Record(
        [
            segment_of(step, Path(_SOURCE), decode_frames(_table(kept), network, _SOURCE), network, plan)
            for step, kept in frames.steps
            if step != Step.ALIGNMENT
        ],
        _SOURCE,
    )


def _table(frames: Sequence[Frame]) -> FrameTable:
    stamps, identifiers, data = zip(*frames, strict=True)
    return FrameTable(
        time=np.array(stamps),
        can_id=np.array(identifiers, dtype=np.uint32),
        length=np.array([len(each) for each in data], dtype=np.uint8),
        data=np.frombuffer(b"".join(each.ljust(8, b"\0") for each in data), dtype=np.uint8).reshape(-1, 8),
    )
