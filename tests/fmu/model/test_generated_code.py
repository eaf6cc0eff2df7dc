"""The C code compiles anywhere, keeps nothing between calls, and says the same each time it is written."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

from fmu.model.generate import generate_core
from fmu.table import neutral_effects, variable_table
from fmu.variables import Inputs
from ident.vehicle.description import load_vehicle

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


@pytest.fixture(scope="module")
def speed_controlled(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype", neutral_effects(), Inputs.SPEED)


@pytest.mark.parametrize(("pattern", "standard"), [("*.c", "c99"), ("qo_equations.c", "c89")])
def test_it_compiles_without_a_warning(speed_controlled: Any, pattern: str, standard: str) -> None:
    sources = [str(path) for path in speed_controlled.folder.glob(pattern)]
    compiler = shutil.which("gcc") or "cc"
    subprocess.run([compiler, f"-std={standard}", *WARNINGS, "-fsyntax-only", *sources], check=True)


def test_it_needs_nothing_but_mathematics_and_memory(speed_controlled: Any) -> None:
    text = "".join(speed_controlled.generated.files.values())
    assert set(re.findall(r"#include <(.*?)>", text)) == {"math.h", "string.h"}


def test_it_has_no_variable_outside_of_an_instance(speed_controlled: Any) -> None:
    listing = ["nm", "--format=sysv", str(speed_controlled.library_path)]
    symbols = subprocess.run(listing, check=True, capture_output=True, text=True).stdout.splitlines()
    ours = [line for line in symbols if line.startswith("qo_")]
    assert any("|.rodata" in line or "|.data.rel.ro" in line for line in ours)
    assert [line for line in ours if re.search(r"\|\.(data|bss)\s*$", line)] == []


def test_it_is_written_the_same_each_time() -> None:
    vehicle, effects = load_vehicle(), neutral_effects()
    table = variable_table(vehicle, vehicle.prior, effects, Inputs.TORQUE)
    first, second = (generate_core(table, effects, Inputs.TORQUE) for _ in range(2))
    assert first == second
