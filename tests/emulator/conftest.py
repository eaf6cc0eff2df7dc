from __future__ import annotations

import pytest

from emulator.engine.choice import ENGINES
from emulator.engine.protocol import MakeEngine
from ident.extras import EngineName


@pytest.fixture(params=list(EngineName))
def engine_name(request: pytest.FixtureRequest) -> EngineName:
    """Every engine, where it is installed."""
    pytest.importorskip(request.param, reason=f"{request.param} is not installed: pip install {request.param}")
    return EngineName(request.param)


@pytest.fixture
def make_engine(engine_name: EngineName) -> MakeEngine:
    return ENGINES[engine_name]
