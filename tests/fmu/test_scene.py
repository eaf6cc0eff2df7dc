"""The 3D model in `resources/` is what programs of others can load, stands on the floor, and moves as the FMU does."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.description import FmiVersion
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.vehicle.geometry import WHEELS

trimesh = pytest.importorskip("trimesh")

Array = NDArray[np.float64]
Build = Callable[[FmiVersion, Inputs], Path]


@pytest.fixture(scope="module")
def fmu(build: Build) -> Path:
    return build(FmiVersion.FMI2, Inputs.TORQUE)


@pytest.fixture(scope="module")
def file(fmu: Path) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read("resources/vehicle.glb")


@pytest.fixture(scope="module")
def scene(file: bytes) -> Any:
    return trimesh.load(io.BytesIO(file), file_type="glb")


@pytest.fixture(scope="module")
def document(file: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from("<I", file, 12)
    return dict(json.loads(file[20 : 20 + length]))


def frame(scene: Any, name: str) -> Array:
    """Where a frame is in the file, whose y is up, as (x forward, y left, z up)."""
    x, y, z = scene.graph.get(name)[0][:3, 3]
    return np.array([x, -z, y])


def test_it_is_light(file: bytes) -> None:
    assert len(file) < 50_000


def test_wheels_are_where_the_vehicle_has_them_and_stand_on_the_floor(scene: Any, source: ModelSource) -> None:
    geometry = source.vehicle.geometry
    aside = geometry.track_width / 2 + geometry.wheel_offset
    expected = {
        "wheel_fl": (geometry.wheelbase / 2, aside),
        "wheel_rl": (-geometry.wheelbase / 2, aside),
        "wheel_fr": (geometry.wheelbase / 2, -aside),
        "wheel_rr": (-geometry.wheelbase / 2, -aside),
    }
    for name, place in expected.items():
        np.testing.assert_allclose(frame(scene, name), [*place, geometry.wheel_radius], atol=1e-6)
    assert scene.bounds[0][1] == pytest.approx(0.0, abs=2e-3 * geometry.wheel_radius)


def test_every_surface_is_closed_and_faces_outward(scene: Any) -> None:
    for mesh in scene.geometry.values():
        mesh.merge_vertices(merge_norm=True)
        assert mesh.is_watertight
        assert mesh.volume > 0.7
        outward = np.einsum("ij,ij->i", mesh.face_normals, mesh.triangles_center)
        assert outward.min() > 0.0


def test_frames_name_variables_that_the_fmu_has(document: dict[str, Any], fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    outputs = {row.get("name") for row in root.iter("ScalarVariable") if row.get("causality") == "output"}
    named = [motion["variable"] for node in document["nodes"] for motion in node.get("extras", {}).get("fmi", ())]
    assert set(named) <= outputs
    assert sorted(named) == sorted(
        ["pose_x", "pose_y", "gamma", *["alpha_l", "alpha_r"] * 2, *(f"beta_{wheel}" for wheel in WHEELS)]
    )


def animated(document: dict[str, Any], file: bytes, node: str, path: str) -> Array:
    """Values of a track (N, n)."""
    (json_length,) = struct.unpack_from("<I", file, 12)
    content = file[20 + json_length + 8 :]
    (animation,) = document["animations"]
    for channel in animation["channels"]:
        target = channel["target"]
        if document["nodes"][target["node"]]["name"] == node and target["path"] == path:
            accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            view = document["bufferViews"][accessor["bufferView"]]
            values = np.frombuffer(content, "<f4", view["byteLength"] // 4, view["byteOffset"])
            return values.reshape(accessor["count"], -1).astype(float)
    raise KeyError(node)


def angles(quaternions: Array, axis: int) -> Array:
    return np.unwrap(2 * np.arctan2(quaternions[:, axis], quaternions[:, 3]))


def test_its_animation_is_the_reference_drive(document: dict[str, Any], file: bytes, fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        rows = np.genfromtxt(io.BytesIO(archive.read("resources/quasiomni_ref.csv")), delimiter=",", names=True)
    places = animated(document, file, "chassis", "translation")
    np.testing.assert_allclose(places[:, :2], np.stack([rows["pose_x"], rows["pose_y"]], axis=1), atol=1e-6)
    assert np.ptp(rows["pose_x"]) > 0.05
    turned = {
        ("chassis", 2): rows["gamma"],
        ("steering_fl", 2): rows["alpha_l"],
        ("steering_rl", 2): -rows["alpha_l"],
        ("steering_fr", 2): rows["alpha_r"],
        ("steering_rr", 2): -rows["alpha_r"],
        **{(f"wheel_{wheel}", 1): rows[f"beta_{wheel}"] for wheel in WHEELS},
    }
    for (node, axis), expected in turned.items():
        found = angles(animated(document, file, node, "rotation"), axis)
        np.testing.assert_allclose(found, expected, atol=1e-5, err_msg=node)
