"""FMUs open and run in importers that were written independently of each other and of us."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fmpy
import fmpy.validation
import numpy as np
import pytest

from fmu.description import FmiVersion
from fmu.variables import Inputs
from ident.vehicle.geometry import WHEELS

Build = Callable[[FmiVersion, Inputs], Path]

STEP = 2e-3
STOP = 1.0
WATCHED = ("pose_x", "pose_y", "gamma", "x_dot", "alpha_l", "alpha_r", *(f"beta_{wheel}" for wheel in WHEELS))


def drive(path: Path, kind: str = "CoSimulation", **settings: Any) -> Any:
    """Half a second of unequal, constant commands, then release; the answer of FMPy."""
    description = fmpy.read_model_description(str(path))
    commands = [row.name for row in description.modelVariables if row.causality == "input"]
    time = np.array([0.0, 0.5, 0.5, STOP])
    signals = np.zeros(len(time), dtype=[("time", float), *((name, float) for name in commands)])
    signals["time"] = time
    for size, name in enumerate(commands[:4], start=1):
        signals[name][:2] = 0.25 * size
    arguments = {"stop_time": STOP, "output_interval": 0.02, "output": [*WATCHED, "mode"], "relative_tolerance": 1e-7}
    if kind == "CoSimulation":
        arguments |= {"output_interval": STEP}
    return fmpy.simulate_fmu(str(path), fmi_type=kind, input=signals, **arguments, **settings)


def test_the_description_is_valid(variant: Path) -> None:
    assert fmpy.validation.validate_fmu(str(variant)) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_fmpy_simulates_every_variant_and_the_vehicle_moves(variant: Path, kind: str) -> None:
    result = drive(variant, kind)
    assert result["time"][-1] == pytest.approx(STOP)
    assert np.hypot(result["pose_x"][-1], result["pose_y"][-1]) > 0.01
    assert all(np.all(np.isfinite(result[name])) for name in WATCHED)
    assert set(np.unique(result["mode"])) <= {1, 2, 3, 4}


def test_co_simulation_and_model_exchange_agree(torque_fmu: Path) -> None:
    """Both integrate the same equations; the inputs are steps, which co-simulation sees at its next step."""
    own, solver = drive(torque_fmu), drive(torque_fmu, "ModelExchange")
    for name in WATCHED:
        there = np.interp(solver["time"], own["time"], own[name])
        assert there[-1] == pytest.approx(solver[name][-1], rel=0.02, abs=1e-3), name


def test_both_versions_are_the_same_model(build: Build) -> None:
    old, new = (drive(build(version, Inputs.TORQUE)) for version in FmiVersion)
    for name in WATCHED:
        np.testing.assert_array_equal(old[name], new[name])


def test_a_second_run_in_the_same_process_gives_the_same_bits(torque_fmu: Path) -> None:
    first, second = drive(torque_fmu), drive(torque_fmu)
    assert first.tobytes() == second.tobytes()


def test_ten_instances_at_once_know_nothing_of_each_other(torque_fmu: Path) -> None:
    """One library, ten instances stepped in turn, each with its own torque; each does what it does alone."""

    def lone(torque: float) -> list[float]:
        (instance,) = instances(torque_fmu, 1)
        return run_together([instance], [torque])[0]

    torques = [0.1 * count for count in range(10)]
    assert run_together(instances(torque_fmu, 10), torques) == [lone(torque) for torque in torques]


def instances(path: Path, count: int) -> list[Any]:
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    made = [fmpy.simulation.instantiate_fmu(folder, description, "CoSimulation") for _ in range(count)]
    for instance in made:
        if description.fmiVersion == "2.0":
            instance.setupExperiment()
        instance.enterInitializationMode()
        instance.exitInitializationMode()
        instance.references = {row.name: row.valueReference for row in description.modelVariables}
    return made


def write(instance: Any, name: str, value: float) -> None:
    setter = getattr(instance, "setFloat64", None) or instance.setReal
    setter([instance.references[name]], [value])


def read(instance: Any, *names: str) -> list[float]:
    getter = getattr(instance, "getFloat64", None) or instance.getReal
    return list(getter([instance.references[name] for name in names]))


def run_together(made: list[Any], torques: list[float]) -> list[list[float]]:
    for cycle in range(100):
        for instance, torque in zip(made, torques, strict=True):
            write(instance, "torque_fl", torque)
            instance.doStep(cycle * STEP, STEP)
    results = [read(instance, *WATCHED) for instance in made]
    for instance in made:
        instance.terminate()
        instance.freeInstance()
    return results


def test_instances_in_threads_do_what_they_do_one_after_the_other(torque_fmu: Path) -> None:
    """ctypes lets go of the interpreter's lock, so the steps really overlap."""
    torques = [0.2 * count for count in range(8)]
    expected = run_together(instances(torque_fmu, 8), torques)
    made = instances(torque_fmu, 8)
    with ThreadPoolExecutor(max_workers=8) as pool:
        found = list(pool.map(lambda pair: run_together([pair[0]], [pair[1]])[0], zip(made, torques, strict=True)))
    assert found == expected


