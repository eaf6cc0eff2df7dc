"""From recorded frames to SI arrays, with nothing but the network file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.frames.grid import SyncGrid
from hil.frames.logs import read_log
from hil.frames.table import FrameTable
from hil.network import MappedObject, Network, Node, Pdo, PdoDirection
from hil.network.cia import Index
from ident.errors import RecordError
from ident.records.checks import ALONE, UNJUDGED

LONGEST_GAP: Final = 5
"""Cycles in a row that a master short of time may leave out: 10 ms, over which samples can be interpolated."""

_MOSTLY: Final = 0.1
"""Share of cycles without a command below which those frames were lost, and not left out by the master."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class DecodedLog:
    """Samples of N consecutive cycles; SI units, vehicle signs; columns fl, rl, fr, rr or left, right.

    Attributes:
        time: (N,) instants of the SYNCs on the grid of the cycle period, from 0 [s].
        command_torques: (N, 4) motor torques commanded at each SYNC, as the drives latched them [Nm].
        motor_torques: (N, 4) motor torques measured at each SYNC [Nm].
        wheel_angles: (N, 4) rolling angles, unwrapped [rad].
        steering_angles: (N, 2) steering angles alpha_l, alpha_r, unwrapped [rad].
        jitter: largest deviation of the time between two SYNCs from the cycle period, left-out cycles aside [s].
        missing: cycles that the master left out.
        resampled: the SYNCs were not on the grid, so the rows are interpolated linearly between them by their stamps.
        start: stamp of the first SYNC in the log [s].
        cycles: SYNCs in the log.
        cycle: (N,) number of the SYNC that each row belongs to, -1 where the master left cycles out.
    """

    time: FloatArray
    command_torques: FloatArray
    motor_torques: FloatArray
    wheel_angles: FloatArray
    steering_angles: FloatArray
    jitter: float
    missing: int
    resampled: bool
    start: float
    cycles: int
    cycle: NDArray[np.int64]


def decode_log(
    path: Path, network: Network, accept_truncated: bool = False, longest_gap: int = LONGEST_GAP
) -> DecodedLog:
    """Decode a recorded step.

    Args:
        path: BLF, ASC, candump or MF4 log.
        network: the network file of the vehicle that it was recorded on.
        accept_truncated: use what there is of a log whose writer was killed.
        longest_gap: cycles in a row that a master short of time may have left out; they are interpolated.

    Raises:
        RecordError: the log cannot be read, a node is not in it, frames have other lengths, a sample or a command is
            missing, more cycles in a row than `longest_gap` are, or the clock of the log was set.
    """
    return _Decoder(read_log(path, accept_truncated), network, path, accept_truncated).decode(longest_gap)


def decode_frames(table: FrameTable, network: Network, source: str) -> DecodedLog:
    """Decode the frames of a step that were kept in memory; `source` is named in messages.

    Raises:
        RecordError: as `decode_log`.
    """
    return _Decoder(table, network, Path(source), False).decode(0)


