"""The page in a real browser: what it shows is what happens, and what is asked on it happens."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any

import can

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.control import command
from hil.bench.lockstep import LockstepBench
from hil.bus.opening import open_bus
from hil.master import Master
from hil.network import load_network

PATIENCE = 120.0
"""Software rendering on a computer that does other things besides [s]."""


@contextmanager
def running(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command with a page, and the address that it tells."""
    command = [sys.executable, "-m", "quasiomni", *words, "--web", "--web-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            said = ""
            while (found := re.search(r"The page is (\S+)", said)) is None:
                line = process.stdout.readline()
                assert line, said
                said += line
            yield process, found.group(1)
        finally:
            process.kill()


def until(holds: Callable[[], bool], page: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        page.wait_for_timeout(100)


def opened(browser: Any, address: str) -> tuple[Any, list[str]]:
    """The page at an address once the nodes are shown, and everything that it has asked for."""
    page, asked = browser.new_page(), []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.wait_for_selector("#qo-nodes", state="attached")
    return page, asked


def beside(page: Any, word: str) -> Any:
    """The field behind a word: viser does not tie the two for screen readers."""
    return page.get_by_text(word, exact=True).locator("xpath=following::input[1]")


def test_a_fault_injected_on_the_page_is_seen_there_and_the_emergency_stop_stops_the_vehicle(
    tmp_path: Path, browser: Any
) -> None:
    bus = f"unix:{tmp_path / 'bus'}"
    control = tmp_path / "bus.control"
    with running("emulate", "--bus", bus) as (_, address):
        page, asked = opened(browser, address)
        nodes, faults = page.locator("#qo-nodes"), page.locator("#qo-faults")
        with open_bus(bus):
            # Who listens, and has lost how much.
            until(lambda: "lost" in page.locator("#qo-bus").inner_text(), page)
        beside(page, "How").fill("")
        page.get_by_role("button", name="Inject").click()
        until(lambda: "power@drive_fl" in faults.inner_text(), page)
        until(lambda: "no supply" in nodes.inner_text(), page)
        assert "power@drive_fl" in command(control, "list")
        page.get_by_text("all", exact=True).click()
        until(lambda: "no supply" not in nodes.inner_text(), page)
        assert command(control, "list") == "no faults"

        page.get_by_role("button", name="EMERGENCY STOP").click()
        headline = page.locator("#qo-headline")
        until(lambda: "EMERGENCY STOP" in headline.inner_text(), page)
        until(lambda: nodes.inner_text().count("9000h") == 4, page)
        assert "estop@vehicle" in command(control, "list")
        page.get_by_role("button", name="Release the emergency stop").click()
        until(lambda: "EMERGENCY STOP" not in headline.inner_text(), page)
        assert command(control, "list") == "no faults"
        # Released is not restarted: the faults are for the master to reset.
        assert nodes.inner_text().count("9000h") == 4
        assert all(url.startswith((address, f"blob:{address}")) for url in asked)


def test_a_fault_that_cannot_be_is_refused_on_the_page(tmp_path: Path, browser: Any) -> None:
    with running("emulate", "--bus", f"unix:{tmp_path / 'bus'}") as (_, address):
        page, _ = opened(browser, address)
        beside(page, "How").fill("speed=3")
        page.get_by_role("button", name="Inject").click()
        page.get_by_text("power takes no 'speed'").wait_for()
        assert command(tmp_path / "bus.control", "list") == "no faults"


def test_a_campaign_shows_its_step_and_an_emergency_stop_ends_it(tmp_path: Path, browser: Any) -> None:
    words = ("campaign", "--out", str(tmp_path / "run"), "--skip", "wheel_lifted", "--skip", "lane_change")
    with running(*words) as (process, address):
        page, _ = opened(browser, address)
        page.get_by_text(re.compile(r"\d+ of \d+ cycles")).wait_for()
        page.get_by_role("button", name="EMERGENCY STOP").click()
        assert process.stdout is not None
        said = process.stdout.read()
        assert process.wait() == 2
        assert "9000" in said
        assert "Traceback" not in said


def test_a_replay_shows_its_log_and_its_vehicle_can_be_stopped(tmp_path: Path, browser: Any) -> None:
    """Two seconds of driving, played so slowly that any browser is there in time."""
    log = tmp_path / "drive.blf"
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle) as bench:
        frames: list[can.Message] = []
        master = Master(bench.bus, bench.clock, load_network(), lambda message: frames.append(deepcopy(message)))
        master.boot()
        master.enable()
        frames.clear()
        for _ in range(1000):
            master.exchange((0.9,) * 4)
    with can.BLFWriter(log) as writer:
        for frame in frames:
            writer.on_message_received(frame)
    with running("replay", str(log), "--emulations", "1", "--web-pace", "0.01") as (process, address):
        page, _ = opened(browser, address)
        page.get_by_text(re.compile(r"\d+ of \d+ frames")).first.wait_for()
        page.get_by_role("button", name="EMERGENCY STOP").click()
        until(lambda: page.locator("#qo-nodes").inner_text().count("9000h") == 4, page)
        assert process.poll() is None
