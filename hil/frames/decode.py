"""From recorded frames to SI arrays, with nothing but the network file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.frames.grid import SyncGrid
from hil.frames.logs import read_log
from hil.frames.table import FrameTable
from hil.network import MappedObject, Network, Node, Pdo, PdoDirection
from ident.errors import RecordError

_TORQUE_ACTUAL = 0x6077
_POSITION_ACTUAL = 0x6064
_ENCODER_POSITION = 0x6004
_TARGET_TORQUE = 0x6071

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


def decode_log(path: Path, network: Network, accept_truncated: bool = False, longest_gap: int = 5) -> DecodedLog:
    """Decode a recorded step.

    Args:
        path: BLF, ASC, candump or MF4 log.
        network: the network file of the vehicle that it was recorded on.
        accept_truncated: use what there is of a log whose writer was killed.
        longest_gap: cycles in a row that a master short of time may have left out; they are interpolated.

    Raises:
        RecordError: the log cannot be read, a node is not in it, frames have other lengths, a sample is missing, or
            more cycles in a row than `longest_gap`.
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
        grid = SyncGrid(self._stamps, self._network.cycle_period)
        if grid.worst_gap > longest_gap:
            raise RecordError(
                f"{self._path}: {grid.worst_gap} cycles in a row are missing after t = {grid.worst_gap_at:.3f} s.",
                "Drive the step again; see to it that the master keeps its cycle.",
            )
        drives, encoders = self._network.drives, self._network.encoders
        return DecodedLog(
            time=grid.time,
            command_torques=grid.hold(_columns([self._commands(node) for node in drives])),
            motor_torques=grid.interpolate(_columns([self._torque(node) for node in drives])),
            wheel_angles=grid.interpolate(_columns([self._angle(node, _POSITION_ACTUAL) for node in drives])),
            steering_angles=grid.interpolate(_columns([self._angle(node, _ENCODER_POSITION) for node in encoders])),
            jitter=grid.jitter,
            missing=grid.missing,
            resampled=grid.resamples,
            start=float(self._stamps[0]),
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
        return _scaled(np.cumsum((steps + half) % node.counter_modulus - half), node.angle_unit)

    def _torque(self, node: Node) -> FloatArray:
        return _scaled(self._sampled(node, _TORQUE_ACTUAL), node.torque_unit)

    def _sampled(self, node: Node, index: int) -> NDArray[np.int64]:
        pdo, item, offset = _locate(node, PdoDirection.TRANSMIT, index)
        rows = self._rows(node, pdo, self._cycle)
        self._refuse_gaps(node, self._cycle[rows])
        cycles, first = np.unique(self._cycle[rows], return_index=True)
        return self._values(rows[first][cycles < self._count], item, offset)

    def _commands(self, node: Node) -> FloatArray:
        pdo, item, offset = _locate(node, PdoDirection.RECEIVE, _TARGET_TORQUE)
        # A command waits in the drive for the next SYNC, so it belongs to the cycle after the one it was sent in.
        latched = self._cycle + 1
        rows = self._rows(node, pdo, latched)
        if not len(rows):
            raise RecordError(f"{self._path} has no commands to {node.label}.", "Record the master's own frames too.")
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
        missing = np.setdiff1d(np.arange(self._count), cycles)
        if len(missing):
            times = ", ".join(f"{cycle * self._network.cycle_period:.3f} s" for cycle in missing[:5])
            raise RecordError(
                f"{self._path}: {node.label} has no sample in {len(missing)} of {self._count} cycles (t = {times}"
                f"{', ...' if len(missing) > 5 else ''}).",
                "Drive the step again; look for frames lost on the bus.",
            )

    def _values(self, rows: NDArray[np.intp], item: MappedObject, offset: int) -> NDArray[np.int64]:
        raw = np.ascontiguousarray(self._table.data[rows, offset : offset + item.bits // 8])
        return raw.view(f"<{item.code}").ravel().astype(np.int64)


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
