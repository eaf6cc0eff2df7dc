"""Binaries of other platforms compute what ours does, under wine and qemu."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.compiling import FLAGS, HEADERS, find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import parse_platforms
from fmu.source import ModelSource
from fmu.variables import Inputs

pytestmark = pytest.mark.slow

DRIVER = Path(__file__).parent / "drivers" / "trajectory.c"


@pytest.fixture(scope="module")
def unpacked(source: ModelSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU for Windows, unpacked: its sources serve the other platforms."""
    pytest.importorskip("ziglang")
    folder = tmp_path_factory.mktemp("unpacked")
    order = Order(FmiVersion.FMI2, Inputs.TORQUE, parse_platforms("x86_64-windows"))
    (folder / "all.fmu").write_bytes(build_fmu(source, order, find_compiler()))
    with zipfile.ZipFile(folder / "all.fmu") as archive:
        archive.extractall(folder)
    return folder


def compile_driver(unpacked: Path, target: str, name: str, *, loads: bool = False, flags: Sequence[str] = ()) -> Path:
    """The driver with the flags that the libraries are built with; with the model in it, or to load a library."""
    output, sources = unpacked / name, unpacked / "sources"
    units = [path for path in sorted(sources.glob("*.c")) if not loads or path.name == "variables.c"]
    ours = [flag for flag in (*FLAGS, *flags) if flag not in ("-shared", "-fvisibility=hidden")]
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-s", *ours, "-I", HEADERS, "-I", sources]
    subprocess.run([*command, "-o", output, *units, DRIVER, "-lm"], check=True, capture_output=True)
    return output


def trajectory(command: Sequence[str | Path], environment: dict[str, str] | None = None) -> NDArray[np.float64]:
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [[float.fromhex(number) for number in line.split()] for line in done.stdout.splitlines()]
    return np.array(rows)


@pytest.fixture(scope="module")
def ours(unpacked: Path) -> NDArray[np.float64]:
    """On x86-64 Linux."""
    found = trajectory([compile_driver(unpacked, "x86_64-linux-gnu.2.17", "ours")])
    assert found.shape == (15, 7)
    assert np.all(np.ptp(found, axis=0) > 1e-3)
    return found


def assert_same(found: NDArray[np.float64], ours: NDArray[np.float64]) -> None:
    """To 1e-12 of the largest value of each output."""
    assert np.max(np.abs(found - ours) / np.max(np.abs(ours), axis=0)) < 1e-12


def test_the_windows_library_computes_the_same_under_wine_sample(
    unpacked: Path, ours: NDArray[np.float64], need: Callable[[str], str], tmp_path: Path
) -> None:
    wine = need("wine")
    driver = compile_driver(unpacked, "x86_64-windows-gnu", "driver.exe", loads=True)
    library = unpacked / "binaries" / "win64" / "quasiomni.dll"
    environment = os.environ | {"WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    assert_same(trajectory([wine, driver, f"Z:{library}"], environment), ours)


def test_thirty_two_bits_compute_the_same_sample(unpacked: Path, ours: NDArray[np.float64]) -> None:
    """Linux on x86-64 runs programs for x86; in SSE registers, not in 80 bits."""
    if platform.machine() != "x86_64":
        pytest.skip("runs on x86-64 alone")
    (entry,) = parse_platforms("x86-linux")
    assert_same(trajectory([compile_driver(unpacked, "x86-linux-musl", "small", flags=entry.flags)]), ours)


def test_arm_computes_the_same_under_qemu_sample(
    unpacked: Path, ours: NDArray[np.float64], need: Callable[[str], str]
) -> None:
    qemu = need("qemu-aarch64")
    assert_same(trajectory([qemu, compile_driver(unpacked, "aarch64-linux-musl", "arm")]), ours)
