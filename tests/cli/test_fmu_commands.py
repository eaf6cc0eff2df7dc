"""`quasiomni fmu` and `quasiomni cosim` as a user types them."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy.validation
import numpy as np
import pytest

from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.network import load_network
from ident.campaign.excitation import FourierSeries
from ident.campaign.plan import make_plan
from ident.campaign.reference import excitation_reference
from ident.campaign.steps import EXCITATIONS
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel
from ident.effects.text import effects_text
from ident.parameters_file import write_model
from ident.records.files import write_record
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS

Quasi = Callable[..., Any]


def perfect(step: Step, load: float = 0.0) -> Segment:
    """A step of a vehicle that is the prior model with a load aboard [kg], driven by its feed-forward torques."""
    vehicle, spec = load_vehicle(), EXCITATIONS[step]
    loaded = replace(vehicle.prior, values=vehicle.prior.values + load * (np.array(PARAMETER_NAMES) == "m_ch"))
    series = FourierSeries(np.array([0.4, 0.0, -0.4]), np.array([0.0, 0.4, -0.8 / 3]), spec.period)
    reference = excitation_reference(spec, series, 4, vehicle, loaded, 0.002)
    wheels, steering = np.zeros((len(reference), 4)), np.zeros((len(reference), 2))
    for name, track in reference.tracks.items():
        wheels += track.wheels * (track.position - track.position[0])[:, None]
        if name.startswith("alpha"):
            steering[:, 0 if name == "alpha_l" else 1] = track.position
    time = np.arange(len(reference)) * 0.002
    return make_segment(Segment(step, 0.0, time, reference.feed_forward, wheels, steering, reference.period), "test")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder as `identify` leaves it, its result the prior values and two effects, one with states of its own."""
    vehicle, network = load_vehicle(), load_network()
    steps = (Step.STEERING_LEFT,)
    plan = make_plan(vehicle, np.random.default_rng(1), steps=steps, periods=4, cycle=network.cycle_period)
    folder = RunFolder(tmp_path_factory.mktemp("runs") / "monday")
    create_run(Run(folder, plan, network, 1, "test", "", None), find_data_file("ident.vehicle", "prototype"))
    lines = [
        f'[parameters.{name}]\nvalue = {vehicle.prior[name]!r}\nunit = "{unit}"\nstd = 0.01\nsource = "test"\n'
        for name, unit in PARAMETER_UNITS.items()
    ]
    effects = [
        make_effect("quadratic_drag", "chassis", {"coefficient": 0.0}),
        make_effect("backlash", "drive_fl", {"gap": 0.002}),
    ]
    folder.parameters.write_text("\n".join(lines) + effects_text(effects))
    return folder.path


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("records") / "record.csv"
    write_record(Record([perfect(step) for step in (Step.ROTATION,)]), path)
    return path


def test_an_identified_run_becomes_an_fmu_whose_motion_is_that_of_the_record(
    quasi: Quasi, run: Path, record: Path, tmp_path: Path
) -> None:
    fmu = tmp_path / "platform.fmu"
    built = quasi("fmu", run, "-o", fmu, "--fmi", "3", "--platforms", "host")
    assert built.code == 0, built
    assert "Written" in built.out
    assert fmpy.validation.validate_fmu(str(fmu)) == []
    with zipfile.ZipFile(fmu) as archive:
        assert b"monday" in archive.read("documentation/index.html")
        assert b"backlash.drive_fl.gap" in archive.read("modelDescription.xml")
        assert archive.read("documentation/parameters.toml") == (run / "parameters.toml").read_bytes()
    (difference,) = _differences(quasi("cosim", fmu, "--record", record, "--out", tmp_path / "gap.html"))
    assert difference < 5.0
    assert (tmp_path / "gap.html").stat().st_size > 1e5


def _differences(replayed: Any) -> list[float]:
    """Of every outcome in the table of a replay [%]."""
    assert replayed.code == 0, replayed
    return [float(line.split()[-2]) for line in replayed.out.replace("│", " ").splitlines() if " % " in line]


