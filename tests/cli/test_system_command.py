"""`quasiomni ssp` as a user types it, and mistyped."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd

from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.network import load_network
from ident.campaign.plan import assemble_plan
from ident.effects.extended import ExtendedModel
from ident.parameters_file import write_model
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.parameters import Parameters

Quasi = Callable[..., Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder as `identify` leaves it, its result the prior values."""
    vehicle, network = load_vehicle(), load_network()
    plan = assemble_plan(vehicle, {}, steps=(Step.LANE_CHANGE,), periods=4, cycle=network.cycle_period)
    folder = RunFolder(tmp_path_factory.mktemp("runs") / "monday")
    create_run(Run(folder, plan, network, 1, "test", "", None), find_data_file("ident.vehicle", "prototype"))
    model = ExtendedModel(Parameters(vehicle.prior.values, np.full(11, 1e-3)))
    write_model(model, folder.parameters, {"run": "monday"})
    return folder.path


def test_an_identified_run_becomes_a_system(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    system = tmp_path / "system.ssp"
    built = quasi("ssp", run, "-o", system, "--platforms", "host")
    assert built.code == 0, built
    assert "Written" in built.out
    assert [component.name for component in read_ssd(str(system)).system.elements] == ["vehicle", "controller"]
    with zipfile.ZipFile(system) as archive:
        assert archive.read("documentation/parameters.toml") == (run / "parameters.toml").read_bytes()
        assert "resources/corner_B_w_high.ssv" in archive.namelist()


def test_mistakes_are_told_before_anything_is_compiled(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    log = tmp_path / "frames.blf"
    log.write_bytes(b"LOGG")
    mistakes = {
        (log,): "no run folder",
        (run, "-o", tmp_path): "is a folder",
        (run, "-o", run / "parameters.toml"): "read by this very command",
        (run, "-o", tmp_path / "none.ssp", "--model", tmp_path / "nothing.toml"): "nothing.toml does not exist",
        (run, "-o", tmp_path / "none.ssp", "--platforms", "amiga"): "x86_64-linux",
    }
    for words, said in mistakes.items():
        refused = quasi("ssp", *words)
        assert refused.code == 2, words
        assert said in refused.error
        assert "compiling (" not in refused.out
    assert [path.name for path in tmp_path.iterdir()] == ["frames.blf"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('ci95 = ["low", "high"]', "ci95 of C_l is not 2 numbers"),
        ("ci95 = [1.0, 2.0, 3.0]", "ci95 of C_l is not 2 numbers"),
        ("ci95 = [nan, 2.0]", "ci95 of C_l is not 2 numbers"),
    ],
)
def test_an_interval_that_is_none_is_told_with_its_name(
    quasi: Quasi, run: Path, tmp_path: Path, text: str, said: str
) -> None:
    model = tmp_path / "model.toml"
    whole = (run / "parameters.toml").read_text()
    model.write_text(whole.replace("[parameters.C_l]\n", f"[parameters.C_l]\n{text}\n"))
    refused = quasi("ssp", run, "--model", model, "-o", tmp_path / "none.ssp")
    assert refused.code == 2
    assert said in refused.error


def test_arrays_of_a_version_that_has_none_are_refused(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    refused = quasi("fmu", run, "--arrays", "-o", tmp_path / "none.fmu")
    assert refused.code == 2
    assert "--fmi 3" in refused.error
    assert not (tmp_path / "none.fmu").exists()
