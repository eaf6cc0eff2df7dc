"""A run as a system of vehicle and controller: valid, the same in every importer, its lane change that of the bench."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import fmpy
import fmpy.ssp
import fmpy.validation
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from lxml import etree
from numpy.typing import NDArray

from emulator.prototype import load_prototype
from fmu.platforms import host_platform
from hil.bench import emulation
from hil.bench.lockstep import LockstepBench
from hil.bench.prototypes import load_emulated
from hil.bench.truth import truth_of
from hil.bus.realtime import steady_memory
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.cosimulation.plant import FmuVehicle
from hil.cosimulation.system import export_system, system_of_run
from hil.master import Master
from hil.network import DEFAULT_NETWORK, load_network
from ident.campaign.controller import Controller
from ident.campaign.plan import assemble_plan
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel
from ident.errors import DataFileError, UserError
from ident.parameters_file import write_model
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

Array = NDArray[np.float64]

STEP = 2e-3
END = ("pose_x", "pose_y", "gamma", "x_dot")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run folder as `identify` leaves it, its result the truth of the emulated prototype."""
    vehicle, network = load_vehicle(), load_network()
    plan = assemble_plan(vehicle, {}, steps=(Step.LANE_CHANGE,), periods=4, cycle=network.cycle_period)
    folder = RunFolder(tmp_path_factory.mktemp("runs") / "monday")
    made = Run(folder, plan, network, 1, "test", "", None)
    create_run(made, find_data_file("ident.vehicle", "prototype"))
    truth = truth_of("prototype")
    write_model(ExtendedModel(Parameters(truth.values, 0.01 * truth.values)), folder.parameters, {"run": "monday"})
    return made


