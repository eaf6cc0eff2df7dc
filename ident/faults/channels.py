"""Channels of a record by name, one by one, in pairs and in groups."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.records.record import Segment
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Group:
    """Channels of one kind.

    Attributes:
        name: canonical, of all of them.
        field: of a segment.
        members: canonical names in the order of its columns.
        unit: SI.
    """

    name: str
    field: str
    members: tuple[str, ...]
    unit: str


TORQUE: Final = Group("torque", "motor_torques", tuple(f"torque_{wheel}" for wheel in WHEELS), "Nm")
BETA: Final = Group("beta", "wheel_angles", tuple(f"beta_{wheel}" for wheel in WHEELS), "rad")
ALPHA: Final = Group("alpha", "steering_angles", ("alpha_l", "alpha_r"), "rad")
GROUPS: Final = (TORQUE, BETA, ALPHA)


@dataclass(frozen=True)
class Place:
    """Columns of a group.

    Attributes:
        group: which.
        columns: of it, in order.
    """

    group: Group
    columns: tuple[int, ...]

    @property
    def name(self) -> str:
        """As faults name it: a channel, two with a slash between, or the group."""
        if len(self.columns) == len(self.group.members) and len(self.columns) != 1:
            return self.group.name
        return "/".join(self.group.members[column] for column in self.columns)

    def of(self, segment: Segment) -> Array:
        """The columns of a segment (N, n)."""
        values: Array = getattr(segment, self.group.field)
        return values[:, list(self.columns)]

    def put(self, segment: Segment, values: Array) -> Segment:
        """A segment with other values (N, n) in these columns."""
        changed = getattr(segment, self.group.field).copy()
        changed[:, list(self.columns)] = values
        return replace(segment, **{self.group.field: changed})

    def changed(self, segment: Segment, change: Callable[[Array], Array]) -> Segment:
        """A segment with these columns (N, n) changed."""
        return self.put(segment, change(self.of(segment)))


def single(group: Group, column: int) -> Place:
    """One channel."""
    return Place(group, (column,))


def whole(group: Group) -> Place:
    """All channels of a group."""
    return Place(group, tuple(range(len(group.members))))


def singles(groups: Sequence[Group] = GROUPS) -> list[Place]:
    """Every channel."""
    return [single(group, column) for group in groups for column in range(len(group.members))]


def pairs(group: Group) -> list[Place]:
    """Every two channels of a group, named as a pair even where the group has only two."""
    count = len(group.members)
    return [Place(group, (one, other)) for one in range(count) for other in range(one + 1, count)]
