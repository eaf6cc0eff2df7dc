"""A law without a name, in words."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np

from ident.diagnosis.diagnosis import LawAnswer, NamedEffect
from ident.report.digits import percent, plain, range_text, unit_text, value_text

_FORCES: Final = MappingProxyType(
    {
        "": "a force that depends on {x}",
        "direction": "friction that depends on {x}",
        "rate": "viscous friction that depends on {x}",
        "acceleration": "inertia that depends on {x}",
        "rolling": "a rolling radius that depends on {x}",
    }
)

VARIABLES: Final = MappingProxyType(
    {
        "rate": "the speed",
        "angle": "the position",
        "load": "the load",
        "load_rate": "the rate of the load",
        "load_second_rate": "the second derivative of the load",
        "acceleration": "the acceleration",
        "time": "time",
        "temperature": "the temperature",
        "path_since_reversal": "the path since a reversal",
        "other_axis": "another axis",
    }
)


def law_words(law: LawAnswer) -> str:
    """What it is and how large, as part of a sentence."""
    other = f", or on {variable_name(law.unrecorded)} that is not recorded" if law.unrecorded is not None else ""
    return f"{law_kind(law.partner, law.variable, law.of)}, from {swing_text(law)}{other}"


def law_kind(partner: str, variable: str, of: str = "") -> str:
    """What a law is, without its size."""
    return _FORCES[partner].format(x=variable_name(variable, of))


def variable_text(law: LawAnswer) -> str:
    """What it depends on."""
    return variable_name(law.variable, law.of)


def variable_name(variable: str, of: str = "") -> str:
    """A variable in words, and whose it is where it is not the place's own."""
    text = VARIABLES[variable]
    return f"{text} ({plain(of)})" if of else text


def law_line(effect: NamedEffect, law: LawAnswer) -> str:
    """A law as a line under the verdict: how large, as what formula, what it closes, what else it may be."""
    _, y, std = law.curve.T
    formula = f", {law.formula} [{unit_text(law.unit_y)}] of x = {variable_text(law)}" if law.formula else ""
    sure = f" (± {value_text(float(np.median(std)), law.unit_y, beside=float(np.abs(y).max()))})"
    others = ", ".join(f"{other.variable or other.name}@{other.where}" for other in effect.alternatives)
    other = f"; might as well be {others}" if others else ""
    near = "" if law.nearest is None else f"; nearest name {law.nearest}, which misses {percent(law.distance or 0.0)}"
    closes = percent(effect.gap_closed_held_out)
    head = f"  {effect.probability:.0%} law@{effect.where}: from {swing_text(law)}{sure} over {variable_text(law)}"
    return f"{head}{formula}; closes {closes} of the gap{other}{near}"


def swing_text(law: LawAnswer, count: int = 3) -> str:
    """From where to where its curve goes, of `count` significant digits."""
    y = law.curve[:, 1]
    return range_text(float(y.min()), float(y.max()), law.unit_y, count)