@pytest.fixture(scope="module")
def system(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("systems") / "system.ssp"
    export_system(run.folder.path, path, (host_platform(),))
    return path


@pytest.fixture(scope="module")
def reference(run: Run) -> Reference:
    return system_of_run(run.folder.path).controller.reference


@pytest.fixture(scope="module")
def driven(system: Path, reference: Reference) -> Any:
    """The whole lane change, by FMPy."""
    return simulate_ssp(str(system), stop_time=reference.duration, step_size=STEP)


@pytest.fixture(scope="module")
def unpacked(system: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(system) as archive:
        archive.extractall(folder)
    return folder


def named(path: Path, name: str) -> Any:
    """A set of parameters as FMPy wants it: it knows those of the system, not those of a component."""
    chosen = read_ssv(str(path), f"resources/{name}.ssv")
    for parameter in chosen.parameters:
        parameter.name = f"vehicle.{parameter.name}"
    return chosen


SCHEMAS = {".ssd": "SystemStructureDescription.xsd", ".ssv": "SystemStructureParameterValues.xsd"}


def test_all_files_are_valid_by_the_schemas_of_the_standard(unpacked: Path) -> None:
    folder = Path(fmpy.ssp.__file__).parent / "schema"
    schemas = {suffix: etree.XMLSchema(file=str(folder / name)) for suffix, name in SCHEMAS.items()}
    files = [path for path in unpacked.rglob("*") if path.suffix in schemas]
    assert len(files) == 2 * (1 + 2 * len(PARAMETER_NAMES))
    for path in files:
        schemas[path.suffix].assertValid(etree.parse(str(path)))
    for name in ("vehicle", "controller"):
        assert fmpy.validation.validate_fmu(str(unpacked / "resources" / f"{name}.fmu")) == []


def test_every_connector_and_parameter_is_a_variable_of_its_fmu_in_the_same_unit(unpacked: Path, system: Path) -> None:
    variables = {
        name: {
            row.name: row
            for row in fmpy.read_model_description(str(unpacked / "resources" / f"{name}.fmu")).modelVariables
        }
        for name in ("vehicle", "controller")
    }
    for component in read_ssd(str(system)).system.elements:
        for connector in component.connectors:
            assert variables[component.name][connector.name].causality == connector.kind
    for path in unpacked.glob("resources/*.ssv"):
        for parameter in read_ssv(str(path)).parameters:
            row = variables["vehicle"][parameter.name]
            assert (row.causality, row.unit) == ("parameter", parameter.unit)


def test_the_structures_differ_in_their_set_of_parameters_alone(unpacked: Path) -> None:
    default = (unpacked / "SystemStructure.ssd").read_text()
    assert 'source="resources/run.ssv"' in default
    for path in unpacked.glob("*.ssd"):
        if path.stem != "SystemStructure":
            assert f'source="resources/{path.stem}.ssv"' in path.read_text()


def follow(master: Master, reference: Reference, run: Run) -> tuple[Array, Array]:
    """Steering angles (N, 2) and how far the wheels rolled (N, 4) [rad] in the lane change of a campaign."""
    vehicle = run.plan.vehicle
    limits = {"gear_ratio": vehicle.geometry.gear_ratio, "peak_torque": vehicle.limits.peak_torque}
    controller = Controller(reference, run.plan.designs, run.plan.limits, **limits)
    master.boot()
    master.enable()
    sample = master.exchange((0.0,) * 4)
    steering, wheels = [sample.steering_angles], [sample.wheel_angles]
    for index in range(len(reference) - 1):
        sample = master.exchange(controller.torques(index, sample.wheel_angles, sample.steering_angles))
        steering.append(sample.steering_angles)
        wheels.append(sample.wheel_angles)
    return np.array(steering), np.array(wheels) - wheels[0]


def behind_the_emulator(_unpacked: Path, reference: Reference, run: Run) -> tuple[Array, Array]:
    network = load_emulated("prototype", DEFAULT_NETWORK).network
    with (
        emulation.bench("prototype", 1, False, DEFAULT_NETWORK, ()) as bench,
        steady_memory(),
        Master(bench.bus, bench.clock, network) as master,
    ):
        return follow(master, reference, run)


def behind_the_fmu(unpacked: Path, reference: Reference, run: Run) -> tuple[Array, Array]:
    with (
        FmuVehicle(unpacked / "resources" / "vehicle.fmu", load_prototype(), seed=1) as vehicle,
        LockstepBench(vehicle) as bench,
        Master(bench.bus, bench.clock, load_network()) as master,
    ):
        return follow(master, reference, run)


@pytest.mark.parametrize("bench", [behind_the_emulator, behind_the_fmu])
def test_the_lane_change_closes_as_on_the_bench(
    bench: Callable[[Path, Reference, Run], tuple[Array, Array]],
    driven: Any,
    unpacked: Path,
    reference: Reference,
    run: Run,
) -> None:
    """Six nodes on a CAN bus with noise and quantisation, against two FMUs that hand numbers to each other. The bench
    reports a cycle later.
    """
    steering, wheels = bench(unpacked, reference, run)
    count = len(reference) - 1
    turned = np.stack([driven[f"vehicle.{loop}_reported"][:count] for loop in STEERING_LOOPS], axis=1)
    rolled = np.stack([driven[f"vehicle.beta_{wheel}"][:count] for wheel in WHEELS], axis=1)
    apart = steering[1 : count + 1] - turned
    travel = run.plan.vehicle.geometry.wheel_radius * (wheels[1 : count + 1] - rolled).mean(axis=1)
    assert np.sqrt(np.mean(apart**2)) < 4e-4
    assert np.sqrt(np.mean(travel**2)) < 1.5e-4


def test_it_follows_its_path(driven: Any) -> None:
    """To the left by 1.2 m over 5 m, and back to standstill."""
    assert np.abs(driven["controller.error_x"]).max() < 1e-3
    assert max(np.abs(driven[f"controller.error_{loop}"]).max() for loop in STEERING_LOOPS) < 5e-4
    for name, wanted in (("pose_x", "path_x"), ("pose_y", "path_y"), ("gamma", "path_gamma")):
        assert np.abs(driven[f"vehicle.{name}"] - driven[f"controller.{wanted}"]).max() < 5e-3
    assert driven["vehicle.pose_y"][-1] == pytest.approx(1.2, abs=2e-3)


@pytest.mark.parametrize("corner", ["corner_m_ch_low", "corner_d_cl_high"])
def test_at_a_corner_the_vehicle_is_another_one_and_is_still_controlled(
    system: Path, driven: Any, reference: Reference, corner: str
) -> None:
    """One percent of standard deviation."""
    found = simulate_ssp(str(system), stop_time=reference.duration, step_size=STEP, parameter_set=named(system, corner))
    assert np.abs(found["vehicle.torque_fl"] - driven["vehicle.torque_fl"]).max() > 1e-3
    assert found["vehicle.pose_y"][-1] == pytest.approx(1.2, abs=5e-3)


def test_without_effects_the_set_of_the_run_changes_nothing(system: Path, driven: Any) -> None:
    """It is what the FMU starts with, give or take the digits of its file."""
    found = simulate_ssp(str(system), stop_time=3.0, step_size=STEP, parameter_set=named(system, "run"))
    np.testing.assert_allclose(found["vehicle.pose_x"], driven["vehicle.pose_x"][: len(found)], rtol=0, atol=1e-9)


def test_libcosim_drives_the_same_lane_change_and_takes_the_sets(
    unpacked: Path, driven: Any, reference: Reference
) -> None:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    description = fmpy.read_model_description(str(unpacked / "resources" / "vehicle.fmu"))
    references = {row.name: row.valueReference for row in description.modelVariables}
    found = {}
    for structure in ("SystemStructure", "corner_m_ch_high"):
        execution = CosimExecution.from_ssp_file(str(unpacked / f"{structure}.ssd"), step_size=round(STEP * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        execution.step(len(driven))
        (vehicle,) = (one.index for one in execution.slave_infos() if one.name == b"vehicle")
        found[structure] = observer.last_real_values(vehicle, [references[name] for name in (*END, "m_ch")])
    expected = [driven[f"vehicle.{name}"][-1] for name in END]
    np.testing.assert_allclose(found["SystemStructure"][:4], expected, rtol=0, atol=1e-9)
    light, heavy = (values[4] for values in found.values())
    assert heavy / light == pytest.approx(1.0196, abs=1e-4)


def test_ecos_drives_the_same_lane_change(system: Path, driven: Any) -> None:
    """In a process of its own: its library writes to standard output and keeps threads."""
    script = f"""
from ecospy import EcosSimulation
with EcosSimulation(ssp_path={str(system)!r}, step_size={STEP}) as simulation:
    simulation.init(parameter_set="run")
    simulation.step({len(driven)})
    print("end:", *(repr(simulation.get_real("vehicle::" + name)) for name in {END!r}))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    if done.returncode != 0 and "tbb" in done.stderr and not os.environ.get("QUASIOMNI_CI"):
        pytest.skip("libtbb12, which ecos needs, is not installed")
    assert done.returncode == 0, done.stdout + done.stderr
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("end:"))
    expected = [driven[f"vehicle.{name}"][-1] for name in END]
    np.testing.assert_allclose([float(text) for text in line.split()[1:]], expected, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def extended(run: Run) -> Path:
    """As `diagnose --extended` writes one: more friction at slow steering."""
    stribeck = make_effect("stribeck", "steering_left", {"amplitude": 6.0, "velocity": 0.3}, {"amplitude": 0.4})
    path = run.folder.path.parent / "extended.toml"
    write_model(ExtendedModel(truth_of("prototype"), (stribeck,)), path, {"run": "monday"})
    return path


def test_what_was_diagnosed_is_there_to_switch_on_and_off(run: Run, extended: Path, tmp_path: Path) -> None:
    """The vehicle has it in the structure that is taken by default; in that of the run it has not, and the feed-forward
    that expects it turns the wheels too far.
    """
    path = tmp_path / "diagnosed.ssp"
    export_system(run.folder.path, path, (host_platform(),), extended)
    with zipfile.ZipFile(path) as archive:
        assert b"resources/diagnosed.ssv" in archive.read("SystemStructure.ssd")
        assert b"resources/run.ssv" in archive.read("run.ssd")
        assert "resources/effect_stribeck_steering_left_high.ssv" in archive.namelist()
        with zipfile.ZipFile(BytesIO(archive.read("resources/vehicle.fmu"))) as vehicle:
            assert vehicle.read("documentation/parameters.toml") == extended.read_bytes()
    ends = {}
    for name in ("diagnosed", "run", "effect_stribeck_steering_left_high"):
        found = simulate_ssp(str(path), stop_time=6.0, step_size=STEP, parameter_set=named(path, name))
        ends[name] = np.abs(found["controller.error_alpha_l"]).max()
    assert ends["diagnosed"] < 5e-4
    assert 1.5 * ends["diagnosed"] < ends["effect_stribeck_steering_left_high"] < 2e-3
    assert 5e-3 < ends["run"] < 1e-2


def test_a_run_that_cannot_be_a_system_is_refused_and_nothing_is_written(
    run: Run, extended: Path, tmp_path: Path
) -> None:
    host, out = (host_platform(),), tmp_path / "none.ssp"
    with pytest.raises(DataFileError, match="no run folder"):
        export_system(tmp_path, out, host)
    bare = tmp_path / "bare"
    bare.mkdir()
    for entry in run.folder.path.iterdir():
        if entry.name != "parameters.toml":
            (bare / entry.name).symlink_to(entry)
    with pytest.raises(DataFileError, match=r"no parameters\.toml"):
        export_system(bare, out, host)
    (bare / "parameters.toml").write_text(
        run.folder.parameters.read_text() + '\n[correlation]\nnames = ["m_ch"]\nmatrix = [[1.0]]\n'
    )
    with pytest.raises(DataFileError, match="does not name the parameters"):
        export_system(bare, out, host)
    with pytest.raises(UserError, match="read by this very command"):
        export_system(run.folder.path, extended, host, extended)
    assert not out.exists()
