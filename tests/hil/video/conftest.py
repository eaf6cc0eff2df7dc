from __future__ import annotations

import os

import pytest

from emulator.as_built import AsBuilt
from emulator.engine.choice import PAINTERS
from emulator.prototype import load_prototype
from ident.errors import UserError
from ident.extras import EngineName


@pytest.fixture(params=list(EngineName))
def engine_name(request: pytest.FixtureRequest) -> EngineName:
    """Every engine that can draw here; in CI all must."""
    pytest.importorskip(request.param, reason=f"{request.param} is not installed: pip install {request.param}")
    try:
        PAINTERS[request.param](AsBuilt.of(load_prototype()), width=32, height=18).close()
    except UserError as error:
        if os.environ.get("QUASIOMNI_CI"):
            raise
        pytest.skip(f"{error.what} {error.remedy}")
    return EngineName(request.param)
