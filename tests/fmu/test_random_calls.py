"""No bad state: whatever is called in whatever order with whatever numbers, under the sanitizers of the compiler."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fmu.arrays import with_arrays
from fmu.compiling import HEADERS
from fmu.description import FmiVersion
from fmu.glue import wrapper_sources
from fmu.interface import with_indicators
from fmu.packaging import INDICATORS
from fmu.source import ModelSource, make_model
from fmu.variables import Inputs

DRIVER = Path(__file__).parent / "drivers" / "fuzz.c"
CHUNK = 10_000


Fuzz = Callable[[int, int, str], str]


@pytest.fixture(scope="module", params=list(Inputs))
def fuzz(
    request: pytest.FixtureRequest,
    source: ModelSource,
    need: Callable[[str], str],
    tmp_path_factory: pytest.TempPathFactory,
) -> Fuzz:
    """Runs sequences from a seed on; both versions of the interface in one program, compiled once a level."""
    compiler = need("gcc")
    folder = tmp_path_factory.mktemp("fuzz")
    model = make_model(source, request.param)
    for version in FmiVersion:
        table = with_arrays(with_indicators(model.table, INDICATORS))
        for name, text in wrapper_sources(table, version, "token").items():
            (folder / name).write_bytes(text)
    for name, text in model.files.items():
        (folder / name).write_text(text)
    units = sorted(path.name for path in folder.glob("*.c"))
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    warnings = ["-Wall", "-Wextra", "-Werror"]

    def run(first: int, count: int, level: str) -> str:
        program = folder / f"fuzz{level}"
        if not program.exists():
            flags = ["-g", level, "-std=gnu11", *sanitizers, *warnings, "-I", str(HEADERS), "-I", "."]
            subprocess.run([compiler, *flags, "-o", program, *units, str(DRIVER), "-lm"], cwd=folder, check=True)
        done = subprocess.run([program, str(first), str(count)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_a_sample_of_random_sequences_crashes_nothing_and_gives_no_number_that_is_not_finite(
    fuzz: Fuzz,
) -> None:
    assert "200 sequences" in fuzz(1, 200, "-O0")


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(5))
def test_fifty_thousand_random_sequences_of_each_kind(fuzz: Fuzz, chunk: int) -> None:
    assert f"{CHUNK} sequences" in fuzz(1_000_000 + CHUNK * chunk, CHUNK, "-O1")
