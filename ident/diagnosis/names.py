"""The causes that the diagnosis knows, by name, and where it looks for each."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from ident.effects import EFFECTS, LAWS, Effect
from ident.errors import UserError
from ident.plant.places import GROUPS

LAW: Final = "law"
"""Name of a cause that has none."""


class EffectName(enum.StrEnum):
    """Effects of the library that the diagnosis tells from each other."""

    STRIBECK = "stribeck"
    ASYMMETRIC_COULOMB = "asymmetric_coulomb"
    ASYMMETRIC_VISCOUS = "asymmetric_viscous"
    QUADRATIC_DRAG = "quadratic_drag"
    FRICTION_POSITION = "friction_position"
    FRICTION_LOAD = "friction_load"
    PRESLIDING = "presliding"
    SLOPE = "slope"
    COM_OFFSET = "com_offset"
    PAYLOAD = "payload"
    TORQUE_GAIN = "torque_gain"
    TORQUE_BIAS = "torque_bias"
    TORQUE_RIPPLE = "torque_ripple"
    TIME_DELAY = "time_delay"
    TORQUE_FILTER = "torque_filter"
    BACKLASH = "backlash"
    ELASTICITY = "elasticity"
    WHEEL_RADIUS = "wheel_radius"
    WHEEL_ECCENTRICITY = "wheel_eccentricity"
    STEERING_OFFSET = "steering_offset"
    SLIP = "slip"
    SCRUB = "scrub"
    STEERING_UNIT_MASS = "steering_unit_mass"
    PARAMETER_CHANGE = "parameter_change"


_AT_GROUPS: Final[Mapping[EffectName, tuple[str, ...]]] = MappingProxyType(
    {
        EffectName.STRIBECK: ("wheels", "steering"),
        EffectName.ASYMMETRIC_COULOMB: ("wheels", "steering"),
        EffectName.ASYMMETRIC_VISCOUS: ("wheels", "steering"),
        EffectName.QUADRATIC_DRAG: ("wheels",),
        EffectName.FRICTION_POSITION: ("steering",),
        EffectName.FRICTION_LOAD: ("wheels",),
        EffectName.PRESLIDING: ("wheels", "steering"),
        EffectName.TIME_DELAY: ("drives", "encoders"),
        EffectName.TORQUE_FILTER: ("drives",),
        EffectName.TORQUE_RIPPLE: ("drives",),
    }
)
"""Groups of equals at which an effect is looked for too: what one bearing, one bus or one firmware does, all do."""


LATE = (EffectName.TIME_DELAY, EffectName.TORQUE_FILTER)
"""What makes a motion follow its effort later than sampling does."""

MEMORIES = (
    EffectName.TIME_DELAY,
    EffectName.TORQUE_FILTER,
    EffectName.BACKLASH,
    EffectName.ELASTICITY,
    EffectName.PRESLIDING,
    EffectName.SLIP,
)
"""Effects with states of their own, which are taken out of the signals; the others are terms of the rows."""


def refuse_strangers(effects: Sequence[Effect]) -> None:
    """Refuse a model whose effects the diagnosis does not know.

    Raises:
        UserError: with the first of them.
    """
    known = {*EffectName, *(name for name, kind in LAWS.items() if not kind.takes_time)}
    for effect in effects:
        if effect.name not in known:
            raise UserError(
                f"The model has {effect}, which the diagnosis cannot take into account: it averages over repeats.",
                "Diagnose with a model that does not have it.",
            )


def places_of(name: EffectName) -> tuple[str, ...]:
    """Places at which a cause is looked for: each by itself, and groups of equals that are alike by nature."""
    groups = _AT_GROUPS.get(name, ())
    return tuple(where for where in EFFECTS[name].places if where not in GROUPS or where in groups)
