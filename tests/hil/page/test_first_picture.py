"""How long it takes from the command to the first picture: until it can be drawn, and drawn in software."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect
from zstandard import ZstdDecompressor

pytestmark = pytest.mark.bench

ALLOWED = 3.0
"""[s]"""
BUSY = 0.7
"""Load of the machine, in processes that want a core, from which on times say nothing about us."""
LAST_WHEEL = b"/vehicle/steering_rr/wheel"
"""The last part of the vehicle that the page is told."""
HEADER = 16
"""Bytes before what is compressed, in a message of viser."""


@pytest.fixture
def begun(tmp_path: Path) -> float:
    """When the command is given; all modules have been compiled before, as after any first start."""
    load = os.getloadavg()[0]
    if load > BUSY:
        pytest.skip(f"the machine is busy (load {load:.1f}): the time would be that of other programs")
    with served(tmp_path / "before"):
        pass
    return time.monotonic()


@contextmanager
def served(bus: Path) -> Iterator[str]:
    """An emulator with a page: where that is, as soon as it says so."""
    words = ("emulate", "--bus", f"unix:{bus}", "--web", "--web-port", "0")
    with subprocess.Popen([sys.executable, "-m", "quasiomni", *words], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            while (found := re.search(r"The page is http://(\S+)", line := process.stdout.readline())) is None:
                assert line
            yield found.group(1)
        finally:
            process.kill()


def read_sketch(address: str) -> None:
    """As a browser would, read until the vehicle is there as a whole."""
    from viser import __version__

    with connect(f"ws://{address}", subprotocols=[f"viser-v{__version__}"], max_size=None) as page:  # type: ignore[list-item]
        told = b""
        while LAST_WHEEL not in told:
            message = page.recv()
            assert isinstance(message, bytes)
            told = ZstdDecompressor().decompressobj().decompress(message[HEADER:])


def test_everything_that_is_to_be_drawn_is_there_within_the_time(
    tmp_path: Path, begun: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is left is the browser's: its program, and a graphics card."""
    with served(tmp_path / "bus") as address:
        up = time.monotonic() - begun
        read_sketch(address)
        known = time.monotonic() - begun
    with capsys.disabled():
        print(f"\nfrom the command: page served after {up:.2f} s, vehicle known to a client after {known:.2f} s")
    assert known < ALLOWED / 2


def test_a_browser_that_draws_in_software_shows_its_first_picture_within_the_time(
    tmp_path: Path, begun: float, browser: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """Up to the first frame that has been drawn; the browser is open already."""
    page = browser.new_page()
    begun = time.monotonic()
    with served(tmp_path / "bus") as address:
        page.goto(f"http://{address}")
        page.wait_for_selector("#qo-nodes", state="attached")
        told = time.monotonic() - begun
        page.wait_for_function("() => document.querySelector('canvas') !== null")
        page.evaluate("() => new Promise(requestAnimationFrame)")
        drawn = time.monotonic() - begun
    with capsys.disabled():
        print(f"\nfrom the command, drawn in software: tables after {told:.2f} s, picture after {drawn:.2f} s")
    assert drawn < ALLOWED
