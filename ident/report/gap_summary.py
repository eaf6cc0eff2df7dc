"""A diagnosis in ten lines, for someone who has been at it all day."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.diagnosis import Diagnosis, NamedEffect, Share, Verdict
from ident.diagnosis.names import LAW
from ident.diagnosis.vehicle.unseen import LANE_CHANGE, REPEATED
from ident.report.digits import percent, plain, quantity_text, significant
from ident.report.headline import headline
from ident.report.law_text import law_line
from ident.vehicle.quantities import Quantity

MOST_LINES: Final = 10

NAMELESS: Final = "something without a name"

_BESIDE: Final = "record beside it what else moves, as the other joints of an arm, or another motion (--confirm)"

_UNSEEN: Final = {REPEATED: "Held-out steps, times the noise", LANE_CHANGE: "Lane change, times the noise"}


def summary_lines(findings: Findings, diagnosis: Diagnosis) -> list[str]:
    """At most ten lines: verdict, causes, gap, where, what cannot be seen, what to do."""
    lines = [gap_line(findings, diagnosis)]
    lines += unseen_lines(diagnosis)
    place = largest_share(diagnosis)
    if place is not None and diagnosis.verdict is not Verdict.NONE:
        lines.append(f"Where: {percent(place.share)} of it in {place_text(place)}.")
    if diagnosis.verdict is Verdict.UNKNOWN and findings.causes:
        lines.append(f"Nearest, but not it: {', '.join(cause.candidate.key for cause in findings.causes)}.")
    if diagnosis.invisible:
        lines.append(f"These records cannot show: {', '.join(diagnosis.invisible)}.")
    lines.append(f"Next: {next_text(diagnosis)}")
    causes = _shortened([cause_line(effect) for effect in diagnosis.effects], MOST_LINES - 1 - len(lines))
    return [headline(diagnosis), *causes, *lines]


def _shortened(causes: Sequence[str], room: int) -> list[str]:
    """The first of them, and how many more there are where room lacks."""
    if len(causes) <= room:
        return list(causes)
    shown = room - 1
    return [*causes[:shown], f"  and {len(causes) - shown} more (--report FILE shows them)"]


def cause_line(effect: NamedEffect) -> str:
    """A cause with its probability, its numbers and its rivals."""
    if effect.law is not None:
        return law_line(effect, effect.law)
    rivals = rivals_of(effect)
    rival = f"; might as well be {' or '.join(rivals)}" if rivals else ""
    closes, numbers = percent(effect.gap_closed_held_out), numbers_text(effect.parameters)
    return f"  {effect.probability:.0%} {effect.name}@{effect.where}: {numbers}; closes {closes} of the gap{rival}"


def numbers_text(quantities: Mapping[str, Quantity]) -> str:
    """The numbers of a cause, by name."""
    return ", ".join(f"{name} {quantity_text(one.value, one.std, one.unit)}" for name, one in quantities.items())


def rivals_of(effect: NamedEffect) -> list[str]:
    """What a cause might as well be, and where."""
    names = [NAMELESS if name == LAW else plain(name) for name in effect.ambiguity_set if name != effect.name]
    return [*names, *(f"at {where}" for where in effect.elsewhere)]


def gap_line(findings: Findings, diagnosis: Diagnosis) -> str:
    """The held-out gap in units of the noise."""
    gap = diagnosis.gap
    before = f"Gap on held-out data: {significant(gap.before)} times the noise"
    if diagnosis.verdict is Verdict.NONE:
        return f"{before}."
    rest = "; the rest has no name" if findings.lacking and diagnosis.verdict.explains else ""
    # Below its noise a gap is closed; by how much it is below is the noise's accident.
    closed = percent(min(gap.closed, 1.0))
    return f"{before}, {significant(gap.after)} with the causes in the model: {closed} of it closed{rest}."


def unseen_lines(diagnosis: Diagnosis) -> list[str]:
    """The gap of whole steps that took no part, by channel: a line for those that repeat, one for a lane change."""
    named = diagnosis.verdict.explains
    lines = []
    for steps, title in _UNSEEN.items():
        texts = [
            f"{one.channel} {significant(one.gap.before)}" + (f" to {significant(one.gap.after)}" if named else "")
            for one in diagnosis.unseen
            if one.steps == steps
        ]
        lines += [f"{title}: {', '.join(texts)}."] if texts else []
    return lines


def largest_share(diagnosis: Diagnosis) -> Share | None:
    """The step and coordinate in which most of the gap lies."""
    whole = [share for share in diagnosis.where if share.region == "all" and share.share > 0]
    return max(whole, key=lambda share: share.share) if whole else None


def place_text(share: Share) -> str:
    """Step and coordinate in words."""
    return f"{share.step}, {share.coordinate} ({share.channel})"


def next_text(diagnosis: Diagnosis) -> str:
    """What to do now."""
    if diagnosis.next_experiment:
        return diagnosis.next_experiment
    if any(effect.law is not None and effect.law.unrecorded is not None for effect in diagnosis.effects):
        return f"{_BESIDE}: within one record, time and what else moves are one."
    if diagnosis.verdict.explains:
        model = "put the causes into the model"
        written = f"{model} (--extended FILE writes it)" if diagnosis.unseen else model
        return f"{written}, and check it on another record."
    if diagnosis.verdict is Verdict.UNKNOWN:
        return "look at the map of the gap (--report), and drive other speeds and loads where it lies."
    return "use the model."
