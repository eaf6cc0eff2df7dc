"""Time of a co-simulation step, from C, and against the same model in an FMU made of Python."""

from __future__ import annotations

import ctypes
import math
import statistics
import subprocess
import zipfile
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import casadi as ca
import numpy as np
import pytest

from fmu.compiling import HEADERS, find_compiler
from fmu.description import FmiVersion
from fmu.model.equations import equations
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.table import neutral_effects, variable_table
from fmu.variables import Block, Carried, Inputs
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import WHEELS

pytestmark = pytest.mark.bench

DRIVER = Path(__file__).parents[1] / "fmu" / "drivers" / "timing.c"
STEP = 2e-3
STEPS = 4000
PERIOD = 250
STEADY_LIMIT = 7.0
JUMPING_LIMITS = {0.1: 15.0, 0.3: 25.0, 1.0: 60.0}
"""Of a step [us], by how much each torque jumps from step to step at most [Nm]; the motors are rated for 1.3 Nm."""

CARRYING_LIMIT = 5.0
"""Time of a step with every effect of size zero inside over that of the plain model."""

WINDOWS = 3
RATIO_LIMIT = 20.0

PYTHON_SLAVE = '''
import numpy as np
import casadi as ca
from pathlib import Path
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

GAMMA = 0.5
A = ((), (0.0,), (2.0, 0.0), (2.0, 0.0, 1.0))
C = ((), (4.0,), (1.0, -1.0), (1.0, -1.0, -8.0 / 3.0))
B = (2.0, 0.0, 1.0, 1.0)


class Vehicle(Fmi2Slave):
    """One step of Rodas3 a communication step, without error control, on what CasADi compiles at run time."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        for name in NAMES:
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        folder = Path(__file__).parent
        self.derivatives = ca.Function.load(str(folder / "derivatives.casadi"))
        self.jacobian = ca.Function.load(str(folder / "jacobian.casadi"))
        start = np.load(folder / "start.npz")
        self.x, self.u, self.p = start["x"], start["u"], start["p"]

    def do_step(self, time, step_size):
        self.u[:4] = [getattr(self, name) for name in NAMES]
        system = np.eye(len(self.x)) / (GAMMA * step_size) - self.jacobian(self.x, self.u, self.p).full()
        inverse, stages = np.linalg.inv(system), []
        for a, c in zip(A, C):
            at = self.x + sum((weight * stage for weight, stage in zip(a, stages)), np.zeros_like(self.x))
            right = self.derivatives(at, self.u, self.p).full()[:, 0]
            right = right + sum((weight / step_size * stage for weight, stage in zip(c, stages)), np.zeros_like(right))
            stages.append(inverse @ right)
        self.x = self.x + sum(weight * stage for weight, stage in zip(B, stages))
        return bool(np.all(np.isfinite(self.x)))
'''


