"""A picture of what happened in a test, one SVG file: drives, NMT states, emergencies, faults, speed, bus load."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Final

import can

from hil.bus.bit_length import ERROR_FRAME_BITS, frame_bits
from hil.network import DRIVES
from hil.network.cia import NMT_STATE, DriveState, NmtState, Service
from hil.pytest_plugin.world import Sample, World

_WIDTH, _LEFT, _RIGHT, _ROW, _CURVE = 1000, 130, 20, 22, 90
_LOAD_WINDOW: Final = 0.02
_TICKS: Final = 10
"""Marks that the axis of time has at most."""
_NAMES_FROM: Final = 60
"""A bar at least this long [px] carries its name."""

_STATE_COLOURS: Final = {
    DriveState.OPERATION_ENABLED: "#5ba05b",
    DriveState.SWITCHED_ON: "#9cc29c",
    DriveState.READY_TO_SWITCH_ON: "#c5d6c5",
    DriveState.SWITCH_ON_DISABLED: "#d8d8d8",
    DriveState.NOT_READY_TO_SWITCH_ON: "#e8e8e8",
    DriveState.QUICK_STOP_ACTIVE: "#e6a23c",
    DriveState.FAULT_REACTION_ACTIVE: "#d9734e",
    DriveState.FAULT: "#c0392b",
}
_NMT: Final[Mapping[int, tuple[str, str]]] = {
    NmtState.BOOT_UP: ("boot-up", "#8e7cc3"),
    NmtState.STOPPED: ("stopped", "#d9734e"),
    NmtState.OPERATIONAL: ("operational", "#7fa8d1"),
    NmtState.PRE_OPERATIONAL: ("pre-operational", "#d3dfec"),
}
_FAULT_COLOUR, _EMERGENCY_COLOUR, _NOTE_COLOUR, _FAILED_COLOUR = "#b04a8f", "#c0392b", "#666666", "#c0392b"
_STYLE: Final = "text{font:11px sans-serif;fill:#222}.t{font-size:13px;font-weight:bold}.s{font-size:9px}"


@dataclass(frozen=True)
class _Axis:
    begin: float
    end: float

    def x(self, time: float) -> float:
        share = (min(max(time, self.begin), self.end) - self.begin) / max(self.end - self.begin, 1e-9)
        return round(_LEFT + share * (_WIDTH - _LEFT - _RIGHT), 1)


def timeline(world: World, title: str) -> str:
    """The picture as SVG text.

    Args:
        world: what was recorded.
        title: above the picture.
    """
    axis = _Axis(0.0, max(world.now, 0.01))
    rows: list[tuple[int, str]] = [(18, _text(_LEFT, 14, title, "t"))]
    rows += [(_ROW, part) for part in _drive_rows(world, axis)]
    rows += [(_ROW, part) for part in _node_rows(world, axis)]
    rows += [(_ROW, part) for part in _fault_rows(world, axis)]
    rows.append((_CURVE, _speed(world, axis)))
    rows.append((_CURVE, _load(world, axis)))
    parts, y = [], 6
    for height, part in rows:
        parts.append(f'<g transform="translate(0,{y})">{part}</g>')
        y += height + 4
    parts += _ticks(axis, y)
    y += 14
    notes = "".join(_notes(world, axis, y))
    height = y + 16 * (len(world.notes) + 1) + 10
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}">'
        f'<style>{_STYLE}</style><rect width="100%" height="100%" fill="white"/>{"".join(parts)}{notes}</svg>\n'
    )


def _drive_rows(world: World, axis: _Axis) -> Iterator[str]:
    for number, role in enumerate(DRIVES):

        def look(sample: Sample, number: int = number) -> tuple[str, str]:
            state = sample.states[number]
            return ("?", "#ffffff") if state is None else (state.label, _STATE_COLOURS[state])

        points = [(sample.time, look(sample)) for sample in world.samples]
        yield _label(str(role)) + _bars(points, axis)


def _node_rows(world: World, axis: _Axis) -> Iterator[str]:
    for node in world.network.nodes:
        beats = [
            frame for frame in world.frames if frame.arbitration_id == Service.HEARTBEAT + node.node_id and frame.data
        ]
        points = [(frame.timestamp, _NMT.get(frame.data[0] & NMT_STATE, ("?", "#ffffff"))) for frame in beats]
        yield _label(f"NMT {node.node_id}") + _bars(points, axis) + "".join(_emergencies(world, node.node_id, axis))


def _emergencies(world: World, node_id: int, axis: _Axis) -> Iterator[str]:
    for frame in world.frames:
        if frame.arbitration_id == Service.EMERGENCY + node_id and len(frame.data) == 8:
            x, code = axis.x(frame.timestamp), struct.unpack_from("<H", frame.data)[0]
            yield f'<path d="M{x} 2l5 16h-10z" fill="{_EMERGENCY_COLOUR}"/>' + _text(x + 6, 14, f"{code:04X}h", "s")


def _fault_rows(world: World, axis: _Axis) -> Iterator[str]:
    for injected in world.injected:
        begin, end = axis.x(injected.begin), axis.x(injected.end)
        bar = f'<rect x="{begin}" y="3" width="{max(end - begin, 2):.1f}" height="16" fill="{_FAULT_COLOUR}"/>'
        yield _label("fault") + bar + _text(begin + 4, 15, str(injected.fault), "s")


def _bars(points: Sequence[tuple[float, tuple[str, str]]], axis: _Axis) -> str:
    parts = []
    changes = [point for k, point in enumerate(points) if k == 0 or point[1] != points[k - 1][1]]
    for (begin, (name, colour)), (end, _) in pairwise([*changes, (axis.end, ("", ""))]):
        x, width = axis.x(begin), axis.x(end) - axis.x(begin)
        parts.append(f'<rect x="{x}" y="3" width="{max(width, 0.5):.1f}" height="16" fill="{colour}"/>')
        if width > _NAMES_FROM:
            parts.append(_text(x + 4, 15, name, "s"))
    return "".join(parts)


def _speed(world: World, axis: _Axis) -> str:
    return _curve([(sample.time, sample.speed) for sample in world.samples], axis, "speed", lambda v: f"{v:.2f} m/s")


def _load(world: World, axis: _Axis) -> str:
    bits: dict[int, int] = {}
    for frame in world.frames:
        window = int(frame.timestamp / _LOAD_WINDOW)
        bits[window] = bits.get(window, 0) + _bits(frame)
    capacity = world.network.bit_rate * _LOAD_WINDOW
    last = int(axis.end / _LOAD_WINDOW)
    points = [(window * _LOAD_WINDOW, bits.get(window, 0) / capacity) for window in range(last + 1)]
    return _curve(points, axis, "bus load", lambda v: f"{v:.0%}")


def _bits(frame: can.Message) -> int:
    if frame.is_error_frame:
        return ERROR_FRAME_BITS
    return frame_bits(frame.arbitration_id, bytes(frame.data), frame.is_extended_id, frame.is_remote_frame, frame.dlc)


def _curve(points: Sequence[tuple[float, float]], axis: _Axis, name: str, show: Callable[[float], str]) -> str:
    top = max((value for _, value in points), default=0.0)
    scale = (_CURVE - 20) / max(top, 1e-3)
    path = " ".join(f"{axis.x(time)},{_CURVE - 8 - value * scale:.1f}" for time, value in points)
    frame = f'<rect x="{_LEFT}" y="6" width="{_WIDTH - _LEFT - _RIGHT}" height="{_CURVE - 14}" fill="#fafafa"/>'
    line = f'<polyline points="{path}" fill="none" stroke="#2c5f8a" stroke-width="1.2"/>'
    return frame + line + _label(name) + _text(8, 30, f"max {show(top)}", "s")


def _ticks(axis: _Axis, y: int) -> Iterator[str]:
    """Marks at round instants, down through all rows."""
    power = 10.0 ** math.floor(math.log10((axis.end - axis.begin) / _TICKS))
    step = next(power * factor for factor in (1, 2, 5, 10) if (axis.end - axis.begin) / (power * factor) <= _TICKS)
    for k in range(math.floor(axis.begin / step), math.floor(axis.end / step + 1e-9) + 1):
        x = axis.x(k * step)
        yield f'<line x1="{x}" x2="{x}" y1="28" y2="{y - 4}" stroke="#000" stroke-opacity="0.12"/>'
        yield f'<text x="{x}" y="{y + 8}" class="s" text-anchor="middle">{k * step:g} s</text>'


def _notes(world: World, axis: _Axis, y: int) -> Iterator[str]:
    yield _text(8, y + 12, f"{axis.end:.3f} s of simulated time", "s")
    for number, note in enumerate(world.notes, start=1):
        colour = _FAILED_COLOUR if note.text.startswith("FAILED") else _NOTE_COLOUR
        x, baseline = axis.x(note.time), y + 12 + 16 * number
        yield f'<line x1="{x}" x2="{x}" y1="28" y2="{baseline - 10}" stroke="{colour}" stroke-dasharray="3,3"/>'
        anchor = "end" if x > _WIDTH / 2 else "start"
        words = escape(f"{note.time:.3f} s: {note.text}")
        yield f'<text x="{x}" y="{baseline}" class="s" text-anchor="{anchor}" style="fill:{colour}">{words}</text>'


def _label(text: str) -> str:
    return _text(8, 15, text)


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    return f'<text x="{x}" y="{y}" class="{kind}">{escape(text)}</text>'
