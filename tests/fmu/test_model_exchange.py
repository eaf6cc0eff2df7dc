"""Solvers of others integrate the vehicle: how far they are from a tight integration without any of the C code."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import fmpy
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate

from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.model.equations import equations
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource, make_model
from fmu.table import neutral_effects
from fmu.variables import Block, Inputs
from ident.plant.contact import Contacts
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

CHANGES = np.array([0.0, 0.5, 1.0, 1.6, 2.0])
"""When the torques become others [s]; the last is the end."""

TORQUES = np.array([[1.3, 1.3, 1.5, 1.5], [1.6, 1.4, 1.6, 1.7], [0.2, -0.6, 0.5, -0.4], [-1.1, -0.7, -1.2, -0.8]])
"""Between the changes [Nm], wheel by wheel."""

START = {"alpha_l": 0.8, "alpha_r": 0.45}
INTERVAL = 0.02
FMPY_STEPS = 4
"""Outputs that FMPy is asked for in an interval: it gives up where CVode takes 500 steps between two."""

WATCHED = ("pose_x", "pose_y", "gamma", "alpha_l", "alpha_r", *(f"beta_{wheel}" for wheel in WHEELS))
KNOWN = ("prototype", "compact")
TOLERANCES = (1e-4, 1e-6, 1e-8)


def source_of(name: str) -> ModelSource:
    vehicle = load_vehicle(name)
    parameters = Parameters(vehicle.prior.values, np.full(len(PARAMETER_NAMES), 0.01))
    return ModelSource(vehicle, parameters, (), {}, {})


@pytest.fixture(scope="module")
def fmu_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    folder, made = tmp_path_factory.mktemp("solvers"), {}

    def build(name: str, contacts: Contacts, version: FmiVersion = FmiVersion.FMI2) -> Path:
        if (name, contacts, version) not in made:
            path = folder / f"{name}-{contacts}-{version}.fmu"
            order = Order(version, Inputs.TORQUE, (host_platform(),), contacts)
            path.write_bytes(build_fmu(source_of(name), order, find_compiler()))
            made[name, contacts, version] = path
        return made[name, contacts, version]

    return build


@dataclass(frozen=True)
class Plant:
    """ẋ = f(x, u) with its Jacobian, as the equations stand in Python, the parameters being numbers."""

    names: tuple[str, ...]
    rates: Callable[[Array, Array], Array]
    jacobian: Callable[[Array, Array], Array]
    inputs: int


def plant_of(name: str, contacts: Contacts) -> Plant:
    table = make_model(source_of(name), Inputs.TORQUE, contacts).table
    model = equations(table, neutral_effects(), Inputs.TORQUE)
    parameters = [row.start for row in table.block(Block.PARAMETER)]
    both = ca.Function("both", [model.x, model.u, model.p], [model.xd, ca.jacobian(model.xd, model.x)])
    return Plant(
        tuple(row.name for row in table.block(Block.STATE)),
        lambda x, u: np.asarray(both(x, u, parameters)[0]).ravel(),
        lambda x, u: np.asarray(both(x, u, parameters)[1]),
        len(table.block(Block.INPUT)),
    )


@pytest.fixture(scope="module")
def reference_of() -> Callable[[str, Contacts], Mapping[str, Array]]:
    """The states by name, every INTERVAL, by SciPy's Radau at a tolerance of 1e-9."""
    made: dict[tuple[str, Contacts], Mapping[str, Array]] = {}

    def integrated(name: str, contacts: Contacts) -> Mapping[str, Array]:
        if (name, contacts) not in made:
            plant = plant_of(name, contacts)
            states = [np.array([START.get(each, 0.0) for each in plant.names])]
            for begin, end, torques in zip(CHANGES[:-1], CHANGES[1:], TORQUES, strict=True):
                u = np.concatenate([torques, np.zeros(plant.inputs - 4)])
                times = np.linspace(begin, end, round((end - begin) / INTERVAL) + 1)[1:]
                solution = integrate.solve_ivp(
                    lambda _, x, u=u, plant=plant: plant.rates(x, u),
                    (begin, end),
                    states[-1],
                    "Radau",
                    times,
                    jac=lambda _, x, u=u, plant=plant: plant.jacobian(x, u),
                    rtol=1e-9,
                    atol=1e-11,
                )
                assert solution.success
                states.extend(solution.y.T)
            made[name, contacts] = dict(zip(plant.names, np.array(states).T, strict=True))
        return made[name, contacts]

    return integrated


