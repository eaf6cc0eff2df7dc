"""A score for people: Markdown with tables, a reliability plot as SVG, and everything as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Final

from hil.exam.score_names import ASKED
from hil.exam.scoring import Score
from hil.exam.statistics import Bin, Rate

_EDGE: Final = 40
_WIDTH: Final = 300


def summary_lines(score: Score) -> list[str]:
    """One line a rate, for a terminal."""
    lines = [f"{name:<44} {rate}{_asked(name)}" for name, rate in score.rates.items()]
    lines.append(f"{'mean size of the set':<44} {score.set_size:.2f}")
    lines.append(f"{'calibration error':<44} {score.calibration:.3f}")
    lines.append(f"{'gap closed by right names, by wrong ones':<44} {score.closed_right:.2f}, {score.closed_wrong:.2f}")
    lines.append(f"{'processor time a diagnosis':<44} {score.seconds:.1f} s")
    return lines


def score_markdown(score: Score, title: str, extra: Mapping[str, Rate]) -> str:
    """The whole score; `extra` are rates of other runs on the same records."""
    parts = [f"# {title}", "", f"{score.cases} cases. Rates with Wilson's 95 % interval and counts.", ""]
    parts += ["| rate | measured | asked |", "|---|---|---|"]
    parts += [f"| {name} | {rate} | {ASKED.get(name, '')} |" for name, rate in {**score.rates, **extra}.items()]
    parts += [
        f"| mean size of the set | {score.set_size:.2f} | at most 2 |",
        f"| calibration error | {score.calibration:.3f} | at most 0.05 |",
        f"| gap closed by right names (median) | {score.closed_right:.2f} | at least 0.8 |",
        f"| gap closed by wrong names (median) | {score.closed_wrong:.2f} | below 0.2 |",
        f"| processor time of a diagnosis | {score.seconds:.1f} s | |",
        "",
        *_rates("size in noise units", score.by_size),
        *_rates("true effect", score.by_name),
        "## Confusion",
        "",
        *_confusion(score.confusion),
        "",
        "## Reliability",
        "",
        "| stated probability | right |",
        "|---|---|",
        *(f"| {each.stated:.2f} | {each.right} |" for each in score.bins),
    ]
    return "\n".join(parts) + "\n"


def score_json(score: Score, extra: Mapping[str, Rate]) -> str:
    """All numbers."""

    def plain(rates: Mapping[str, Rate]) -> dict[str, list[float]]:
        return {name: [rate.hits, rate.cases, rate.value, *rate.interval] for name, rate in rates.items() if rate.cases}

    content = {
        "rates": plain({**score.rates, **extra}),
        "by_size": plain(score.by_size),
        "by_name": plain(score.by_name),
        "set_size": score.set_size,
        "calibration_error": score.calibration,
        "gap_closed": {"right": score.closed_right, "wrong": score.closed_wrong},
        "confusion": [[true, said, count] for (true, said), count in sorted(score.confusion.items())],
        "bins": [[each.stated, each.right.hits, each.right.cases] for each in score.bins],
        "seconds": score.seconds,
        "cases": score.cases,
    }
    return json.dumps(content, indent=1) + "\n"


def reliability_svg(bins: Sequence[Bin]) -> str:
    """Share of right names over stated probability, with intervals, beside the diagonal."""

    def place(x: float, y: float) -> tuple[float, float]:
        return _EDGE + x * _WIDTH, _EDGE + (1 - y) * _WIDTH

    (x0, y0), (x1, y1) = place(0, 0), place(1, 1)
    size = _WIDTH + 2 * _EDGE
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size} {size}" font-family="sans-serif" font-size="12">',
        f'<rect x="{x0}" y="{y1}" width="{_WIDTH}" height="{_WIDTH}" fill="none" stroke="#888"/>',
        f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="#888" stroke-dasharray="4"/>',
        f'<text x="{size / 2}" y="{size - 8}" text-anchor="middle">stated probability, 0 to 1</text>',
        f'<text x="14" y="{size / 2}" text-anchor="middle" transform="rotate(-90 14 {size / 2})">right, 0 to 1</text>',
    ]
    for each in bins:
        low, high = each.right.interval
        x, y = place(each.stated, each.right.value)
        bottom, top = place(0, low)[1], place(0, high)[1]
        parts.append(f'<line x1="{x:.1f}" y1="{bottom:.1f}" x2="{x:.1f}" y2="{top:.1f}" stroke="#2266aa"/>')
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#2266aa"/>')
    return "\n".join([*parts, "</svg>", ""])


def _asked(name: str) -> str:
    return f"   asked {ASKED[name]}" if name in ASKED else ""


def _rates(what: str, rates: Mapping[str, Rate]) -> list[str]:
    lines = [f"## Top-1 or in the set, by {what}", "", f"| {what} | right |", "|---|---|"]
    return [*lines, *(f"| {name} | {rate} |" for name, rate in rates.items()), ""]


def _confusion(counts: Mapping[tuple[str, str], int]) -> list[str]:
    said = sorted({answer for _, answer in counts})
    lines = [f"| truth | {' | '.join(said)} |", "|---" * (len(said) + 1) + "|"]
    for true in sorted({true for true, _ in counts}):
        cells = (str(counts.get((true, answer), "")) for answer in said)
        lines.append(f"| {true} | {' | '.join(cells)} |")
    return lines
