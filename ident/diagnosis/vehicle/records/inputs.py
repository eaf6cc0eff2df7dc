"""What was measured, as the columns of one array and as the symbols that the rows are written in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.plant.symbolic import Expression
from ident.plant.symbols import SIDES
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

_SIZES: Final = {
    "heading": 1,
    "alpha": len(SIDES),
    "beta": len(WHEELS),
    "alpha_rate": len(SIDES),
    "beta_rate": len(WHEELS),
    "alpha_acceleration": len(SIDES),
    "beta_acceleration": len(WHEELS),
    "motor_acceleration": len(WHEELS),
    "torques": len(WHEELS),
    "twist": len(SIDES),
    "twist_rate": len(SIDES),
    "hammer": len(WHEELS),
    "swing": len(WHEELS),
    "rattle": len(WHEELS),
    "wander": len(SIDES),
    "rest": len(WHEELS),
    "bristles": len(SIDES) + len(WHEELS),
    "payload": 1,
}


_ENDS: Final = np.cumsum(list(_SIZES.values())).tolist()


SLICES: Final = {name: slice(end - size, end) for (name, size), end in zip(_SIZES.items(), _ENDS, strict=True)}
"""What was measured, as columns of one array; `twist` is that of the two steering couplings.

`beta` is what the encoder of a motor reads, at the wheel; its derivatives are those of the wheel once that is made to
roll as the others say, and `motor_acceleration` stays that of the motor.

Zero but where something is loose: `hammer` [-], `swing` and `rattle` [rad] where a motor rattles in its gear
(`ident.diagnosis.vehicle.records.rattling`), `wander` [rad] where it can be told how far a rear unit moves in its
coupling (`ident.diagnosis.vehicle.records.wandering`), `rest` [rad] where a motor moves whose wheel rests
(`ident.diagnosis.vehicle.records.resting`). `bristles` is what bristles of a model resist at steering axes and wheels
[Nm]; zero where it has none. `payload` is the mass of a known load [kg].
"""


INPUTS: Final = _ENDS[-1]
"""Number of those columns."""


def copied(inputs: Array) -> Array:
    """Signals (N, INPUTS) to be changed; every column stays in one piece of memory, as the equations read them."""
    return inputs.copy(order="K")


@dataclass(frozen=True)
class Inputs:
    """The symbols behind INPUTS."""

    all: Expression
    heading: Expression
    alpha: Expression
    beta: Expression
    alpha_rate: Expression
    beta_rate: Expression
    alpha_acceleration: Expression
    beta_acceleration: Expression
    motor_acceleration: Expression
    torques: Expression
    twist: Expression
    twist_rate: Expression
    hammer: Expression
    swing: Expression
    rattle: Expression
    wander: Expression
    rest: Expression
    bristles: Expression
    payload: Expression


def symbolic_inputs() -> Inputs:
    """New symbols, all of one vector."""
    z = ca.SX.sym("z", INPUTS)
    return Inputs(z, *(z[columns] for columns in SLICES.values()))
