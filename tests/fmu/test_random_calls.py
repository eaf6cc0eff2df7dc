"""No bad state: whatever is called in whatever order with whatever numbers, under the sanitizers of the compiler."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fmu.arrays import with_arrays
from fmu.description import FmiVersion
from fmu.glue import wrapper_sources
from fmu.interface import with_indicators
from fmu.packaging import INDICATORS
from fmu.source import ModelSource, make_model
from fmu.variables import Inputs
from tests.sanitizing import Fuzz, sanitized

DRIVER = Path(__file__).parent / "drivers" / "fuzz.c"
CHUNK = 10_000


@pytest.fixture(scope="module", params=list(Inputs))
def fuzz(
    request: pytest.FixtureRequest,
    source: ModelSource,
    need: Callable[[str], str],
    tmp_path_factory: pytest.TempPathFactory,
) -> Fuzz:
    """Runs sequences from a seed on; both versions of the interface in one program, compiled once a level."""
    model = make_model(source, request.param)
    table = with_arrays(with_indicators(model.table, INDICATORS))
    sources = {name: text.encode() for name, text in model.files.items()}
    for version in FmiVersion:
        sources |= wrapper_sources(table, version, "token")
    return sanitized(need("gcc"), sources, DRIVER, tmp_path_factory.mktemp("fuzz"))


def test_a_sample_of_random_sequences_crashes_nothing_and_gives_no_number_that_is_not_finite(
    fuzz: Fuzz,
) -> None:
    assert "200 sequences" in fuzz(1, 200, "-O0")


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(5))
def test_fifty_thousand_random_sequences_of_each_kind(fuzz: Fuzz, chunk: int) -> None:
    assert f"{CHUNK} sequences" in fuzz(1_000_000 + CHUNK * chunk, CHUNK, "-O1")