def stairs(path: Path) -> Array:
    """The torques for FMPy, which jumps where a time stands twice."""
    inputs = [row.name for row in fmpy.read_model_description(str(path)).modelVariables if row.causality == "input"]
    signals = np.zeros(2 * len(TORQUES), dtype=[("time", float), *((name, float) for name in inputs)])
    signals["time"] = np.repeat(CHANGES, 2)[1:-1]
    for wheel, name in enumerate(WHEELS):
        signals[f"torque_{name}"] = np.repeat(TORQUES[:, wheel], 2)
    return signals


def differences(found: Any, reference: Mapping[str, Array]) -> dict[str, float]:
    """Largest distance of each motion, over the largest motion of its kind [1]."""
    times = np.arange(len(reference["gamma"])) * INTERVAL
    places = [int(np.flatnonzero(np.isclose(found["time"], time))[-1]) for time in times]
    kinds = {"pose": ("pose_x", "pose_y"), "angle": ("gamma", "alpha_l", "alpha_r"), "beta": WATCHED[5:]}
    return {
        name: float(
            np.abs(found[name][places] - reference[name]).max() / max(np.ptp(reference[each]) for each in names)
        )
        for names in kinds.values()
        for name in names
    }


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("contacts", list(Contacts))
@pytest.mark.parametrize("vehicle", KNOWN)
def test_cvode_is_within_a_thousandth_at_loose_and_tight_tolerances(
    fmu_of: Callable[..., Path], reference_of: Any, vehicle: str, contacts: Contacts, tolerance: float
) -> None:
    path = fmu_of(vehicle, contacts)
    found = fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        solver="CVode",
        stop_time=CHANGES[-1],
        output_interval=INTERVAL / FMPY_STEPS,
        relative_tolerance=tolerance,
        input=stairs(path),
        start_values=START,
        output=WATCHED,
    )
    reference = reference_of(vehicle, contacts)
    assert np.ptp(reference["gamma"]) > 0.6
    assert max(differences(found, reference).values()) < 1e-3


@pytest.fixture
def fmusim() -> str:
    path = shutil.which("fmusim")
    if path is None:
        pytest.skip("fmusim (Reference FMUs 0.0.39) is not installed")
    return path


def with_fmusim(fmusim: str, path: Path, signals: Array, tolerance: float, folder: Path) -> Any:
    names = list(signals.dtype.names or ())
    rows = [
        ",".join(f'"{name}"' for name in names),
        *(",".join(repr(float(value)) for value in row) for row in signals),
    ]
    (folder / "in.csv").write_text("\n".join(rows))
    starts = [word for name, value in START.items() for word in ("--start-value", name, str(value))]
    watched = [word for name in WATCHED for word in ("--output-variable", name)]
    lengths = ["--tolerance", str(tolerance), "--stop-time", str(CHANGES[-1]), "--output-interval", str(INTERVAL)]
    files = ["--input-file", str(folder / "in.csv"), "--output-file", str(folder / "out.csv"), str(path)]
    solver = ["--interface-type", "me", "--solver", "cvode"]
    subprocess.run([fmusim, *solver, *lengths, *starts, *watched, *files], check=True, capture_output=True)
    found = np.genfromtxt(folder / "out.csv", delimiter=",", names=True, deletechars="")
    return {name.strip('"'): found[name] for name in found.dtype.names or ()}


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("contacts", list(Contacts))
def test_fmusim_is_within_a_thousandth_until_torques_jump(
    fmu_of: Callable[..., Path], reference_of: Any, contacts: Contacts, tolerance: float, fmusim: str, tmp_path: Path
) -> None:
    """Up to the first jump: its CVode is not told to stop there, and takes the torques from behind it."""
    path = fmu_of("prototype", contacts)
    found = with_fmusim(fmusim, path, stairs(path)[:2], tolerance, tmp_path)
    count = round(CHANGES[1] / INTERVAL) + 1
    reference = {name: values[:count] for name, values in reference_of("prototype", contacts).items()}
    assert np.ptp(reference["gamma"]) > 0.05
    assert max(differences(found, reference).values()) < 1e-3


