"""Symbols of a model by their names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import casadi as ca

from ident.plant import symbolic
from ident.plant.symbolic import Expression
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES

SIDES: Final = ("l", "r")
"""Letters of the steering sides in names."""

_GEOMETRY: Final = ("wheelbase", "track_width", "wheel_offset", "wheel_radius", "gear_ratio")
"""In the order of `symbolic.GEOMETRY`."""


class Symbols:
    """A vector of symbols, one for each name."""

    def __init__(self, name: str, parts: Sequence[str]) -> None:
        self.vector: Expression = ca.SX.sym(name, len(parts))
        self._parts = dict(zip(parts, ca.vertsplit(self.vector), strict=True))

    def __getitem__(self, name: str) -> Expression:
        return self._parts[name]

    def __contains__(self, name: str) -> bool:
        return name in self._parts

    def stacked(self, *names: str) -> Expression:
        """Several of them, (n,)."""
        return ca.vertcat(*(self._parts[name] for name in names))

    def sides(self, name: str) -> Expression:
        """Those of left and right side, (2,); `{}` in the name stands for the side."""
        return self.stacked(*(name.format(side) for side in SIDES))

    def wheels(self, name: str) -> Expression:
        """Those of the four wheels, (4,); `{}` in the name stands for the wheel."""
        return self.stacked(*(name.format(wheel) for wheel in WHEELS))


def dynamic_parameters(p: Symbols) -> Expression:
    """p of (18), (11,)."""
    return p.stacked(*PARAMETER_NAMES)


def bound(expression: Expression, p: Symbols) -> Expression:
    """An expression, its geometry and ε replaced by parameters of those names."""
    ours = [p.stacked(*_GEOMETRY), p["epsilon"]]
    return ca.cse(ca.substitute([expression], [symbolic.GEOMETRY, symbolic.EPSILON], ours)[0])