@pytest.fixture(scope="module")
def timing(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    library = tmp_path_factory.mktemp("timing") / "timing.so"
    subprocess.run(
        ["gcc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-I", HEADERS, "-o", library, DRIVER, "-ldl"], check=True
    )
    return ctypes.CDLL(str(library))


def unpack(path: Path, folder: Path) -> tuple[Path, str, dict[str, int]]:
    """Library, GUID and value references of an FMU 2.0."""
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    references = {str(row.get("name")): int(str(row.get("valueReference"))) for row in root.iter("ScalarVariable")}
    (library,) = (folder / "binaries" / "linux64").glob("*.so")
    return library, str(root.get("guid")), references


def seconds(
    timing: ctypes.CDLL,
    unpacked: tuple[Path, str, dict[str, int]],
    start: Mapping[str, float],
    torques: Mapping[str, float],
    steps: int = STEPS,
    ripple: float = 0.0,
) -> list[float]:
    library, guid, references = unpacked
    found = (ctypes.c_double * steps)()
    resources = library.parents[2] / "resources"
    status = timing.measure(
        str(library).encode(),
        guid.encode(),
        resources.as_uri().encode(),
        (ctypes.c_uint * len(start))(*(references[name] for name in start)),
        (ctypes.c_double * len(start))(*start.values()),
        len(start),
        (ctypes.c_uint * len(torques))(*(references[name] for name in torques)),
        (ctypes.c_double * len(torques))(*torques.values()),
        len(torques),
        ctypes.c_double(ripple),
        ctypes.c_double(STEP),
        steps,
        PERIOD,
        found,
    )
    assert status == 0
    return list(found)


def pattern(fl: float, rl: float, fr: float, rr: float) -> dict[str, float]:
    return dict(zip((f"torque_{wheel}" for wheel in WHEELS), (fl, rl, fr, rr), strict=True))


ROTATION = math.atan2(1.2, 0.8)
CASES = {
    "alignment": ({}, pattern(-1.2, 1.2, 1.2, -1.2)),
    "straight": ({}, pattern(1.0, 1.0, 1.0, 1.0)),
    "lateral": ({"alpha_l": -math.pi / 2, "alpha_r": math.pi / 2}, pattern(-1.0, 1.0, 1.0, -1.0)),
    "rotation": ({"alpha_l": -ROTATION, "alpha_r": ROTATION}, pattern(-1.0, -1.0, 1.0, 1.0)),
    "at rest": ({}, pattern(0.0, 0.0, 0.0, 0.0)),
    "held": ({}, pattern(0.1, 0.05, -0.05, 0.02)),
    "driving and steering": ({}, pattern(0.4, 1.6, 1.5, 0.6)),
}
"""Start values and torques; every half second the torques change their sign."""


Unpacked = tuple[Path, str, dict[str, int]]


def ours_with(folder: Path, carried: Carried) -> Unpacked:
    vehicle = load_vehicle()
    order = Order(FmiVersion.FMI2, Inputs.TORQUE, (host_platform(),), carried=carried)
    path = folder / "ours.fmu"
    path.write_bytes(build_fmu(ModelSource(vehicle, vehicle.prior, (), {}, {}), order, find_compiler()))
    return unpack(path, folder)


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return ours_with(tmp_path_factory.mktemp("ours"), Carried.STATELESS)


def median(timing: ctypes.CDLL, fmu: Unpacked, case: str, ripple: float = 0.0) -> float:
    """Of a step [us]; of some windows the one that was disturbed least."""
    windows = (seconds(timing, fmu, *CASES[case], ripple=ripple) for _ in range(WINDOWS))
    return min(statistics.median(window) for window in windows) * 1e6


@pytest.mark.parametrize("case", CASES)
def test_a_step_of_two_milliseconds_takes_at_most_seven_microseconds(
    timing: ctypes.CDLL, ours: Unpacked, case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = median(timing, ours, case)
    with capsys.disabled():
        print(f"\n2 ms step, {case}: {found:.2f} us (limit {STEADY_LIMIT:.0f})")
    assert found <= STEADY_LIMIT


@pytest.mark.parametrize("ripple", JUMPING_LIMITS)
@pytest.mark.parametrize("case", CASES)
def test_a_step_with_torques_that_jump_every_step_takes_what_is_promised(
    timing: ctypes.CDLL, ours: Unpacked, case: str, ripple: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """At random: a controller at work, a coarse one, and noise of the size of the motors."""
    found = median(timing, ours, case, ripple)
    with capsys.disabled():
        print(f"\n2 ms step, {case}, jumps of {ripple} Nm: {found:.2f} us (limit {JUMPING_LIMITS[ripple]:.0f})")
    assert found <= JUMPING_LIMITS[ripple]


def test_effects_that_are_carried_and_not_there_take_little(
    timing: ctypes.CDLL, ours: Unpacked, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Turn by turn in one run."""
    carrying = ours_with(tmp_path, Carried.ALL)
    for case, ripple in (("straight", 0.0), ("straight", 0.1), ("held", 0.1), ("driving and steering", 0.1)):
        plain, with_all = (median(timing, fmu, case, ripple) for fmu in (ours, carrying))
        with capsys.disabled():
            print(f"\n{case}, jumps of {ripple} Nm, all effects: {with_all:.1f} us, {with_all / plain:.1f} times")
        assert with_all <= CARRYING_LIMIT * plain


def test_it_is_twenty_times_faster_than_the_same_model_by_pythonfmu(
    timing: ctypes.CDLL, ours: Unpacked, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Turn by turn in one run. The other takes one step of the same method, without error control."""
    theirs = unpack(python_fmu(tmp_path), tmp_path / "unpacked")
    start, torques = CASES["straight"]
    ratios = []
    for _ in range(3):
        slow = statistics.median(seconds(timing, theirs, {}, torques, steps=500))
        ratios.append(slow / statistics.median(seconds(timing, ours, start, torques, steps=500)))
    with capsys.disabled():
        print(f"\npythonfmu {slow * 1e6:.0f} us a step: ratio {min(ratios):.0f} (limit {RATIO_LIMIT:.0f})")
    assert min(ratios) >= RATIO_LIMIT


def python_fmu(folder: Path) -> Path:
    from pythonfmu import FmuBuilder

    vehicle, effects = load_vehicle(), neutral_effects()
    table = variable_table(vehicle, vehicle.prior, effects, Inputs.TORQUE)
    model = equations(table, effects, Inputs.TORQUE)
    point = [model.x, model.u, model.p]
    ca.Function("derivatives", point, [model.xd], {"cse": True}).save(str(folder / "derivatives.casadi"))
    ca.Function("jacobian", point, [ca.jacobian(model.xd, model.x)], {"cse": True}).save(
        str(folder / "jacobian.casadi")
    )
    blocks = {"x": Block.STATE, "u": Block.INPUT, "p": Block.PARAMETER}
    values = {name: np.array([row.start for row in table.block(block)]) for name, block in blocks.items()}
    np.savez(folder / "start.npz", **values)
    script = folder / "vehicle.py"
    names = [f"torque_{wheel}" for wheel in WHEELS]
    script.write_text(f"NAMES = {names!r}\n{PYTHON_SLAVE}")
    files = [folder / name for name in ("derivatives.casadi", "jacobian.casadi", "start.npz")]
    return Path(FmuBuilder.build_FMU(script, dest=folder, project_files=files))
