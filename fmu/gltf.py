"""Scenes of boxes and cylinders as glTF 2.0, in one binary file (Khronos, glTF 2.0, sections 3 and 4)."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

_FACETS: Final = 24
"""Of a cylinder."""

_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942

_FLOAT, _UNSIGNED_SHORT = 5126, 5123
_VERTICES, _INDICES = 34962, 34963

_WIDTHS: Final = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}

_ROUGHNESS: Final = 0.8


class Solid(StrEnum):
    """What shapes there are, each within a unit cube around the origin; a cylinder lies along y."""

    BOX = "box"
    CYLINDER = "cylinder"


@dataclass(frozen=True)
class Node:
    """A frame of a scene.

    Attributes:
        name: of the frame.
        translation: of it in that of its parent [m].
        rotation: of it in that of its parent, quaternion (x, y, z, w).
        scale: of its solid along the axes [m].
        solid: what is seen in it.
        colour: of the solid: red, green, blue, 0 to 1, linear.
        children: frames in it.
        extras: for programs, as they are written.
    """

    name: str
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: Vector = (1.0, 1.0, 1.0)
    solid: Solid | None = None
    colour: Vector = (0.5, 0.5, 0.5)
    children: tuple[Node, ...] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Track:
    """How a frame moves.

    Attributes:
        node: its name.
        path: `translation` [m] or `rotation`, quaternion (x, y, z, w).
        values: at the times of the animation (N, 3) or (N, 4).
    """

    node: str
    path: str
    values: Array


def binary_gltf(root: Node, times: Array, tracks: Sequence[Track], generator: str) -> bytes:
    """A scene as a `.glb` file.

    Args:
        root: frame that holds all others; its y is up.
        times: of the animation (N,) [s], growing.
        tracks: of the frames that move.
        generator: program that made it.
    """
    document = _Document(generator)
    document.scene(root)
    document.animate(times, tracks)
    return document.packed()


class _Document:
    """A file in the making."""

    def __init__(self, generator: str) -> None:
        self._content = b""
        self._numbers: dict[str, int] = {}
        self._meshes: dict[tuple[Solid, Vector], int] = {}
        self._shapes: dict[Solid, dict[str, Any]] = {}
        self._json: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}, "scene": 0}
        self._json |= {name: [] for name in ("nodes", "meshes", "materials", "accessors", "bufferViews")}

    def scene(self, root: Node) -> None:
        """The frames and what is seen in them."""
        self._json["scenes"] = [{"nodes": [self._node(root)]}]

    def animate(self, times: Array, tracks: Sequence[Track]) -> None:
        """The motion of the frames."""
        instants = self._accessor(times[:, None].astype("<f4"), bounds=True)
        samplers = [{"input": instants, "output": self._accessor(track.values.astype("<f4"))} for track in tracks]
        channels = [
            {"sampler": number, "target": {"node": self._numbers[track.node], "path": track.path}}
            for number, track in enumerate(tracks)
        ]
        self._json["animations"] = [{"name": "reference drive", "samplers": samplers, "channels": channels}]

    def packed(self) -> bytes:
        """The whole file."""
        self._json["buffers"] = [{"byteLength": len(self._content)}]
        text = json.dumps(self._json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), _JSON) + text
        chunks += struct.pack("<II", len(self._content), _BINARY) + self._content
        return struct.pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks

    def _node(self, node: Node) -> int:
        children = [self._node(child) for child in node.children]
        entry: dict[str, Any] = {"name": node.name, "translation": node.translation, "rotation": node.rotation}
        entry["scale"] = node.scale
        if children:
            entry["children"] = children
        if node.solid is not None:
            entry["mesh"] = self._mesh(node.solid, node.colour)
        if node.extras:
            entry["extras"] = node.extras
        self._json["nodes"].append(entry)
        self._numbers[node.name] = len(self._json["nodes"]) - 1
        return self._numbers[node.name]

    def _mesh(self, solid: Solid, colour: Vector) -> int:
        if (solid, colour) not in self._meshes:
            surface = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": _ROUGHNESS}
            self._json["materials"].append({"pbrMetallicRoughness": surface})
            primitive = {**self._shape(solid), "material": len(self._json["materials"]) - 1}
            self._json["meshes"].append({"name": solid.value, "primitives": [primitive]})
            self._meshes[solid, colour] = len(self._json["meshes"]) - 1
        return self._meshes[solid, colour]

    def _shape(self, solid: Solid) -> dict[str, Any]:
        """Accessors of a solid, whose points are written once."""
        if solid not in self._shapes:
            points, normals, corners = _SURFACES[solid]()
            attributes = {
                "POSITION": self._accessor(points.astype("<f4"), _VERTICES, bounds=True),
                "NORMAL": self._accessor(normals.astype("<f4"), _VERTICES),
            }
            indices = self._accessor(corners.reshape(-1, 1).astype("<u2"), _INDICES)
            self._shapes[solid] = {"attributes": attributes, "indices": indices}
        return self._shapes[solid]

    def _accessor(self, values: NDArray[Any], target: int | None = None, *, bounds: bool = False) -> int:
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._content), "byteLength": values.nbytes}
        if target is not None:
            view["target"] = target
        self._json["bufferViews"].append(view)
        self._content += values.tobytes() + bytes(-values.nbytes % 4)
        kind = _UNSIGNED_SHORT if values.dtype.kind == "u" else _FLOAT
        entry: dict[str, Any] = {"bufferView": len(self._json["bufferViews"]) - 1, "componentType": kind}
        entry |= {"count": len(values), "type": _WIDTHS[values.shape[1]]}
        if bounds:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._json["accessors"].append(entry)
        return len(self._json["accessors"]) - 1


Surface = tuple[Array, Array, NDArray[np.int64]]
"""Points (N, 3), outward normals (N, 3), triangles (M, 3) counter-clockwise from outside."""


def _box() -> Surface:
    points: list[Array] = []
    normals: list[Array] = []
    triangles: list[tuple[int, int, int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            outward, first, second = np.zeros(3), np.zeros(3), np.zeros(3)
            outward[axis] = first[(axis + 1) % 3] = second[(axis + 2) % 3] = 1.0
            outward, start = side * outward, len(points)
            # The first two axes turn counter-clockwise seen from the positive third one.
            ring = [(-1, -1), (1, -1), (1, 1), (-1, 1)][:: int(side)]
            points += [(outward + u * first + v * second) / 2 for u, v in ring]
            normals += [outward] * 4
            triangles += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return np.array(points), np.array(normals), np.array(triangles)


def _cylinder() -> Surface:
    angles = [2 * math.pi * facet / _FACETS for facet in range(_FACETS + 1)]
    around = np.array([(math.sin(angle), 0.0, math.cos(angle)) for angle in angles])
    end, count = np.array([0.0, 0.5, 0.0]), _FACETS + 1
    points, normals = [*(around / 2 - end), *(around / 2 + end)], [*around, *around]
    triangles = []
    for facet in range(_FACETS):
        near, far = facet, facet + count
        triangles += [(near, near + 1, far + 1), (near, far + 1, far)]
    for side in (-1.0, 1.0):
        centre = len(points)
        points += [side * end, *(around / 2 + side * end)]
        normals += [2 * side * end] * (count + 1)
        rim = [(centre, centre + facet + 1, centre + facet + 2) for facet in range(_FACETS)]
        triangles += rim if side > 0 else [(middle, after, before) for middle, before, after in rim]
    return np.array(points), np.array(normals), np.array(triangles)


_SURFACES: Final = {Solid.BOX: _box, Solid.CYLINDER: _cylinder}