@pytest.mark.parametrize("serialized", [False, True])
def test_a_state_saved_and_restored_in_mid_run_continues_bit_by_bit(torque_fmu: Path, serialized: bool) -> None:
    instance, other = instances(torque_fmu, 2)
    is_new = hasattr(instance, "getFloat64")
    save = instance.getFMUState if is_new else instance.getFMUstate

    def go(which: Any, first: int) -> list[float]:
        for cycle in range(first, first + 50):
            write(which, "torque_rr", 1.5 if cycle % 20 < 10 else -0.5)
            which.doStep(cycle * STEP, STEP)
        return read(which, *WATCHED)

    go(instance, 0)
    state = save()
    if serialized:
        content = (instance.serializeFMUState if is_new else instance.serializeFMUstate)(state)
        state = (other.deserializeFMUState if is_new else other.deSerializeFMUstate)(content)
    expected = go(instance, 50)
    target = other if serialized else instance
    (target.setFMUState if is_new else target.setFMUstate)(state)
    assert go(target, 50) == expected


def needs_tbb(error: OSError) -> None:
    if "tbb" in str(error) and not os.environ.get("QUASIOMNI_CI"):
        pytest.skip("libtbb12, which ecos needs, is not installed")
    raise error


def test_ecos_simulates_it_as_fmpy_does(torque_fmu: Path) -> None:
    """In a process of its own, twice: the library of ecos writes to standard output and keeps threads."""
    script = f"""
from ecospy import EcosSimulation, EcosSimulationStructure
for _ in range(2):
    with EcosSimulationStructure() as structure:
        structure.add_model("vehicle", {str(torque_fmu)!r})
        with EcosSimulation(structure=structure, step_size={STEP}) as simulation:
            simulation.init()
            for wheel in {WHEELS!r}:
                simulation.set_real("vehicle::torque_" + wheel, 0.5)
            simulation.step(250)
            print("x:", repr(simulation.get_real("vehicle::pose_x")))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    if done.returncode != 0 and "tbb" in done.stderr:
        needs_tbb(OSError(done.stderr))
    found = [float(line.removeprefix("x:")) for line in done.stdout.splitlines() if line.startswith("x:")]
    assert len(found) == 2, done.stdout + done.stderr
    (instance,) = instances(torque_fmu, 1)
    for wheel in WHEELS:
        write(instance, f"torque_{wheel}", 0.5)
    for cycle in range(250):
        instance.doStep(cycle * STEP, STEP)
    (expected,) = read(instance, "pose_x")
    assert expected > 0.01
    assert found == pytest.approx([expected, expected], rel=1e-9)


def test_libcosim_simulates_it_as_fmpy_does(build: Build) -> None:
    """libcosim reads FMI 2.0 and counts time in whole nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    path = build(FmiVersion.FMI2, Inputs.TORQUE)
    (instance,) = instances(path, 1)
    torques = [instance.references[f"torque_{wheel}"] for wheel in WHEELS]
    found = []
    for _ in range(2):
        execution = CosimExecution.from_step_size(round(STEP * 1e9))
        slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(path), instance_name="vehicle"))
        observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
        execution.add_observer(observer)
        execution.add_manipulator(manipulator)
        manipulator.slave_real_values(slave, torques, [0.5] * 4)
        execution.step(250)
        found += observer.last_real_values(slave, [instance.references["pose_x"]])
    for wheel in WHEELS:
        write(instance, f"torque_{wheel}", 0.5)
    for cycle in range(250):
        instance.doStep(cycle * STEP, STEP)
    assert found[0] == found[1]
    assert found[0] == pytest.approx(read(instance, "pose_x")[0], rel=1e-9)


def test_fmutool_finds_nothing_to_complain_about(variant: Path) -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("fmutool"), "-input", variant, "-check"],
        capture_output=True,
        text=True,
        check=False,
    )
    text = done.stdout + done.stderr
    assert done.returncode == 0, text
    assert not [line for line in text.splitlines() if line.startswith(("ERROR", "WARNING"))], text


@pytest.mark.slow
def test_fmutool_builds_the_sources_into_the_same_model(torque_fmu: Path, tmp_path: Path) -> None:
    """Binaries taken out, sources compiled by somebody else with the system's compiler."""
    bare, built = tmp_path / "bare.fmu", tmp_path / "built.fmu"
    with zipfile.ZipFile(torque_fmu) as old, zipfile.ZipFile(bare, "w") as new:
        for name in old.namelist():
            if not name.startswith("binaries/"):
                new.writestr(name, old.read(name))
    command = [Path(sys.executable).with_name("fmutool"), "-input", bare, "-compile-sources", "-output", built]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    theirs, ours = drive(built), drive(torque_fmu)
    for name in WATCHED:
        np.testing.assert_allclose(theirs[name], ours[name], rtol=1e-9, atol=1e-12, err_msg=name)