class _Decoder:
    def __init__(self, table: FrameTable, network: Network, path: Path, drop_last: bool) -> None:
        self._table = table
        self._network = network
        self._path = path
        is_sync = table.can_id == network.sync_cob_id
        self._cycle = np.cumsum(is_sync) - 1
        self._stamps = table.time[is_sync]
        if drop_last:
            self._stamps = self._stamps[:-1]
        self._count = len(self._stamps)
        if not self._count:
            raise RecordError(f"{path} holds no complete cycle.", "Drive the step again.")

    def decode(self, longest_gap: int) -> DecodedLog:
        self._refuse_absent_nodes()
        grid = SyncGrid(self._stamps, self._network.cycle_period, longest_gap, str(self._path))
        drives, encoders = self._network.drives, self._network.encoders
        wheels = _columns([self._angle(node, Index.POSITION_ACTUAL) for node in drives])
        steering = _columns([self._angle(node, Index.ENCODER_POSITION) for node in encoders])
        units = np.abs([node.angle_unit for node in (*drives, *encoders)])
        grid.refuse_clock_steps(np.hstack([wheels, steering]), units, self._network.cycle_period, str(self._path))
        return DecodedLog(
            time=grid.time,
            command_torques=grid.hold(_columns([self._commands(node) for node in drives])),
            motor_torques=grid.interpolate(_columns([self._torque(node) for node in drives])),
            wheel_angles=grid.interpolate(wheels),
            steering_angles=grid.interpolate(steering),
            jitter=grid.jitter,
            missing=grid.missing,
            resampled=grid.resamples,
            start=float(self._stamps[0]),
            cycles=self._count,
            cycle=grid.nearest,
        )

    def _refuse_absent_nodes(self) -> None:
        present = set(np.unique(self._table.can_id).tolist())
        absent = [
            node.label
            for node in self._network.nodes
            for pdo in node.pdos
            if pdo.direction is PdoDirection.TRANSMIT and pdo.cob_id(node.node_id) not in present
        ]
        if absent:
            raise RecordError(
                f"{self._path} has no samples of {', '.join(dict.fromkeys(absent))}.",
                f"Decode it with the network file that it was recorded with ({self._network.path} was used).",
            )

    def _angle(self, node: Node, index: int) -> FloatArray:
        counts = self._sampled(node, index)
        half = node.counter_modulus // 2
        steps = np.diff(counts, prepend=np.int64(node.zero_counts))
        unwrapped = np.cumsum((steps + half) % node.counter_modulus - half)
        self._refuse_lone(node, index, unwrapped)
        return _scaled(unwrapped, node.angle_unit)

    def _torque(self, node: Node) -> FloatArray:
        counts = self._sampled(node, Index.TORQUE_ACTUAL)
        self._refuse_lone(node, Index.TORQUE_ACTUAL, counts)
        return _scaled(counts, node.torque_unit)

    def _refuse_lone(self, node: Node, index: int, counts: NDArray[np.int64]) -> None:
        """Refuse the only sample that is not as all others: records do not know the resolution of what rests."""
        away = np.abs(counts - int(np.median(counts)))
        (others,) = np.nonzero(away)
        if len(others) == 1 and UNJUDGED <= others[0] < len(counts) - UNJUDGED and away[others[0]] > ALONE:
            raise RecordError(
                f"{self._path}: {index:04X}h of {node.label} is {away[others[0]]} counts off at sample {others[0]}, "
                "and rests in all others: that is no motion.",
                "It was damaged, in the file or in the sensor: cut that part out, or record again.",
            )

    def _sampled(self, node: Node, index: int) -> NDArray[np.int64]:
        pdo, item, offset = _locate(node, PdoDirection.TRANSMIT, index)
        rows = self._rows(node, pdo, self._cycle)
        self._refuse_gaps(node, self._cycle[rows])
        # Cycles are counted in the order of the frames: the first one of each is where the number changes.
        first = np.flatnonzero(np.diff(self._cycle[rows], prepend=-1))
        return self._values(rows[first], item, offset)

    def _commands(self, node: Node) -> FloatArray:
        pdo, item, offset = _locate(node, PdoDirection.RECEIVE, Index.TARGET_TORQUE)
        # A command waits in the drive for the next SYNC, so it belongs to the cycle after the one it was sent in.
        latched = self._cycle + 1
        rows = self._rows(node, pdo, latched)
        if not len(rows):
            raise RecordError(f"{self._path} has no commands to {node.label}.", "Record the master's own frames too.")
        self._refuse_lost_commands(node, latched[rows])
        last = np.searchsorted(latched[rows], np.arange(self._count), side="right") - 1
        values = self._values(rows, item, offset)
        return _scaled(values[np.maximum(last, 0)], node.torque_unit)

    def _rows(self, node: Node, pdo: Pdo, cycle: NDArray[np.int64]) -> NDArray[np.intp]:
        can_id = pdo.cob_id(node.node_id)
        rows = np.flatnonzero((self._table.can_id == can_id) & (cycle >= 0) & (cycle < self._count))
        size = sum(item.bits for item in pdo.objects) // 8
        wrong = rows[self._table.length[rows] != size]
        if len(wrong):
            raise RecordError(
                f"{self._path}: frame {can_id:03X}h of {node.label} has {self._table.length[wrong[0]]} bytes, "
                f"not {size}.",
                "Decode it with the network file that it was recorded with.",
            )
        return rows

    def _refuse_gaps(self, node: Node, cycles: NDArray[np.int64]) -> None:
        missing = _absent(cycles, self._count)
        if len(missing):
            times = ", ".join(f"{cycle * self._network.cycle_period:.3f} s" for cycle in missing[:5])
            raise RecordError(
                f"{self._path}: {node.label} has no sample in {len(missing)} of {self._count} cycles (t = {times}"
                f"{', ...' if len(missing) > 5 else ''}).",
                "Drive the step again; look for frames lost on the bus.",
            )

    def _refuse_lost_commands(self, node: Node, latched: NDArray[np.int64]) -> None:
        """A master that commands in every cycle does so in each; one that only sends changes is believed."""
        silent = _absent(latched, self._count)
        silent = silent[silent > 0]
        if 0 < len(silent) < _MOSTLY * self._count:
            raise RecordError(
                f"{self._path}: no command to {node.label} in {len(silent)} of {self._count} cycles "
                f"(t = {silent[0] * self._network.cycle_period:.3f} s first), and one in all others.",
                "Drive the step again; look for frames lost on the bus.",
            )

    def _values(self, rows: NDArray[np.intp], item: MappedObject, offset: int) -> NDArray[np.int64]:
        raw = np.ascontiguousarray(self._table.data[rows, offset : offset + item.bits // 8])
        return raw.view(f"<{item.code}").ravel().astype(np.int64)


def _absent(cycles: NDArray[np.int64], count: int) -> NDArray[np.intp]:
    """Numbers below `count` that are not among some."""
    present = np.zeros(count, dtype=bool)
    present[cycles] = True
    return np.flatnonzero(~present)


def _locate(node: Node, direction: PdoDirection, index: int) -> tuple[Pdo, MappedObject, int]:
    for pdo in node.pdos:
        offset = 0
        for item in pdo.objects:
            if pdo.direction is direction and item.index == index:
                return pdo, item, offset
            offset += item.bits // 8
    raise AssertionError(f"{index:04X}h was checked to be mapped when the network file was read")


def _scaled(counts: NDArray[np.int64], unit: float) -> FloatArray:
    return np.multiply(counts, unit, dtype=np.float64)


def _columns(columns: Sequence[FloatArray]) -> FloatArray:
    return np.stack(columns, axis=1)
