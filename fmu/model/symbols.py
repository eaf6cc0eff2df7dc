"""Symbols of the model by the names of the table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import casadi as ca

from fmu.variables import Variable
from ident.vehicle import symbolic
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.symbolic import Expression

_GEOMETRY: Final = ("wheelbase", "track_width", "wheel_offset", "wheel_radius", "gear_ratio")
"""In the order of `symbolic.GEOMETRY`."""


class Symbols:
    """A vector of symbols, one for each variable of a block."""

    def __init__(self, name: str, variables: Sequence[Variable]) -> None:
        self.vector: Expression = ca.SX.sym(name, len(variables))
        self._parts = dict(zip((row.name for row in variables), ca.vertsplit(self.vector), strict=True))

    def __getitem__(self, name: str) -> Expression:
        return self._parts[name]

    def stacked(self, *names: str) -> Expression:
        """Several of them, (n,)."""
        return ca.vertcat(*(self._parts[name] for name in names))

    def sides(self, name: str) -> Expression:
        """Those of left and right side, (2,); `{}` in the name stands for the side."""
        return self.stacked(*(name.format(side) for side in ("l", "r")))

    def wheels(self, name: str) -> Expression:
        """Those of the four wheels, (4,); `{}` in the name stands for the wheel."""
        return self.stacked(*(name.format(wheel) for wheel in WHEELS))


def dynamic_parameters(p: Symbols) -> Expression:
    """p of (18), (11,)."""
    return p.stacked(*PARAMETER_NAMES)


def bound(expression: Expression, p: Symbols) -> Expression:
    """An expression of `ident.vehicle`, its geometry and ε replaced by parameters of the table."""
    ours = [p.stacked(*_GEOMETRY), p["epsilon"]]
    return ca.cse(ca.substitute([expression], [symbolic.GEOMETRY, symbolic.EPSILON], ours)[0])
