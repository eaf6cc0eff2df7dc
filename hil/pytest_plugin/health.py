"""Whether a bus is well at the end of a test: error frames, load, unanswered SDO requests, lost heartbeats."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import can

from hil.network import Network
from hil.network.cia import FUNCTION_CODE, NMT_STATE, NODE_ID, SDO_ABORT, ErrorCode, NmtState, Service
from ident.errors import UserError

_LOST_AFTER: Final = 3.0
"""Heartbeat periods of silence after which a node counts as lost."""


class Symptom(StrEnum):
    """What can be wrong; a test that provokes one allows it."""

    ERROR_FRAMES = "error frames"
    OVERLOAD = "overload"
    UNANSWERED_SDO = "unanswered SDO"
    LOST_HEARTBEAT = "lost heartbeat"
    SDO_ABORT = "SDO abort"


def symptom(name: str) -> Symptom:
    """The symptom of this name.

    Raises:
        UserError: there is none.
    """
    if name not in list(Symptom):
        raise UserError(f"There is no symptom {name!r}.", f"Use one of {', '.join(Symptom)}.")
    return Symptom(name)


@dataclass(frozen=True)
class Finding:
    """A symptom, and what exactly was seen."""

    symptom: Symptom
    what: str


def examine(frames: Sequence[can.Message], peak_load: float, network: Network, end: float) -> list[Finding]:
    """What is wrong with a bus.

    Args:
        frames: all frames, in the order of the bus.
        peak_load: largest load of the bus [-].
        network: its nodes.
        end: the end of the test [s].
    """
    findings = []
    errors = sum(frame.is_error_frame for frame in frames)
    if errors:
        findings.append(Finding(Symptom.ERROR_FRAMES, f"{errors} error frames"))
    if peak_load > 1.0:
        findings.append(Finding(Symptom.OVERLOAD, f"frames for {peak_load:.0%} of what the bus can carry"))
    plain = [frame for frame in frames if not (frame.is_error_frame or frame.is_extended_id or frame.is_remote_frame)]
    findings += _unanswered(plain, network)
    findings += _lost(plain, network, end)
    return findings


def _unanswered(frames: Sequence[can.Message], network: Network) -> list[Finding]:
    findings = []
    open_requests: dict[int, can.Message] = {}
    nodes = {node.node_id: node for node in network.nodes}
    for frame in frames:
        service, node_id = frame.arbitration_id & FUNCTION_CODE, frame.arbitration_id & NODE_ID
        if node_id not in nodes or not frame.data:
            continue
        if service == Service.SDO_REQUEST and frame.data[0] != SDO_ABORT:
            open_requests[node_id] = frame
        elif service == Service.SDO_ANSWER:
            open_requests.pop(node_id, None)
            if frame.data[0] == SDO_ABORT:
                findings.append(Finding(Symptom.SDO_ABORT, _abort_text(nodes[node_id].label, frame)))
    for node_id, request in open_requests.items():
        what = f"{nodes[node_id].label} did not answer the SDO request {bytes(request.data).hex(' ')}"
        findings.append(Finding(Symptom.UNANSWERED_SDO, f"{what} at t = {request.timestamp:.3f} s"))
    return findings


def _abort_text(label: str, frame: can.Message) -> str:
    index, subindex, code = struct.unpack_from("<HBI", frame.data.ljust(8, b"\x00"), 1)
    return f"{label} refused {index:04X}h:{subindex} with {code:08X}h at t = {frame.timestamp:.3f} s"


def _lost(frames: Sequence[can.Message], network: Network, end: float) -> list[Finding]:
    """Nodes that have sent a heartbeat of *operational* and then fell silent, and nodes that miss one (8130h)."""
    findings = []
    for node in network.nodes:
        beats = [frame for frame in frames if frame.arbitration_id == Service.HEARTBEAT + node.node_id and frame.data]
        silence = _LOST_AFTER * node.quantities["heartbeat_period"].value
        if (
            len(beats) > 1
            and beats[-1].data[0] & NMT_STATE == NmtState.OPERATIONAL
            and end - beats[-1].timestamp > silence
        ):
            what = f"{node.label} sent its last heartbeat at t = {beats[-1].timestamp:.3f} s, {end:.3f} s is the end"
            findings.append(Finding(Symptom.LOST_HEARTBEAT, what))
        emergencies = [
            frame
            for frame in frames
            if frame.arbitration_id == Service.EMERGENCY + node.node_id and len(frame.data) > 1
        ]
        missed = [one for one in emergencies if struct.unpack_from("<H", one.data)[0] == ErrorCode.HEARTBEAT]
        findings += [
            Finding(Symptom.LOST_HEARTBEAT, f"{node.label} misses a heartbeat (8130h) at t = {one.timestamp:.3f} s")
            for one in missed
        ]
    return findings
