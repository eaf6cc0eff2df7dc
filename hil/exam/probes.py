"""At which sizes the effects are probed, and how large they are in practice: the rows of the table of sizes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from emulator.effects.unlibraried import UNLIBRARIED, UnlibrariedName
from hil.exam.cases import Injected
from ident.vehicle.effects import EFFECTS, EffectName

SIGNED: Final = frozenset(
    {
        EffectName.ASYMMETRIC_COULOMB,
        EffectName.ASYMMETRIC_VISCOUS,
        EffectName.SLOPE,
        EffectName.COM_OFFSET,
        EffectName.TORQUE_GAIN,
        EffectName.TORQUE_BIAS,
        EffectName.WHEEL_RADIUS,
        EffectName.STEERING_OFFSET,
        EffectName.PARAMETER_CHANGE,
    }
)
"""Effects that go both ways."""

KINEMATIC: Final = frozenset({EffectName.WHEEL_RADIUS, EffectName.TIME_DELAY})
"""Effects that break the rolling constraints, and are measured there where no torque shows them."""

PRACTICAL: Final[Mapping[EffectName, Mapping[str, float]]] = MappingProxyType(
    {
        EffectName.STRIBECK: {"steering": 6.0, "wheel": 2.0, "wheels": 1.0},
        EffectName.ASYMMETRIC_COULOMB: {"steering": 4.0, "wheel": 1.5, "wheels": 0.6},
        EffectName.ASYMMETRIC_VISCOUS: {"steering": 2.0, "wheel": 0.5, "wheels": 0.3},
        EffectName.QUADRATIC_DRAG: {"wheel": 0.1, "wheels": 0.03, "chassis": 60.0},
        EffectName.SLOPE: {"chassis": 0.005},
        EffectName.COM_OFFSET: {"chassis": 0.15},
        EffectName.PAYLOAD: {"chassis": 40.0},
        EffectName.TORQUE_GAIN: {"drive": 0.05},
        EffectName.TORQUE_BIAS: {"drive": 0.1},
        EffectName.TORQUE_RIPPLE: {"drive": 0.15},
        EffectName.TIME_DELAY: {"drive": 0.02, "encoder": 0.02},
        EffectName.BACKLASH: {"drive": 0.03, "steering": 0.03},
        EffectName.ELASTICITY: {"drive": 3e-3, "steering": 2e-3},
        EffectName.WHEEL_RADIUS: {"wheel": 1e-3},
        EffectName.WHEEL_ECCENTRICITY: {"wheel": 3e-4},
        EffectName.STEERING_OFFSET: {"steering": 0.01},
        EffectName.SLIP: {"wheel": 0.12, "chassis": 0.15},
        EffectName.SCRUB: {"steering": 6.0, "chassis": 12.0},
        EffectName.STEERING_UNIT_MASS: {"chassis": 8.0},
        EffectName.PARAMETER_CHANGE: {
            "C_l": 0.5,
            "d_vl": 0.4,
            "d_cl": 0.2,
            "C_r": 0.5,
            "d_vr": 0.5,
            "d_cr": 0.2,
            "m_ch": 0.05,
            "C_ch": 0.05,
            "d_vw": 0.3,
            "d_cw": 0.2,
            "B_w": 0.3,
        },
    }
)
"""Largest size in practice by kind of place, in the unit of the effect's size; not part of any fit."""

UNKNOWN_PRACTICAL: Final[Mapping[UnlibrariedName, float]] = MappingProxyType(
    {
        UnlibrariedName.FIELD_WEAKENING: 1e-3,
        UnlibrariedName.FLOOR_WAVES: 20.0,
        UnlibrariedName.HOSE_SPRING: 6.0,
        UnlibrariedName.GEAR_LOSS: 0.08,
        UnlibrariedName.PRESLIDING: 0.6,
    }
)
"""The same of effects that have no candidate."""

SHARES: Final = (0.6, 1.0)
"""Of the largest size, at which every effect is driven first; nearer to the noise after that."""

IDLE: Final = 0.4
"""Share at which an effect with a threshold does nothing yet."""

THRESHOLDS: Final = frozenset({EffectName.SLIP})
"""Effects that do nothing at all up to some size."""


@dataclass(frozen=True)
class Probe:
    """An effect at a place, before it is measured.

    Attributes:
        name, where, parameter, unit: as in the table.
        measured_at: the place that stands for it: left and right, front and rear wheels are alike.
        largest: in practice.
        known: whether the library has a candidate.
    """

    name: str
    where: str
    parameter: str
    unit: str
    measured_at: str
    largest: float
    known: bool

    def injected(self, size: float) -> Injected:
        """The effect at the place that stands for it."""
        return Injected(self.name, self.measured_at, self.parameter, size)


_STAND_INS: Final = {"wheel": "wheel_fl", "drive": "drive_fl"}


def all_probes() -> Iterator[Probe]:
    """Every effect at every place, then those without a candidate."""
    for spec in EFFECTS.values():
        practical = PRACTICAL[spec.name]
        for where in spec.places:
            kind = where if where in practical else where.partition("_")[0]
            stand_in, size = _STAND_INS.get(kind, where), spec.size.name
            yield Probe(spec.name, where, size, spec.unit(size, where), stand_in, practical[kind], True)
    for name, unlisted in UNLIBRARIED.items():
        for where in unlisted.places:
            yield Probe(name, where, "size", unlisted.unit, where, UNKNOWN_PRACTICAL[name], False)
