from __future__ import annotations

import os

import pytest

from emulator.as_built import AsBuilt
from emulator.engine.choice import ENGINES, PAINTERS
from emulator.engine.protocol import MakeEngine, MakePainter
from emulator.prototype import load_prototype
from ident.errors import UserError
from ident.extras import EngineName


@pytest.fixture(params=list(EngineName))
def engine_name(request: pytest.FixtureRequest) -> EngineName:
    """Every engine, where it is installed."""
    pytest.importorskip(request.param, reason=f"{request.param} is not installed: pip install {request.param}")
    return EngineName(request.param)


@pytest.fixture
def make_engine(engine_name: EngineName) -> MakeEngine:
    return ENGINES[engine_name]


@pytest.fixture
def make_painter(engine_name: EngineName) -> MakePainter:
    """What draws with each engine, where this computer can; in CI it must."""
    make = PAINTERS[engine_name]
    try:
        make(AsBuilt.of(load_prototype()), width=32, height=18).close()
    except UserError as error:
        if os.environ.get("QUASIOMNI_CI"):
            raise
        pytest.skip(f"{error.what} {error.remedy}")
    return make
