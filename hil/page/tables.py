"""What is said in words and numbers, as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape

from hil.page.scene import COLOURS
from hil.page.shown import DriveNow, EncoderNow, Health, Sketch, Snapshot

_STYLE = (
    "<style>.qo{font-size:11px;width:100%;border-collapse:collapse;font-variant-numeric:tabular-nums}"
    ".qo td,.qo th{padding:2px 3px;text-align:right;white-space:nowrap;border-bottom:1px solid #e3e6e9}"
    ".qo td:first-child,.qo th:first-child,.qo .l{text-align:left}.qo th{font-weight:500;color:#667}"
    ".qo .b{color:#fff;border-radius:3px;padding:0 5px}</style>"
)


def headline(snapshot: Snapshot, pace: float) -> str:
    """Simulated time, how fast it passes, and whether the emergency stop is pressed."""
    stopped = ' <span style="color:#c92a2a;font-weight:700">EMERGENCY STOP</span>' if snapshot.stopped else ""
    return (
        f'<div id="qo-headline" style="padding:4px 8px;font-variant-numeric:tabular-nums"><b>{snapshot.time:.1f} s</b> '
        f"simulated, {pace:.1f} × real time{stopped}</div>"
    )


def nodes(sketch: Sketch, snapshot: Snapshot) -> str:
    """The six nodes."""
    head = _row(("node", "NMT", "state", "603Fh", "Nm", "rad/s", "I²t"), "th")
    drives = "".join(
        _drive(f"{node} {name}", now) for (name, node), now in zip(sketch.drives, snapshot.drives, strict=True)
    )
    encoder_head = _row(("", "", "NMT", "", "deg", "error mdeg", ""), "th")
    encoders = "".join(
        _encoder(f"{node} {name}", now) for (name, node), now in zip(sketch.encoders, snapshot.encoders, strict=True)
    )
    modes = ", ".join(sorted({drive.mode for drive in snapshot.drives}))
    return (
        f'{_STYLE}<div id="qo-nodes" style="padding:0 8px"><table class="qo">{head}{drives}{encoder_head}{encoders}'
        f'</table><div style="font-size:11px;color:#667">Mode: {escape(modes)}.</div></div>'
    )


def bus(snapshot: Snapshot, load: tuple[float, float], bit_rate: float) -> str:
    """Load of the bus, who is on it, who has lost frames, and how the loop keeps up."""
    least, most = (100 * share for share in load)
    share = f"{least:.1f} %" if round(least, 1) == round(most, 1) else f"{least:.1f} to {most:.1f} % by stuff bits"
    lines = [f"Load <b>{share}</b> of {bit_rate / 1e3:g} kbit/s; {snapshot.bus.frames} frames."]
    cycles = snapshot.cycles
    if cycles is not None:
        late = f"{cycles.overruns} late by more than a cycle"
        worst = f", worst {1e3 * cycles.worst:.1f} ms" if cycles.overruns else ""
        lines.append(f"{cycles.served} SYNCs; {late}{worst}.")
    clients = snapshot.bus.clients
    rows = "".join(
        _row((escape(f"{one.program} ({one.pid})"), one.waiting, _lost(one.dropped), "has left" if one.gone else ""))
        for one in clients
    )
    table = f'<table class="qo">{_row(("listener", "waiting", "lost", ""), "th")}{rows}</table>' if clients else ""
    return f'<div id="qo-bus" style="padding:0 8px;font-size:12px">{"<br>".join(lines)}{table}</div>'


def step(snapshot: Snapshot, finished: Iterable[str]) -> str:
    """The step that is driven, and those before it."""
    doing = snapshot.doing
    done = ", ".join(map(escape, finished))
    before = f"<br>Finished: {done}." if done else ""
    progress = f"<b>{escape(doing.step)}</b>: {doing.done} of {doing.total} {doing.unit}"
    now = progress if doing.step else "Between two steps"
    return f'<div id="qo-step" style="padding:0 8px;font-size:12px">{now}.{before}</div>'


def faults(snapshot: Snapshot) -> str:
    """The faults that last."""
    rows = "".join(
        _row((one.number, f'<span class="l">{escape(one.text)}</span>', "" if one.begun else "to come"))
        for one in snapshot.faults
    )
    table = f'<table class="qo">{rows}</table>' if rows else "None."
    return f'<div id="qo-faults" style="padding:0 8px;font-size:12px">{table}</div>'


def legend(normal: float, drive: float) -> str:
    """What the arrows stand for."""
    return (
        '<div style="padding:0 8px;font-size:11px;color:#667"><span style="color:#286ec8">■</span> normal force of the '
        f'floor, 1 m = {_force(normal)}; <span style="color:#e66e0a">■</span> drive force (torque × ratio / radius), '
        f'1 m = {_force(drive)}; <span style="color:#1e8c5a">■</span> path. Grid 0.5 m.</div>'
    )


def _drive(name: str, now: DriveNow) -> str:
    fault = f"{now.error_code:04X}h" if now.error_code else "–"
    return _row(
        (
            name,
            escape(now.nmt),
            _badge(now.state, now.health),
            fault,
            f"{now.torque:+.2f}",
            f"{now.speed:+.2f}",
            f"{100 * now.thermal_load:.0f} %",
        )
    )


def _encoder(name: str, now: EncoderNow) -> str:
    error = "–" if math.isnan(now.error) else f"{1e3 * math.degrees(now.error):+.1f}"
    return _row((name, "", _badge(now.nmt, now.health), "", f"{math.degrees(now.angle):+.3f}", error, ""))


def _badge(text: str, health: Health) -> str:
    return f'<span class="b" style="background:{COLOURS[health]}">{escape(text)}</span>'


def _lost(frames: int) -> str:
    return f'<span style="color:#c92a2a;font-weight:700">{frames}</span>' if frames else "0"


def _force(newton: float) -> str:
    return f"{newton / 1e3:.1f} kN"


def _row(cells: Iterable[object], kind: str = "td") -> str:
    return "<tr>" + "".join(f"<{kind}>{cell}</{kind}>" for cell in cells) + "</tr>"