def test_a_known_load_of_a_record_is_aboard_the_fmu(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    fmu = tmp_path / "platform.fmu"
    assert quasi("fmu", run, "-o", fmu, "--platforms", "host").code == 0
    found = []
    for name, stated in (("loaded", 120.0), ("silent", 0.0)):
        segment = perfect(Step.STRAIGHT, load=120.0)
        segment = replace(segment, extra={"payload": np.full(len(segment), stated)})
        write_record(Record([segment], name), tmp_path / f"{name}.csv")
        found += _differences(quasi("cosim", fmu, "--record", tmp_path / f"{name}.csv"))
    assert found[0] < 5.0 < found[1]


def test_another_model_of_the_vehicle_becomes_an_fmu_and_that_of_the_run_stays(
    quasi: Quasi, run: Path, tmp_path: Path
) -> None:
    """As `diagnose --extended` writes one."""
    extended, fmu = tmp_path / "vehicle.toml", tmp_path / "platform.fmu"
    before = (run / "parameters.toml").read_bytes()
    effect = make_effect("stribeck", "steering_left", {"amplitude": 6.0, "velocity": 0.3})
    write_model(ExtendedModel(load_vehicle().prior, (effect,)), extended, {"run": "test"})
    built = quasi("fmu", run, "--model", extended, "-o", fmu, "--platforms", "host")
    assert built.code == 0, built
    with zipfile.ZipFile(fmu) as archive:
        assert b"stribeck.steering_left.amplitude" in archive.read("modelDescription.xml")
        assert b"backlash" not in archive.read("modelDescription.xml")
        assert archive.read("documentation/parameters.toml") == extended.read_bytes()
    assert (run / "parameters.toml").read_bytes() == before
    missing = quasi("fmu", run, "--model", tmp_path / "nothing.toml")
    assert missing.code == 2
    assert "nothing.toml does not exist" in missing.error


def test_an_effect_that_a_model_has_twice_is_refused(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    """Parameters of the FMU are named by effect and place."""
    model = tmp_path / "model.toml"
    sizes = {"amplitude": 2.0, "velocity": 0.3}, {"amplitude": 1.0, "velocity": 9.0}
    two = tuple(make_effect("stribeck", "steering_left", size) for size in sizes)
    write_model(ExtendedModel(load_vehicle().prior, two), model, {"run": "test"})
    refused = quasi("fmu", run, "--model", model, "-o", tmp_path / "none.fmu")
    assert refused.code == 2
    assert "stribeck@steering_left is there 2 times" in refused.error
    assert not (tmp_path / "none.fmu").exists()


def test_a_run_that_is_not_identified_is_refused(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    bare.mkdir()
    answer = quasi("fmu", bare)
    assert answer.code == 2
    assert "no run folder" in answer.error
    for entry in run.iterdir():
        if entry.name != "parameters.toml":
            (bare / entry.name).symlink_to(entry)
    answer = quasi("fmu", bare)
    assert answer.code == 2
    assert "quasiomni identify" in answer.error


def test_mistakes_are_told_with_a_remedy(quasi: Quasi, run: Path, record: Path, tmp_path: Path) -> None:
    unknown = quasi("fmu", run, "--platforms", "amiga")
    assert unknown.code == 2
    assert "x86_64-linux" in unknown.error
    (tmp_path / "broken.fmu").write_bytes(b"no archive")
    broken = quasi("cosim", tmp_path / "broken.fmu", "--record", record)
    assert broken.code == 2
    # Said before it is loaded: what cannot be loaded is reported afterwards.
    assert broken.error.index("broken.fmu is native code of whoever made it") < broken.error.index("remedy")
    nonsense = quasi("campaign", "--plant", "bullet", "--out", tmp_path / "run", "--skip", "lane_change")
    assert nonsense.code == 2
    assert "fmu:FILE" in nonsense.error


@pytest.mark.parametrize("drive", [None, "drive_rl"])
def test_a_run_becomes_an_fmu_with_its_devices_on_a_bus(
    quasi: Quasi, run: Path, tmp_path: Path, drive: str | None
) -> None:
    """Also that of a real vehicle: what no file says of its drives is assumed, and told inside."""
    fmu = tmp_path / "bus.fmu"
    alone = () if drive is None else ("--drive", drive)
    built = quasi("fmu", run, "--bus", *alone, "-o", fmu, "--platforms", "host")
    assert built.code == 0, built.err
    assert fmpy.validation.validate_fmu(str(fmu)) == []
    with zipfile.ZipFile(fmu) as archive:
        names = set(archive.namelist())
    assert {
        "terminalsAndIcons/terminalsAndIcons.xml",
        "documentation/parameters.toml",
        "resources/drive_rl.eds",
    } <= names
    assert ("resources/encoder_left.eds" in names) is (drive is None)


def test_options_that_do_not_go_with_a_bus_are_refused(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    version = quasi("fmu", run, "--bus", "--fmi", "2", "-o", tmp_path / "none.fmu")
    arrays = quasi("fmu", run, "--bus", "--arrays", "-o", tmp_path / "none.fmu")
    alone = quasi("fmu", run, "--drive", "drive_fl", "-o", tmp_path / "none.fmu")
    unknown = quasi("fmu", run, "--bus", "--drive", "drive_middle", "-o", tmp_path / "none.fmu", "--platforms", "host")
    served = quasi("emulate", "--plant", "fmu-bus:bus.fmu", "--bus", "unix:nowhere")
    told = ["--fmi", "--arrays is of FMUs without devices", "--bus", "drive_rr", "fmu:FILE"]
    for answer, said in zip((version, arrays, alone, unknown, served), told, strict=True):
        assert answer.code == 2
        assert said in answer.err
    assert not (tmp_path / "none.fmu").exists()
