"""The library of causes: how each effect becomes linear in a few numbers, and which of its parameters are tried."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from types import MappingProxyType
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName, places_of
from ident.diagnosis.problem import Periodic
from ident.diagnosis.vehicle.records.rows import UnitTerm
from ident.effects import EFFECTS, EffectParameter, effect_term
from ident.effects.base import Sign
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """How the equations depend on an effect's parameters.

    Attributes:
        linear: parameters in which the rows are linear near zero.
        angle: of the first of them, where the pair is a size and a direction or phase; two columns then.
        simple: whether the angle zero is tried alone too, with one column: the other may show next to nothing.
        tried: values of nonlinear parameters.
        curved: whether the rows are not linear far from zero.
    """

    linear: tuple[str, ...]
    angle: str | None = None
    simple: bool = False
    tried: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    curved: bool = False

    @property
    def is_linear(self) -> bool:
        """Whether the columns are all there is."""
        return self.angle is None and not self.tried and not self.curved


SHAPES: Final[Mapping[EffectName, Shape]] = MappingProxyType(
    {
        EffectName.STRIBECK: Shape(("amplitude",), tried={"velocity": (0.05, 0.1, 0.2, 0.4, 0.8)}),
        EffectName.ASYMMETRIC_COULOMB: Shape(("imbalance",)),
        EffectName.ASYMMETRIC_VISCOUS: Shape(("imbalance",)),
        EffectName.QUADRATIC_DRAG: Shape(("coefficient",)),
        EffectName.FRICTION_POSITION: Shape(("slope",)),
        EffectName.FRICTION_LOAD: Shape(("share",)),
        EffectName.SLOPE: Shape(("angle",), angle="direction", simple=True),
        EffectName.COM_OFFSET: Shape(("x", "y"), curved=True),
        EffectName.PAYLOAD: Shape(("mass", "inertia")),
        EffectName.TORQUE_GAIN: Shape(("error",)),
        EffectName.TORQUE_BIAS: Shape(("bias",)),
        EffectName.TORQUE_RIPPLE: Shape(("amplitude",), angle="phase", tried={"order": (1.0,)}),
        EffectName.WHEEL_RADIUS: Shape(("error",)),
        EffectName.WHEEL_ECCENTRICITY: Shape(("amplitude",), angle="phase", tried={"warp": (0.0, 0.5)}),
        EffectName.STEERING_OFFSET: Shape(("offset",)),
        EffectName.SCRUB: Shape(("torque",)),
        EffectName.STEERING_UNIT_MASS: Shape(("mass",)),
        EffectName.PARAMETER_CHANGE: Shape(("change",)),
    }
)
"""Effects that are terms of the equations."""

DRIFTS: Final = (EffectName.PARAMETER_CHANGE, EffectName.PAYLOAD)
"""Effects that a refit of the parameters absorbs: causes only where the model's values are given."""

ONE_SIDED: Final = frozenset(EffectName(name) for name, kind in EFFECTS.items() if kind.sign is Sign.NOT_NEGATIVE)
"""Effects whose size cannot be negative."""

POSITIVE: Final = ONE_SIDED | {EffectName.PAYLOAD}
"""Effects that stand for no change in the other direction: nobody takes off a load that is not there."""


def ripple_over(where: str, geometry: Geometry) -> Periodic:
    """A ripple of a drive as a wave over the angle of its wheel, of any order.

    Its wave is in the torque of the drive, which stands on the other side of the rows than what resists at the wheel.
    """
    ratio = geometry.gear_ratio

    def start(order: float) -> Callable[[Array], Array]:
        def values(found: Array) -> Array:
            return np.array([np.hypot(*found) / ratio, order / ratio, np.arctan2(-found[1], -found[0])])

        return values

    joint = "wheels" if where == "drives" else f"wheel_{where.removeprefix('drive_')}"
    return Periodic(f"law_angle_motor@{joint}", start)


@dataclass(frozen=True)
class UnitVariant:
    """One choice of an effect's nonlinear parameters.

    Attributes:
        units: one a column.
        start: coefficients of the columns -> values of all parameters, in the order of the effect's.
        bent: whether the rows depend on more than the columns show.
    """

    units: tuple[UnitTerm, ...]
    start: Callable[[Array], Array]
    bent: bool = True


@dataclass(frozen=True)
class TermCause:
    """An effect of SHAPES at a place.

    Attributes:
        name, where: which.
        variants: at least one.
    """

    name: EffectName
    where: str
    variants: tuple[UnitVariant, ...]

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """As listed in the table of effects, with the units of this place."""
        return placed_parameters(self.name, self.where)

    @property
    def units(self) -> tuple[UnitTerm, ...]:
        """Of all variants, in their order."""
        return tuple(unit for variant in self.variants for unit in variant.units)


def placed_parameters(name: EffectName, where: str) -> tuple[EffectParameter, ...]:
    """Parameters of an effect, with the units that they have at a place."""
    spec = EFFECTS[name]
    return tuple(replace(entry, unit=spec.unit(entry.name, where)) for entry in spec.parameters)


def term_causes(names: Sequence[EffectName]) -> list[TermCause]:
    """All places of the effects named that are terms."""
    return [cause for name in names for cause in _term_causes_of(EffectName(name))]


@cache
def every_unit() -> tuple[UnitTerm, ...]:
    """Of all places of all effects that are terms."""
    return tuple(unit for cause in term_causes(tuple(EffectName)) for unit in cause.units)


@cache
def _term_causes_of(name: EffectName) -> tuple[TermCause, ...]:
    """Symbols are equal to none but themselves: they are made once."""
    if name not in SHAPES:
        return ()
    return tuple(TermCause(name, where, tuple(_variants(name, where))) for where in places_of(name))


def _variants(name: EffectName, where: str) -> list[UnitVariant]:
    shape = SHAPES[name]
    grid = itertools.product(*shape.tried.values())
    alone = [replace(_variant(name, where, replace(shape, angle=None), {}), bent=False)] if shape.simple else []
    return alone + [_variant(name, where, shape, dict(zip(shape.tried, values, strict=True))) for values in grid]


def _variant(name: EffectName, where: str, shape: Shape, held: dict[str, float]) -> UnitVariant:
    base = EFFECTS[name].neutral() | held
    if shape.angle is None:
        units = tuple(_unit(name, where, base, linear) for linear in shape.linear)
    else:
        angles = (0.0, math.pi / 2)
        units = tuple(_unit(name, where, base | {shape.angle: angle}, shape.linear[0]) for angle in angles)
    order = [entry.name for entry in EFFECTS[name].parameters]

    def start(coefficients: Array) -> Array:
        return np.array([(base | _numbers(shape, coefficients))[parameter] for parameter in order])

    return UnitVariant(units, start)


def _unit(name: EffectName, where: str, values: dict[str, float], linear: str) -> UnitTerm:
    symbol = ca.SX.sym(f"{name}.{where}.{linear}")
    return UnitTerm(effect_term(name, where, {**values, linear: symbol}), symbol)


def _numbers(shape: Shape, coefficients: Array) -> dict[str, float]:
    """Size and angle from the two columns, or the linear parameters as they are."""
    if shape.angle is None:
        return dict(zip(shape.linear, coefficients.tolist(), strict=True))
    along, across = coefficients.tolist()
    return {shape.linear[0]: math.hypot(along, across), shape.angle: math.atan2(across, along)}
