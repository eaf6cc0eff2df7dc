"""What is inside for users to check the FMU with: a drive and its outcome, a page with a picture, a build of it."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv, read_ref_opt_file

from fmu.compiling import HEADERS, find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.picture import picture_of
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from ident.errors import UserError
from ident.plant import kinematics
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Build = Callable[[FmiVersion, Inputs], Path]


def unpacked(path: Path, folder: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder


def largest_difference(found: Any, expected: Any) -> float:
    """Over the largest motion of the same unit: speeds, angles, positions."""
    names = [name for name in expected.dtype.names if name != "time"]
    kinds = {name: (name.startswith("beta"), name.endswith("_dot"), name.startswith("pose")) for name in names}
    motions = {kind: max(np.ptp(expected[name]) for name in names if kinds[name] == kind) for kind in kinds.values()}
    places = [int(np.flatnonzero(np.isclose(found["time"], time))[-1]) for time in expected["time"]]
    return float(max(np.abs(found[name][places] - expected[name]).max() / motions[kinds[name]] for name in names))


@pytest.mark.parametrize(("kind", "interval", "bound"), [("ModelExchange", 0.01, 1e-4), ("CoSimulation", 0.002, 1e-3)])
def test_its_drive_comes_out_as_its_reference_says(
    variant: Path, tmp_path: Path, kind: str, interval: float, bound: float
) -> None:
    resources = unpacked(variant, tmp_path) / "resources"
    options = read_ref_opt_file(resources / "quasiomni_ref.opt")
    expected = read_csv(resources / "quasiomni_ref.csv")
    found = fmpy.simulate_fmu(
        str(variant),
        fmi_type=kind,
        input=read_csv(resources / "quasiomni_in.csv"),
        stop_time=float(options["StopTime"]),
        relative_tolerance=float(options["RelTol"]),
        output_interval=interval,
        output=[name for name in expected.dtype.names if name != "time"],
    )
    assert np.ptp(expected["pose_x"]) > 0.1
    assert np.ptp(expected["alpha_l"]) > 0.01
    assert largest_difference(found, expected) < bound


def test_the_recipe_for_fmpy_on_its_page_gives_the_numbers_on_its_page(build: Build, tmp_path: Path) -> None:
    path = build(FmiVersion.FMI2, Inputs.TORQUE)
    page = (unpacked(path, tmp_path) / "documentation" / "index.html").read_text(encoding="utf-8")
    recipe = re.search(r"fmpy (simulate platform\.fmu .*?)</pre>", page, re.DOTALL)
    assert recipe is not None
    arguments = [str(path) if word == "platform.fmu" else word for word in recipe[1].replace("\\\n", " ").split()]
    subprocess.run([sys.executable, "-m", "fmpy", *arguments], cwd=tmp_path, check=True)
    last = read_csv(tmp_path / "out.csv")[-1]
    numbers = dict(re.findall(r"<code>(\w+)</code></td><td class=\"number\">(-?\d+\.\d{4})</td></tr>", page))
    assert {"pose_x", "gamma", "alpha_l", "beta_fl"} <= numbers.keys()
    for name, value in numbers.items():
        assert last[name] == pytest.approx(float(value), abs=3e-4), name


def test_the_picture_shows_wheels_where_they_are_and_how_they_turn() -> None:
    """Against the kinematics: with the angles shown, a vehicle turns about where the axles of all wheels meet."""
    geometry = load_vehicle().geometry
    picture = picture_of(geometry)
    scale = (picture.wheels[2].axis[0] - picture.wheels[0].axis[0]) / geometry.track_width
    assert [wheel.name for wheel in picture.wheels] == list(WHEELS)
    headings = np.radians([-wheel.heading for wheel in picture.wheels])
    assert headings[0] > 0 > headings[1]
    assert headings[2] > 0 > headings[3]
    rows = kinematics.constraint_matrix(np.array([[headings[0], headings[2]]]), geometry)[0]
    for place, wheel in enumerate(picture.wheels):
        ahead = (picture.middle - wheel.centre[1]) / scale
        left = (picture.middle - wheel.centre[0]) / scale
        along = np.array([np.cos(headings[place]), np.sin(headings[place])])
        expected = [*along, along @ np.array([-left, ahead])]
        np.testing.assert_allclose(rows[4 + place, :3], expected, atol=2e-3)


def test_the_page_draws_every_wheel_and_axis(variant: Path, tmp_path: Path) -> None:
    page = (unpacked(variant, tmp_path) / "documentation" / "index.html").read_text(encoding="utf-8")
    drawing = re.search(r"<svg.*?</svg>", page, re.DOTALL)
    assert drawing is not None
    texts = [element.text for element in ElementTree.fromstring(drawing[0]).iter("text")]
    for place, wheel in enumerate(WHEELS, start=1):
        assert f"{wheel} ({place})" in texts
    assert {"x_dot, forward", "y_dot, left", "gamma", "+alpha_l", "-alpha_l", "+alpha_r", "-alpha_r"} <= set(texts)


@pytest.mark.parametrize("version", list(FmiVersion))
def test_cmake_builds_its_sources_into_the_same_model(
    build: Build, need: Callable[[str], str], tmp_path: Path, version: FmiVersion
) -> None:
    path, cmake, host = build(version, Inputs.TORQUE), need("cmake"), host_platform()
    folder = unpacked(path, tmp_path / "fmu")
    made = tmp_path / "made"
    for command in (["-S", folder / "sources", "-B", made, f"-DFMI_HEADERS={HEADERS}"], ["--build", made]):
        done = subprocess.run([cmake, *command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    (library,) = made.rglob(f"quasiomni{host.suffix}")
    where = host.name if version is FmiVersion.FMI3 else host.folder_fmi2
    (folder / "binaries" / where / f"quasiomni{host.suffix}").write_bytes(library.read_bytes())
    settings = {"input": read_csv(folder / "resources" / "quasiomni_in.csv"), "stop_time": 2.0, "output": ["gamma"]}
    theirs, ours = fmpy.simulate_fmu(str(folder), **settings), fmpy.simulate_fmu(str(path), **settings)
    np.testing.assert_allclose(theirs["gamma"], ours["gamma"], rtol=1e-9, atol=1e-12)


def test_cmake_says_what_is_missing(build: Build, need: Callable[[str], str], tmp_path: Path) -> None:
    folder = unpacked(build(FmiVersion.FMI2, Inputs.TORQUE), tmp_path)
    command = [need("cmake"), "-S", folder / "sources", "-B", tmp_path / "made"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "set FMI_HEADERS" in done.stderr


def test_a_model_that_runs_away_makes_no_fmu(source: ModelSource) -> None:
    driven = source.parameters.values * np.where(np.array(PARAMETER_NAMES) == "d_vl", -1000.0, 1.0)
    run_away = replace(source, parameters=Parameters(driven, source.parameters.std))
    with pytest.raises(UserError, match="cannot be integrated over the drive"):
        build_fmu(run_away, Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),)), find_compiler())
