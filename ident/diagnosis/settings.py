"""Thresholds of the search."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Thresholds of the search.

    Attributes:
        level: largest probability by chance, over all candidates at once, at which an effect is believed.
        pair_level: the same over all pairs.
        least: smallest log evidence of an effect alone, price paid: noise is never quite what surrogates make of it.
        beside: the same of one of several, for what their columns miss is no noise at all.
        confirmation: smallest log Bayes factor of the confirming rows.
        part: of what a cause does, that the fitted rows must show, and the confirming ones.
        plain: likelihood ratio of such a part from which it counts however small it is beside the other one.
        clear: log evidence from which what only one of the two shows is taken for an event, not for a cause in doubt.
        stretch: rows of the stretches whose sign a surrogate flips, well beyond the memory of whitened rows.
        stretches: that there shall be at least; short records have shorter ones.
        surrogates: how many.
        most: effects named at most.
        lead: log evidence by which another candidate must beat one already taken to replace it.
    """

    level: float = 0.02
    pair_level: float = 0.01
    least: float = 2.0
    beside: float = 2.5
    confirmation: float = 0.0
    part: float = 0.01
    plain: float = 100.0
    clear: float = 8.0
    stretch: int = 30
    stretches: int = 24
    surrogates: int = 600
    most: int = 4
    lead: float = 0.5
