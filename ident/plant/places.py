"""Places of the vehicle: a joint, drive, encoder or body, or all equals of one kind."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

STEERING: Final = ("steering_left", "steering_right")
WHEEL_PLACES: Final = ("wheel_fl", "wheel_rl", "wheel_fr", "wheel_rr")
DRIVES: Final = ("drive_fl", "drive_rl", "drive_fr", "drive_rr")
ENCODERS: Final = ("encoder_left", "encoder_right")
CHASSIS: Final = ("chassis",)
ALL_WHEELS: Final = ("wheels",)

GROUPS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"steering": STEERING, ALL_WHEELS[0]: WHEEL_PLACES, "drives": DRIVES, "encoders": ENCODERS}
)
"""All equals of one kind, by the name that is the place of an effect which each of them has."""

OF_PARAMETERS: Final[Mapping[str, str]] = MappingProxyType(
    dict.fromkeys(("C_l", "d_vl", "d_cl"), STEERING[0])
    | dict.fromkeys(("C_r", "d_vr", "d_cr"), STEERING[1])
    | dict.fromkeys(("m_ch", "C_ch"), CHASSIS[0])
    | dict.fromkeys(("d_vw", "d_cw", "B_w"), ALL_WHEELS[0])
)
"""Place that each parameter of the model is of."""

_FIRST_ROWS: Final[Mapping[tuple[str, ...], int]] = MappingProxyType({STEERING: 3, WHEEL_PLACES: 5})
"""Row of q of the first joint of a kind."""


def with_groups(*kinds: tuple[str, ...]) -> tuple[str, ...]:
    """Places of some kinds: each by itself, and all of a kind."""
    names = {members: name for name, members in GROUPS.items()}
    return tuple(place for kind in kinds for place in (*kind, *([names[kind]] if kind in names else [])))


def members(where: str) -> tuple[str, ...]:
    """The single places that a place is."""
    return GROUPS.get(where, (where,))


def indices(where: str, among: tuple[str, ...]) -> tuple[int, ...]:
    """Numbers of the members of a place among places of one kind; none if it is of another kind."""
    return tuple(among.index(member) for member in members(where) if member in among)


def rows_of(where: str) -> tuple[int, ...]:
    """Rows of q at which the friction of a place acts; none for what is no joint."""
    return tuple(first + index for kind, first in _FIRST_ROWS.items() for index in indices(where, kind))
