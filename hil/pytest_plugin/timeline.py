"""A picture of what happened in a test, one SVG file: states of all nodes, emergencies, faults, speed, bus load.

Every label is inside the picture and over no other one. What there is no room for is shortened or counted, and is whole
in the text that a browser shows under the pointer.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import can

from hil.bus.bit_length import ERROR_FRAME_BITS, frame_bits
from hil.network import DRIVES, Node
from hil.network.cia import NMT_STATE, DriveState, NmtState, Service
from hil.pytest_plugin.drawing import (
    EDGE,
    LANE,
    LEFT,
    LINE,
    RIGHT,
    SMALL,
    WIDTH,
    Axis,
    Look,
    Row,
    arrow,
    bar,
    beside,
    document,
    heading,
    in_bar,
    label,
    legend,
    marks,
    small,
    spans,
    time_axis,
    upright,
)
from hil.pytest_plugin.labels import Shelves, printable, text_width, wrapped
from hil.pytest_plugin.world import Note, World

_BETWEEN, _CURVE = 5, 90
_LOAD_WINDOW: Final = 0.02
_COLUMNS: Final = WIDTH - LEFT - RIGHT
_MOST_EMERGENCIES, _MOST_FAULTS, _MOST_NOTES = 6, 30, 30
"""Rows of emergencies and of faults, and notes, at most; further ones are counted."""
_NOTE_LINES: Final = 4
_GAP: Final = 6.0

_DRIVE_LOOKS: Final = {
    DriveState.NOT_READY_TO_SWITCH_ON: Look("not ready to switch on", "#e8e8e8"),
    DriveState.SWITCH_ON_DISABLED: Look("switch on disabled", "#d8d8d8"),
    DriveState.READY_TO_SWITCH_ON: Look("ready to switch on", "#c5d6c5"),
    DriveState.SWITCHED_ON: Look("switched on", "#9cc29c"),
    DriveState.OPERATION_ENABLED: Look("operation enabled", "#5ba05b"),
    DriveState.QUICK_STOP_ACTIVE: Look("quick stop active", "#e6a23c"),
    DriveState.FAULT_REACTION_ACTIVE: Look("fault reaction active", "#d9734e"),
    DriveState.FAULT: Look("fault", "#c0392b"),
    None: Look("in no known state", "#f2f2f2"),
}
_NMT_LOOKS: Final[Mapping[NmtState | None, Look]] = {
    NmtState.BOOT_UP: Look("initialisation", "#8e7cc3"),
    NmtState.PRE_OPERATIONAL: Look("pre-operational", "#d3dfec"),
    NmtState.OPERATIONAL: Look("operational", "#7fa8d1"),
    NmtState.STOPPED: Look("stopped", "#d9734e"),
    None: Look("off the bus", "#6b6b6b"),
}
_BOOTED, _EMERGENCY, _FAULT = Look("boot-up", "#5b3fa8"), Look("emergency", "#c0392b"), Look("injected", "#b04a8f")
_LEGEND: Final = (*_NMT_LOOKS.values(), _BOOTED, *_DRIVE_LOOKS.values(), _EMERGENCY, _FAULT)
_NOTE_COLOUR, _FAILED_COLOUR, _FAILED = "#666666", "#c0392b", "FAILED"


def timeline(world: World, title: str) -> str:
    """The picture as SVG text.

    Args:
        world: what was recorded.
        title: above the picture.
    """
    axis = Axis(0.0, max(world.now, 0.01))
    head = heading(title, f"{axis.end:.3f} s of simulated time")
    rows = [row for number, node in enumerate(world.network.nodes) for row in _node_rows(world, number, node, axis)]
    rows += [*_emergency_rows(world, axis), *_fault_rows(world, axis), _speed(world, axis), _load(world, axis)]
    below = [time_axis(axis), *legend([look for look in _LEGEND if any(look in row.looks for row in rows)])]
    top, body = _height(head), _height(head) + _height(rows)
    behind = [upright(axis.x(instant), top, body) for instant in marks(axis)]
    notes: list[Row] = []
    for note in _chosen(world.notes):
        y = body + _height(below) + _height(notes)
        behind.append(upright(axis.x(note.time), top, y + LINE, _colour(note)))
        notes.append(_note_row(note, axis))
    if len(notes) < len(world.notes):
        notes.append(Row(LINE, small(LEFT, 11, f"and {len(world.notes) - len(notes)} more")))
    return document([*head, *rows, *below, *notes], behind)


def _height(rows: Sequence[Row]) -> int:
    return sum(row.height for row in rows)


def _node_rows(world: World, number: int, node: Node, axis: Axis) -> Iterator[Row]:
    """Lanes of a node: its NMT state, emergencies on it, and of a drive the state of CiA 402."""
    booted = [frame for frame in _said(world, Service.HEARTBEAT, node) if _is_boot_up(frame)]
    sent = [frame for frame in _said(world, Service.EMERGENCY, node) if len(frame.data) == 8]
    marked = [frame.timestamp for frame in (*booted, *sent)]
    points = [(sample.time, _NMT_LOOKS[sample.nmt[number]]) for sample in world.samples]
    states, looks = spans(points, axis, marked)
    states += "".join(bar(axis.x(frame.timestamp), 2.0, _BOOTED) for frame in booted)
    states += "".join(arrow(axis.x(frame.timestamp), _EMERGENCY, _code(frame)) for frame in sent)
    looks |= {look for look, there in ((_BOOTED, booted), (_EMERGENCY, sent)) if there}
    height = LANE if node.is_drive else LANE + _BETWEEN
    yield Row(height, label(str(node.role)) + _kind(f"NMT {node.node_id}") + states, looks)
    if node.is_drive:
        drive = DRIVES.index(node.role)
        states, looks = spans([(sample.time, _DRIVE_LOOKS[sample.states[drive]]) for sample in world.samples], axis)
        yield Row(LANE + _BETWEEN, _kind("CiA 402") + states, looks)


def _kind(of: str) -> str:
    return small(LEFT - 6, 12, of, anchor="end")


def _said(world: World, service: int, node: Node) -> list[can.Message]:
    """Messages of a service of a node."""
    can_id = service + node.node_id
    return [frame for frame in world.frames if frame.arbitration_id == can_id and not frame.is_error_frame]


def _is_boot_up(frame: can.Message) -> bool:
    return len(frame.data) == 1 and frame.data[0] & NMT_STATE == NmtState.BOOT_UP


def _code(frame: can.Message) -> str:
    return f"{struct.unpack_from('<H', frame.data)[0]:04X}h"


def _emergency_rows(world: World, axis: Axis) -> list[Row]:
    """Who sent which code, below the marks in the lanes of the nodes."""
    shelves = Shelves(_MOST_EMERGENCIES, _GAP)
    lines: list[str] = []
    left_out = 0
    sent = [
        (frame.timestamp, f"{node.role} {_code(frame)}")
        for node in world.network.nodes
        for frame in _said(world, Service.EMERGENCY, node)
        if len(frame.data) == 8
    ]
    for instant, words in sorted(sent):
        width = text_width(words, SMALL)
        x = min(axis.x(instant), WIDTH - EDGE - width)
        row = shelves.place(x, x + width)
        if row is None:
            left_out += 1
        else:
            lines += [""] * (row + 1 - len(lines))
            lines[row] += small(x, 11, words, _EMERGENCY.colour)
    return _shelf_rows("emergencies", lines, LINE, left_out)


def _fault_rows(world: World, axis: Axis) -> list[Row]:
    """Bars of faults that were injected, with their lines in or beside them."""
    shelves = Shelves(_MOST_FAULTS, _GAP)
    lines: list[str] = []
    left_out = 0
    for injected in world.injected:
        begin = axis.x(injected.begin)
        end = max(axis.x(injected.end), begin + 2.0)
        start, stop, words, inside = beside(begin, end, printable(str(injected.fault)))
        row = shelves.place(min(begin, start), max(end, stop))
        if row is None:
            left_out += 1
        else:
            lines += [""] * (row + 1 - len(lines))
            said = in_bar(start, words, _FAULT) if inside else small(start, 12, words)
            lines[row] += bar(begin, end - begin, _FAULT, str(injected.fault)) + said
    return _shelf_rows("faults", lines, LANE, left_out, frozenset({_FAULT} if lines else ()))


def _shelf_rows(
    name: str, lines: list[str], height: int, left_out: int, looks: frozenset[Look] = frozenset()
) -> list[Row]:
    if left_out:
        lines = [*lines, small(LEFT, 11, f"and {left_out} more")]
    rows = [Row(height, (label(name) if k == 0 else "") + line, looks) for k, line in enumerate(lines)]
    return [*rows, Row(_BETWEEN, "")] if rows else []


def _speed(world: World, axis: Axis) -> Row:
    return _curve([(sample.time, sample.speed) for sample in world.samples], axis, "speed", lambda v: f"{v:.2f} m/s")


def _load(world: World, axis: Axis) -> Row:
    """In windows of 20 ms; where they are more than the picture is wide, the fullest of neighbours."""
    bits: dict[int, int] = {}
    for frame in world.frames:
        window = int(frame.timestamp / _LOAD_WINDOW)
        bits[window] = bits.get(window, 0) + _bits(frame)
    windows = int(axis.end / _LOAD_WINDOW) + 1
    columns = min(windows, _COLUMNS)
    fullest = [0] * columns
    for window, count in bits.items():
        column = min(window * columns // windows, columns - 1)
        fullest[column] = max(fullest[column], count)
    capacity, width = world.network.bit_rate * _LOAD_WINDOW, windows / columns * _LOAD_WINDOW
    return _curve([(k * width, n / capacity) for k, n in enumerate(fullest)], axis, "bus load", lambda v: f"{v:.0%}")


def _bits(frame: can.Message) -> int:
    if frame.is_error_frame:
        return ERROR_FRAME_BITS
    return frame_bits(frame.arbitration_id, bytes(frame.data), frame.is_extended_id, frame.is_remote_frame, frame.dlc)


def _curve(points: Sequence[tuple[float, float]], axis: Axis, name: str, show: Callable[[float], str]) -> Row:
    top = max((value for _, value in points), default=0.0)
    scale = (_CURVE - 20) / max(top, 1e-3)
    path = " ".join(f"{axis.x(time)},{_CURVE - 8 - value * scale:.1f}" for time, value in points)
    size = f'x="{LEFT}" y="2" width="{WIDTH - LEFT - RIGHT}" height="{_CURVE - 8}"'
    frame = f'<rect {size} fill="#000" fill-opacity="0.03"/>'
    line = f'<polyline points="{path}" fill="none" stroke="#2c5f8a" stroke-width="1.2"/>'
    return Row(_CURVE, frame + line + label(name) + small(EDGE, 26, f"max {show(top)}"))


def _chosen(notes: Sequence[Note]) -> list[Note]:
    """As many as there is room for, in the order of time: what failed before what passed, the latest first."""
    ranked = sorted(notes, key=lambda note: (not _has_failed(note), -note.time))
    return sorted(ranked[:_MOST_NOTES], key=lambda note: note.time)


def _has_failed(note: Note) -> bool:
    return note.text.startswith(_FAILED)


def _colour(note: Note) -> str:
    return _FAILED_COLOUR if _has_failed(note) else _NOTE_COLOUR


def _note_row(note: Note, axis: Axis) -> Row:
    """Its lines behind the instant, or before it where there is no room behind, or across the picture."""
    lines = wrapped(printable(f"{note.time:.3f} s: {note.text}"), WIDTH - 2 * EDGE, SMALL, _NOTE_LINES)
    width = max(text_width(line, SMALL) for line in lines)
    behind, before = axis.x(note.time) + 3, axis.x(note.time) - 3
    if behind + width <= WIDTH - EDGE:
        x, anchor = behind, "start"
    else:
        x, anchor = (before, "end") if before - width >= EDGE else (EDGE, "start")
    texts = [small(x, 11 + LINE * k, line, _colour(note), anchor) for k, line in enumerate(lines)]
    return Row(LINE * len(lines) + 2, "".join(texts))