class Explicit:
    """An instance for model exchange, with the classical method of Runge and Kutta around it."""

    def __init__(self, path: Path) -> None:
        description = fmpy.read_model_description(str(path))
        self.instance = fmpy.simulation.instantiate_fmu(fmpy.extract(str(path)), description, "ModelExchange")
        self.references = {row.name: row.valueReference for row in description.modelVariables}
        self.count = description.numberOfContinuousStates
        self.states = [row.variable.derivative.name for row in description.derivatives]
        self.instance.setupExperiment()
        self.instance.enterInitializationMode()
        self.write(START)
        self.instance.exitInitializationMode()
        self.instance.enterContinuousTimeMode()
        self.x = np.empty(self.count)
        self.instance.getContinuousStates(self._pointer(self.x), self.count)

    @staticmethod
    def _pointer(values: Array) -> Any:
        return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))

    def write(self, values: Mapping[str, float]) -> None:
        self.instance.setReal([self.references[name] for name in values], list(values.values()))

    def read(self, name: str) -> float:
        return float(self.instance.getReal([self.references[name]])[0])

    def rates(self, x: Array) -> Array:
        found = np.empty(self.count)
        self.instance.setContinuousStates(self._pointer(x), self.count)
        self.instance.getDerivatives(self._pointer(found), self.count)
        return found

    def step(self, h: float) -> None:
        first = self.rates(self.x)
        second = self.rates(self.x + h / 2 * first)
        third = self.rates(self.x + h / 2 * second)
        fourth = self.rates(self.x + h * third)
        self.x = self.x + h / 6 * (first + 2 * second + 2 * third + fourth)

    def drive(self, h: float) -> Any:
        """The stairs with steps of at most h [s], as FMPy gives results."""
        rows, time = [self.x], 0.0
        for cycle in range(round(CHANGES[-1] / INTERVAL)):
            torques = TORQUES[int(np.searchsorted(CHANGES, cycle * INTERVAL + 1e-9, "right")) - 1]
            self.write({f"torque_{wheel}": torque for wheel, torque in zip(WHEELS, torques, strict=True)})
            count = int(np.ceil(INTERVAL / h))
            for _ in range(count):
                self.step(INTERVAL / count)
            time += INTERVAL
            rows.append(self.x)
        named = dict(zip(self.states, np.array(rows).T, strict=True))
        return named | {"time": np.arange(len(rows)) * INTERVAL}


@pytest.mark.parametrize("share", [pytest.param(1.0, marks=pytest.mark.slow), 2.5])
@pytest.mark.parametrize("vehicle", KNOWN)
def test_runge_and_kutta_on_soft_contacts_is_right_at_the_step_that_the_variable_states(
    fmu_of: Callable[..., Path], reference_of: Any, vehicle: str, share: float
) -> None:
    vehicle_in = Explicit(fmu_of(vehicle, Contacts.SOFT))
    found = vehicle_in.drive(share * vehicle_in.read("fastest_time_constant"))
    assert max(differences(found, reference_of(vehicle, Contacts.SOFT)).values()) < 1e-3


def test_longer_steps_stay_bounded_and_are_wrong_which_is_why_the_variable_states_them(
    fmu_of: Callable[..., Path], reference_of: Any
) -> None:
    """Contacts saturate, so nothing blows up and no call is refused."""
    found = Explicit(fmu_of("prototype", Contacts.STIFF)).drive(2e-3)
    assert max(differences(found, reference_of("prototype", Contacts.STIFF)).values()) > 1e-1


@pytest.mark.parametrize("contacts", list(Contacts))
@pytest.mark.parametrize("vehicle", KNOWN)
def test_the_variable_states_the_fastest_eigenvalue_at_rest(
    fmu_of: Callable[..., Path], vehicle: str, contacts: Contacts
) -> None:
    plant, instance = plant_of(vehicle, contacts), Explicit(fmu_of(vehicle, contacts))
    fastest = np.abs(np.linalg.eigvals(plant.jacobian(np.zeros(len(plant.names)), np.zeros(plant.inputs)))).max()
    assert instance.read("fastest_time_constant") == pytest.approx(1 / fastest, rel=1e-3)


def test_the_variable_follows_the_parameters(fmu_of: Callable[..., Path]) -> None:
    instance = Explicit(fmu_of("prototype", Contacts.SOFT))
    before = instance.read("fastest_time_constant")
    instance.instance.enterEventMode()
    instance.write({"creep_stiffness": 1e6})
    assert instance.read("fastest_time_constant") < before / 5


@pytest.mark.parametrize("version", list(FmiVersion))
@pytest.mark.parametrize("contacts", list(Contacts))
def test_the_default_experiment_has_a_step_that_its_solvers_can_take(
    fmu_of: Callable[..., Path], contacts: Contacts, version: FmiVersion
) -> None:
    """Fixed steps are for explicit methods where contacts are soft, and for communication where they are stiff."""
    experiment = fmpy.read_model_description(str(fmu_of("prototype", contacts, version))).defaultExperiment
    fastest = Explicit(fmu_of("prototype", contacts)).read("fastest_time_constant")
    assert (fastest / 2 < float(experiment.stepSize) <= fastest) == (contacts is Contacts.SOFT)
    assert float(experiment.tolerance) == 1e-4
