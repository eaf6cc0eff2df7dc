"""What else was considered, and how far behind it is: bars of log odds in the place of each cause."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.dependence import Partner, law_name
from ident.report.digits import percent, plain, significant
from ident.report.headline import place_words
from ident.report.law_text import VARIABLES, law_kind

MOST: Final = 6
"""Bars of one chart."""

HIDDEN: Final = 0.0005
"""Probability below which a number says nothing."""

ODDS: Final = "log odds"
PROBABILITY: Final = "probability"
"""What the length of bars says."""

_PLAIN: Final = MappingProxyType(
    {law_name(variable, partner): law_kind(partner, variable) for variable in VARIABLES for partner in Partner}
)
"""Laws of the own motion of a place in words, by the names that they have as effects."""

NOTHING: Final = "nothing"
OTHERS: Final = "all others together"


class Standing(StrEnum):
    """Of a contender: the one taken, one that these records do not tell from it, or another."""

    TAKEN = "taken"
    SAME = "same"
    OTHER = "other"


@dataclass(frozen=True)
class Bar:
    """A contender.

    Attributes:
        name: in words, with its place.
        standing: beside the one taken.
        value: log odds or probability.
        length: of the bar, as a share of the chart's width.
        text: of the value.
        probability: in words; empty where there is none.
    """

    name: str
    standing: Standing
    value: float
    length: float
    text: str
    probability: str = ""


@dataclass(frozen=True)
class Chart:
    """Bars, the longest first.

    Attributes:
        title: what they compete for.
        unit: ODDS or PROBABILITY.
        bars: at least one.
        clear: what they come to, in words; empty where there is nothing to say.
    """

    title: str
    unit: str
    bars: tuple[Bar, ...]
    clear: str


def rival_charts(findings: Findings) -> list[Chart]:
    """What competes with each cause, then what was not believed."""
    charts = [*(_in_the_place_of(cause, findings) for cause in findings.causes), _doubtful(findings)]
    return [chart for chart in charts if chart is not None]


def _in_the_place_of(cause: Cause, findings: Findings) -> Chart | None:
    taken, laws = cause.candidate.key, _laws(findings)
    same = frozenset(cause.ranked.alike) - {taken}
    values = {key: value for key, value in cause.ranked.log_odds.items() if math.isfinite(value)}
    ordered = sorted(values.items(), key=lambda entry: -entry[1])[:MOST]
    if not ordered:
        return None
    largest = max(ordered[0][1], 1.0)
    bars = tuple(
        Bar(
            name=_name(key, laws),
            standing=_standing(key, taken, same),
            value=value,
            length=max(value, 0.0) / largest,
            text=significant(value, 3),
            probability=_probability(key, cause, same),
        )
        for key, value in ordered
    )
    return Chart(f"In the place of {_name(taken, laws)}", ODDS, bars, _lead(bars))


def _standing(key: str, taken: str, same: frozenset[str]) -> Standing:
    if key == taken:
        return Standing.TAKEN
    return Standing.SAME if key in same else Standing.OTHER


def _probability(key: str, cause: Cause, same: frozenset[str]) -> str:
    if key == cause.candidate.key:
        # Of this place, where others have its name as well.
        here = sum(cause.ranked.probabilities.get(one, 0.0) for one in cause.ranked.alike)
        return percent(min(cause.probability, here))
    if key in same:
        return "the same in these records"
    probability = cause.ranked.probabilities.get(key)
    return "" if probability is None else _small(probability)


def _small(probability: float) -> str:
    return percent(probability) if probability >= HIDDEN else f"below {percent(HIDDEN)}"


def _lead(bars: Sequence[Bar]) -> str:
    """Of the one taken over the best that is not the same."""
    taken = next((bar.value for bar in bars if bar.standing is Standing.TAKEN), None)
    best = max((bar.value for bar in bars if bar.standing is Standing.OTHER), default=None)
    if taken is None or best is None:
        return ""
    where = "ahead of" if taken >= best else "behind"
    return f"{significant(abs(taken - best), 3)} {where} the best that can be told from it"


def _doubtful(findings: Findings) -> Chart | None:
    """By probability; with nothing at all and what is not listed they make one."""
    found = findings.doubtful
    if not found:
        return None
    listed = dict(list(found.items())[: MOST - 2])
    rest = sum(found.values()) - sum(listed.values())
    shares = {NOTHING: max(1 - sum(found.values()), 0.0)} | listed | ({OTHERS: rest} if rest > HIDDEN else {})
    laws = _laws(findings)
    bars = tuple(
        Bar(_name(key, laws), Standing.TAKEN if key == NOTHING else Standing.OTHER, value, value, _small(value))
        for key, value in sorted(shares.items(), key=lambda entry: -entry[1])
    )
    title = "Beside the causes" if findings.causes else "In the place of nothing"
    said = "not believed: not likely enough"
    return Chart(title, PROBABILITY, bars, said)


def _laws(findings: Findings) -> Mapping[str, str]:
    """Laws in words, without their places, by key."""
    return {one.key: law_kind(one.partner, one.variable, one.of) for one in findings.problem.dependences}


def _name(key: str, laws: Mapping[str, str]) -> str:
    name, at, where = key.partition("@")
    words = laws.get(key) or _PLAIN.get(name) or plain(name)
    return f"{words}, {place_words(where)}" if at else name
