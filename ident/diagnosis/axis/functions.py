"""Which effects are functions of one variable of the motion, of a vehicle and of axes."""

from __future__ import annotations

from ident.diagnosis.axis.model import OVER
from ident.diagnosis.dependence import Partner, Variable
from ident.effects import EFFECTS


def function_of(name: str) -> tuple[Variable, Partner] | None:
    """The variable, and what a function of it is multiplied with; None for an effect that is no such function."""
    over = EFFECTS[name].over if name in EFFECTS else None
    return OVER.get(name) if over is None else (Variable(over[0]), Partner(over[1]))
