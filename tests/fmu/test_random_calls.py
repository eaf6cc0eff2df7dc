"""No bad state: whatever is called in whatever order with whatever numbers, under the sanitizers of the compiler."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from fmu.arrays import with_arrays
from fmu.description import FmiVersion
from fmu.glue import wrapper_sources
from fmu.interface import with_indicators
from fmu.packaging import INDICATORS
from fmu.source import ModelSource, make_model
from fmu.variables import Carried, Inputs
from ident.plant.contact import Contacts
from tests.sanitizing import Fuzz, sanitized

DRIVER = Path(__file__).parent / "drivers" / "fuzz.c"
CHUNK = 10_000

VARIANTS: Mapping[str, Mapping[str, Any]] = {
    "torque": {"inputs": Inputs.TORQUE},
    "speed": {"inputs": Inputs.SPEED},
    "limited and soft": {"inputs": Inputs.TORQUE, "limited": True, "contacts": Contacts.SOFT},
    "every effect": {"inputs": Inputs.TORQUE, "carried": Carried.ALL},
}
"""What an FMU can be ordered as; all have arrays in FMI 3.0, since each call of them is beside those of the scalars."""


@pytest.fixture(scope="module", params=VARIANTS)
def fuzz(
    request: pytest.FixtureRequest,
    source: ModelSource,
    need: Callable[[str], str],
    tmp_path_factory: pytest.TempPathFactory,
) -> Fuzz:
    """Runs sequences from a seed on; both versions of the interface in one program, compiled once a level."""
    model = make_model(source, **VARIANTS[request.param])
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
@pytest.mark.parametrize("chunk", range(10))
def test_a_hundred_thousand_random_sequences_of_each_variant(fuzz: Fuzz, chunk: int) -> None:
    assert f"{CHUNK} sequences" in fuzz(1_000_000 + CHUNK * chunk, CHUNK, "-O1")
