"""What this computer has, as it is: things are taken away, and named."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from hil.bench import doctor
from hil.bench.doctor import Check, CheckName, examine
from ident.extras import ENGINE_EXTRAS, MODULES, EngineName, Extra, default_engine


def one(name: CheckName) -> Check:
    (check,) = examine([name])
    return check


def test_what_these_tests_run_on_is_found() -> None:
    engine = CheckName(ENGINE_EXTRAS[default_engine()])
    for check in examine([CheckName.PYTHON, CheckName.PACKAGES, engine]):
        assert check.found, check
    assert f"{sys.version_info.major}.{sys.version_info.minor}" in one(CheckName.PYTHON).detail
    assert "numpy" in one(CheckName.PACKAGES).detail


@pytest.mark.parametrize("extra", list(Extra))
def test_an_extra_that_is_not_there_is_named_with_what_needs_it(extra: Extra, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, MODULES[extra][0], None)
    check = one(CheckName(extra))
    assert not check.found
    assert MODULES[extra][0] in check.detail
    assert f"quasiomni[{extra}]" in check.remedy
    assert check.purpose


def test_a_package_that_is_too_old_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "requires", lambda _: ["numpy>=99", "scipy"])
    check = one(CheckName.PACKAGES)
    assert not check.found
    assert "is not >=99" in check.detail
    assert "scipy" not in check.detail


def test_requirements_of_extras_are_kept_apart() -> None:
    core = {requirement.name for requirement in doctor._requirements(None)}
    emulator = {requirement.name for requirement in doctor._requirements(Extra.EMULATOR)}
    assert {"numpy", "python-can"} <= core
    mujoco = {requirement.name for requirement in doctor._requirements(Extra.MUJOCO)}
    assert emulator == {"pybullet", "durand"}
    assert mujoco == {"mujoco", "durand"}
    assert all(isinstance(requirement, Requirement) for requirement in doctor._requirements(Extra.RECORDS))


@pytest.mark.parametrize("engine", list(EngineName))
def test_an_engine_that_does_not_start_is_missing(
    engine: EngineName, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip(engine, reason=f"{engine} is not installed: pip install {engine}")
    (tmp_path / f"{engine}.py").write_text("raise ImportError('libGL.so.1: cannot open shared object file')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    check = one(CheckName(ENGINE_EXTRAS[engine]))
    assert not check.found
    assert "libGL.so.1" in check.detail


def test_programs_are_looked_for_where_a_shell_would(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    assert not one(CheckName.CAN_UTILS).found
    assert not one(CheckName.COMPILER).found
    for name in ("candump", "cc"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    assert one(CheckName.CAN_UTILS).detail == str(tmp_path / "candump")
    assert one(CheckName.COMPILER).detail == "cc, for this computer alone"
