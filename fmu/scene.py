"""The vehicle as a light 3D model (glTF) whose frames are moved by variables of the FMU.

Frames of the vehicle are x forward, y left, z up, in metres; the root turns that to glTF's y up. Each frame that moves
says in its `extras` which variables move it: `{"fmi": [{"variable", "motion", "axis", "factor"}]}`, a translation along
or a rotation about an axis of its parent, in the order in which they act. The animation is the drive of
`resources/quasiomni_ref.csv`. The lengths that a vehicle file does not have, of body and tyres, are for the eye alone.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fmu.gltf import Node, Solid, Track, Vector, binary_gltf
from fmu.reference import Reference
from ident.plant.symbolic import CORNERS
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

_BODY: Final = (0.70, 0.17, 0.01)
_FRONT: Final = (0.93, 0.85, 0.72)
_BEAM: Final = (0.17, 0.19, 0.21)
_UNIT: Final = (0.01, 0.12, 0.60)
_TYRE: Final = (0.015, 0.015, 0.017)
_MARK: Final = (1.0, 0.79, 0.01)
"""Of a bar on each wheel, which shows how it turns."""

_UPRIGHT: Final = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""From z up to y up."""

_AXES: Final = {"x": 0, "y": 1, "z": 2}


def scene(geometry: Geometry, reference: Reference, generator: str) -> bytes:
    """The model of a vehicle, a `.glb` file.

    Args:
        geometry: its lengths.
        reference: drive that its animation shows.
        generator: program that made it.
    """
    root = Node("world", rotation=_UPRIGHT, children=(_chassis(geometry),))
    outputs = {name: np.round(values, 6) for name, values in reference.outputs.items()}
    return binary_gltf(root, np.round(reference.times, 6), _tracks(geometry, outputs), generator)


def _moved(*motions: tuple[str, str, str, float]) -> dict[str, Any]:
    """Extras of a frame, from variable, motion, axis and factor."""
    return {"fmi": [dict(zip(("variable", "motion", "axis", "factor"), motion, strict=True)) for motion in motions]}


def _solid(name: str, solid: Solid, size: Vector, centre: Vector, colour: Vector) -> Node:
    return Node(name, translation=centre, scale=size, solid=solid, colour=colour)


def _chassis(geometry: Geometry) -> Node:
    radius, length, width = geometry.wheel_radius, geometry.wheelbase, geometry.track_width
    body_width = max(width - 3.2 * radius, width / 4)
    middle, stripe = 1.6 * radius, (0.06 * length, 1.01 * body_width, 1.02 * radius)
    parts = (
        _solid("body", Solid.BOX, (1.1 * length, body_width, radius), (0.0, 0.0, middle), _BODY),
        _solid("front", Solid.BOX, stripe, (0.47 * length, 0, middle), _FRONT),
        *(
            _solid(f"beam_{name}", Solid.BOX, (radius / 2, width, radius / 3), (end * length / 2, 0.0, middle), _BEAM)
            for name, end in (("front", 1), ("rear", -1))
        ),
        *(_unit(geometry, place) for place in range(len(WHEELS))),
    )
    moved = _moved(
        ("pose_x", "translation", "x", 1.0), ("pose_y", "translation", "y", 1.0), ("gamma", "rotation", "z", 1.0)
    )
    return Node("chassis", translation=(0.0, 0.0, radius), children=parts, extras=moved)


def _unit(geometry: Geometry, place: int) -> Node:
    """A steering unit, turned about its axis, with its wheel."""
    name, (front, side) = WHEELS[place], CORNERS[place]
    radius, aside = geometry.wheel_radius, side * geometry.wheel_offset
    pointer = (1.2 * radius, radius / 3, radius / 5)
    parts = (
        _solid(f"post_{name}", Solid.BOX, (radius / 2, radius / 2, 1.8 * radius), (0.0, 0.0, 0.8 * radius), _UNIT),
        _solid(f"pointer_{name}", Solid.BOX, pointer, (radius / 2, 0, 1.8 * radius), _UNIT),
        _solid(f"arm_{name}", Solid.BOX, (radius / 3, abs(aside), radius / 3), (0.0, aside / 2, 0.0), _UNIT),
        _wheel(name, radius, aside),
    )
    corner = (front * geometry.wheelbase / 2, side * geometry.track_width / 2, 0.0)
    moved = _moved((_steering(place), "rotation", "z", float(front)))
    return Node(f"steering_{name}", translation=corner, children=parts, extras=moved)


def _steering(place: int) -> str:
    return "alpha_l" if CORNERS[place][1] > 0 else "alpha_r"


def _wheel(name: str, radius: float, aside: float) -> Node:
    width = radius / 2
    parts = (
        _solid(f"tyre_{name}", Solid.CYLINDER, (2 * radius, width, 2 * radius), (0.0, 0.0, 0.0), _TYRE),
        _solid(f"mark_{name}", Solid.BOX, (radius / 3, 1.04 * width, 1.02 * radius), (0, 0, radius / 2), _MARK),
    )
    moved = _moved((f"beta_{name}", "rotation", "y", 1.0))
    return Node(f"wheel_{name}", translation=(0.0, aside, 0.0), children=parts, extras=moved)


def _tracks(geometry: Geometry, outputs: dict[str, Array]) -> list[Track]:
    height = np.full_like(outputs["pose_x"], geometry.wheel_radius)
    tracks = [
        Track("chassis", "translation", np.stack([outputs["pose_x"], outputs["pose_y"], height], axis=1)),
        Track("chassis", "rotation", _turned("z", outputs["gamma"])),
    ]
    for place, name in enumerate(WHEELS):
        steered = CORNERS[place][0] * outputs[_steering(place)]
        tracks.append(Track(f"steering_{name}", "rotation", _turned("z", steered)))
        tracks.append(Track(f"wheel_{name}", "rotation", _turned("y", outputs[f"beta_{name}"])))
    return tracks


def _turned(axis: str, angles: Array) -> Array:
    """Quaternions (N, 4) of rotations (N,) about an axis."""
    quaternions = np.zeros((len(angles), 4))
    quaternions[:, _AXES[axis]], quaternions[:, 3] = np.sin(angles / 2), np.cos(angles / 2)
    return quaternions
