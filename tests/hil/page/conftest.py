from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
"""WebGL in software: no graphics card is needed."""


@pytest.fixture
def browser(tmp_path: Path, need: Callable[..., str]) -> Iterator[Any]:
    """The system's Chromium, without a window, with a profile of its own."""
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        context = driver.chromium.launch_persistent_context(
            tmp_path / "profile",
            executable_path=need("chromium"),
            headless=True,
            args=FLAGS,
            viewport={"width": 1300, "height": 700},
            timeout=120_000,
        )
        context.set_default_timeout(120_000)
        yield context
        context.close()
