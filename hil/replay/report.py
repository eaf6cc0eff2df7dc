"""A replay in words, as numbers, and as a page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from plotly import offline

from hil.replay.comparing import Track
from hil.replay.events import Event
from hil.replay.figures import timeline_figure, track_figure
from hil.replay.playing import part_at
from hil.replay.replaying import ReplayAnswer
from ident.report.page import render, script_json
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.replay/1"
MOST_LINES: Final = 12
"""Tracks, and events, that the terminal shows."""
MOST_FIGURES: Final = 8


def headline(answer: ReplayAnswer) -> str:
    """What came of it, in one sentence."""
    compared = answer.compared
    logs = f"{answer.logs} log" + ("s" if answer.logs > 1 else "")
    if compared.identical:
        return f"All {compared.answers} recorded answers in {logs} agree bit by bit."
    if compared.agrees:
        beyond = "" if answer.emulations == 1 else f", beyond what {answer.emulations} emulations differ by"
        return f"No difference between {compared.answers} recorded answers in {logs} and the emulated ones{beyond}."
    return f"Recorded and emulated answers differ, first {_first(answer)}."


def _first(answer: ReplayAnswer) -> str:
    tracks, events = answer.compared.ranked(), answer.compared.events
    if tracks and not (events and events[0].time < _begin(tracks[0])):
        where = f"{tracks[0].node.role}, {tracks[0].label}"
        return f"at {when(answer, _begin(tracks[0]))}: {where}"
    return f"at {when(answer, events[0].time)}: {events[0].node.role}, {events[0].answer}"


def _begin(track: Track) -> float:
    return float(track.time[track.differing[0]])


def when(answer: ReplayAnswer, time: float) -> str:
    """An instant on the axis of the replay in words: when [s], and where in which log."""
    mark, inside = part_at(answer.marks, time)
    return f"t = {time:.3f} s" + (f" ({mark.name}, {inside:.3f} s)" if len(answer.marks) > 1 else "")


def summary_lines(answer: ReplayAnswer) -> list[str]:
    """The whole, then what began to differ, in the order in which it did."""
    compared = answer.compared
    lines = [headline(answer), f"Emulated: {answer.vehicle}; {_pace(answer)}.", *answer.notes]
    if not compared.identical:
        lines.append(f"{compared.equal} of {compared.answers} answers agree bit by bit.")
    ranked = compared.ranked()
    lines += [f"  {_line(answer, track)}" for track in ranked[:MOST_LINES]]
    lines += _more(len(ranked), "objects")
    lines += [f"  {event_line(answer, event)}" for event in compared.events[:MOST_LINES]]
    return [*lines, *_more(len(compared.events), "messages")]


def _more(count: int, what: str) -> Iterator[str]:
    if count > MOST_LINES:
        yield f"  and {count - MOST_LINES} more {what}."


def _pace(answer: ReplayAnswer) -> str:
    return "its SYNCs moved time as they did then" if answer.in_step else "SYNCs on the grid of the cycle, by stamps"


def _line(answer: ReplayAnswer, track: Track) -> str:
    first, largest = track.differing[0], track.largest
    text = f"{track.node.role}, {track.label}: from {when(answer, float(track.time[first]))}"
    text += f", recorded {track.text(int(track.recorded[first]))}, emulated {track.text(int(track.emulated[first]))}"
    if track.is_bits:
        return f"{text}; {len(track.differing)} of {len(track.time)} samples differ"
    most = abs(track.difference[largest] * track.unit[0])
    return f"{text}; at most {most:.3g} {track.unit[1]} apart, at {when(answer, float(track.time[largest]))}"


def event_line(answer: ReplayAnswer, event: Event) -> str:
    """A message that differs, in words."""
    recorded, emulated = (
        f"{side} {data.hex(' ') if at is not None else 'nothing'}"
        for side, at, data in (
            ("recorded", event.recorded_at, event.recorded),
            ("emulated", event.emulated_at, event.emulated),
        )
    )
    return f"{event.node.role}, {event.answer}: {when(answer, event.time)}, {recorded}, {emulated}"


def as_json(answer: ReplayAnswer) -> dict[str, Any]:
    """All that was found, times on the axis of the replay [s]."""
    compared = answer.compared
    return {
        "schema": SCHEMA,
        "source": answer.source,
        "emulated": answer.vehicle,
        "emulations": answer.emulations,
        "in_step": answer.in_step,
        "notes": list(answer.notes),
        "logs": [{"name": mark.name, "time": mark.time, "stamp": mark.stamp} for mark in answer.marks],
        "frames_played": answer.others,
        "answers": compared.answers,
        "equal": compared.equal,
        "latest": compared.latest,
        "identical": compared.identical,
        "agrees": compared.agrees,
        "objects": [_track_json(track) for track in compared.tracks],
        "messages": [_event_json(event) for event in compared.events],
    }


def _track_json(track: Track) -> dict[str, Any]:
    return {
        "node": str(track.node.role),
        "node_id": track.node.node_id,
        "index": track.item.index,
        "subindex": track.item.subindex,
        "name": track.item.name,
        "unit": track.unit[1],
        "per_count": track.unit[0],
        "samples": len(track.time),
        "differing": len(track.differing),
        "first": _at(track, int(track.differing[0])) if len(track.differing) else None,
        "largest": _at(track, track.largest),
    }


def _at(track: Track, row: int) -> dict[str, Any]:
    return {
        "time": float(track.time[row]),
        "recorded": int(track.recorded[row]),
        "emulated": int(track.emulated[row]),
        "tolerance": float(track.tolerance[row]),
    }


def _event_json(event: Event) -> dict[str, Any]:
    return {
        "node": str(event.node.role),
        "node_id": event.node.node_id,
        "kind": str(event.answer),
        "recorded_at": event.recorded_at,
        "emulated_at": event.emulated_at,
        "recorded": event.recorded.hex(),
        "emulated": event.emulated.hex(),
    }


def write_json(answer: ReplayAnswer, path: Path) -> None:
    """Write the numbers, whole or not at all.

    Raises:
        UserError: they cannot be written.
    """
    write_whole(json.dumps(as_json(answer), indent=2, allow_nan=False) + "\n", path)


def write_page(answer: ReplayAnswer, path: Path) -> None:
    """Write the page, whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(render_page(answer), path)


def render_page(answer: ReplayAnswer) -> str:
    """The page as a string; scripts, styles and data inline, nothing is loaded from anywhere."""
    compared = answer.compared
    ranked = compared.ranked()
    shown = ranked[:MOST_FIGURES]
    figures = {f"track-{k}": track_figure(track) for k, track in enumerate(shown)}
    if not compared.agrees:
        figures["timeline"] = timeline_figure(compared, answer.marks)
    return render(
        "replay.html.j2",
        answer=answer,
        compared=compared,
        headline=headline(answer),
        pace=_pace(answer),
        rows=[(track, _begin(track), when(answer, _begin(track))) for track in ranked],
        events=[(event, event_line(answer, event)) for event in compared.events[:MOST_EVENTS]],
        hidden=max(len(compared.events) - MOST_EVENTS, 0),
        tracks=[(f"track-{k}", track) for k, track in enumerate(shown)],
        figures=script_json(figures),
        plotly=Markup(offline.get_plotlyjs()),
    )


MOST_EVENTS: Final = 200
"""Messages that the page lists."""
