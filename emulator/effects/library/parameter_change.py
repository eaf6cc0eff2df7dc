"""A vehicle with one of its eleven parameters changed."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.prototype import Prototype
from emulator.reparametrised import with_truth
from ident.errors import UserError
from ident.vehicle.parameters import PARAMETER_NAMES


def change_parameter(prototype: Prototype, symbol: str, change: float) -> Prototype:
    """The same vehicle with one of its eleven parameters multiplied by 1 + change.

    Raises:
        UserError: no body has that parameter.
    """
    truth = prototype.truth.replaced(**{symbol: prototype.truth[symbol] * (1 + change)})
    if min(truth.values) < 0:
        raise UserError(f"parameter_change@{symbol}: {symbol} would be negative.", "Give a change above -1.")
    return with_truth(prototype, truth, Path(f"parameter_change@{symbol}"))


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_prototype(change_parameter(injection.built.prototype, effect.where, effect["change"]))


INJECTOR: Final = Injector(
    name="parameter_change",
    places=PARAMETER_NAMES,
    units={"change": "1"},
    inject=_inject,
    signed=True,
    first=True,
)
