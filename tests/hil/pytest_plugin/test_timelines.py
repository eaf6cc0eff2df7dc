"""The picture of a test says what was the case, and every word in it can be read."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.faults import parse_fault
from hil.faults.injector import Injected
from hil.network import load_network
from hil.network.cia import DriveState, NmtState
from hil.pytest_plugin.timeline import timeline
from hil.pytest_plugin.world import Note, Sample, World

SVG = "{http://www.w3.org/2000/svg}"
NETWORK = load_network()
BOXES = """() => [...document.querySelectorAll('svg text')].map(text => {
    const box = text.getBoundingClientRect(), sheet = text.ownerSVGElement.getBoundingClientRect();
    return [text.textContent, box.left - sheet.left, box.top - sheet.top, box.right - sheet.left,
            box.bottom - sheet.top, sheet.width, sheet.height];
})"""
FAULTS = (
    "power@drive_fl:to=1s",
    "drop@0x180-0x1ff:rate=12.345%,count=100000,from=0.25s,to=123.456s",
    "friction@floor:value=0.1",
    "babble@0x001:rate=5000,length=8,to=1ms",
    "trip@drive_rr:code=0x2310",
)


@pytest.fixture(scope="module")
def browser(need: Callable[..., str]) -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=need("chromium"), args=["--no-sandbox"], timeout=120_000)
        yield chromium.new_page()
        chromium.close()


def overlapping(one: list[Any], other: list[Any]) -> bool:
    return bool(one[1] < other[3] and other[1] < one[3] and one[2] < other[4] and other[2] < one[4])


def assert_legible(browser: Any, svg: str) -> list[str]:
    """What a browser makes of it: all words inside of the picture, none over another; gives the words."""
    browser.set_content(f"<body style='margin:0'>{svg}</body>")
    boxes = browser.evaluate(BOXES)
    for box in boxes:
        assert min(box[1], box[2]) >= 0, box
        assert (box[3] <= box[5], box[4] <= box[6]) == (True, True), box
    for one, other in combinations(boxes, 2):
        assert not overlapping(one, other), (one, other)
    return [box[0] for box in boxes]


@st.composite
def worlds(draw: st.DrawFn) -> World:
    """What a test may leave behind, with more of everything than there is room for."""
    now = draw(st.floats(0.01, 1e4))
    instants = st.floats(0.0, now)
    samples = [
        Sample(
            time,
            draw(st.floats(0.0, 1e3)),
            tuple(draw(st.sampled_from([*DriveState, None])) for _ in range(4)),
            tuple(draw(st.sampled_from([*NmtState, None])) for _ in range(6)),
        )
        for time in sorted(draw(st.lists(instants, max_size=8)))
    ]
    frames = [
        can.Message(arbitration_id=can_id, data=data, timestamp=time, is_extended_id=False)
        for time in sorted(draw(st.lists(instants, max_size=60)))
        for can_id, data in [
            draw(st.sampled_from([(0x81, b"\x10\x23" + bytes(6)), (0x85, bytes(8)), (0x701, b"\x00")]))
        ]
    ]
    injected = [
        Injected(number, parse_fault(line), begin, draw(st.sampled_from([begin, begin + 0.1 * now, float("inf")])))
        for number, (line, begin) in enumerate(
            draw(st.lists(st.tuples(st.sampled_from(FAULTS), instants), max_size=50))
        )
    ]
    words = st.text(min_size=0, max_size=40) | st.text("Wm ", min_size=100, max_size=900)
    said = st.tuples(instants, st.sampled_from(["", "FAILED: "]), words)
    notes = [Note(time, start + text) for time, start, text in draw(st.lists(said, max_size=40))]
    return cast(
        World,
        SimpleNamespace(network=NETWORK, now=now, samples=samples, frames=frames, injected=injected, notes=notes),
    )


def test_every_word_is_inside_of_the_picture_and_over_no_other_one(browser: Any) -> None:
    @settings(max_examples=60, deadline=None, suppress_health_check=[*HealthCheck], database=None)
    @given(worlds(), st.text(max_size=30) | st.text("test_Wm::[", min_size=60, max_size=300))
    def legible(world: World, title: str) -> None:
        assert_legible(browser, timeline(world, title))

    legible()


def full_world(count: int) -> World:
    """Everything at once, at the last instant: where labels have no room behind them."""
    frames = [
        can.Message(arbitration_id=0x81, data=b"\x10\x23" + bytes(6), timestamp=2.0, is_extended_id=False)
        for _ in range(count)
    ]
    return cast(
        World,
        SimpleNamespace(
            network=NETWORK,
            now=2.0,
            samples=[Sample(0.0, 1.0, (DriveState.FAULT,) * 4, (NmtState.STOPPED,) * 6)],
            frames=frames,
            injected=[Injected(k, parse_fault(FAULTS[1]), 1.99, float("inf")) for k in range(count)],
            notes=[Note(2.0, f"FAILED: {k} " if k == 0 else f"the vehicle to be at rest {k}") for k in range(count)],
        ),
    )


def test_what_there_is_no_room_for_is_counted(browser: Any) -> None:
    words = assert_legible(browser, timeline(full_world(500), "full"))
    counted = [int(found[1]) for word in words if (found := re.fullmatch(r"and (\d+) more", word))]
    emergencies, faults, notes = (
        sum(pattern in word for word in words) for pattern in ("drive_fl 2310h", "drop@0x180", "2.000 s: ")
    )
    assert counted == [500 - emergencies, 500 - faults, 500 - notes]
    assert min(emergencies, faults, notes) >= 6
    assert any("FAILED: 0" in word for word in words), "what failed is shown before what passed"


def lanes(svg: str) -> dict[tuple[str, str], list[tuple[str, float]]]:
    """Role and kind -> what the bars of the lane say: name, and from when on [s]."""
    found: dict[tuple[str, str], list[tuple[str, float]]] = {}
    role = ""
    for group in ElementTree.fromstring(svg).iter(f"{SVG}g"):
        texts = [text.text or "" for text in group.iter(f"{SVG}text")]
        kind = next((text for text in texts if text.startswith(("NMT", "CiA 402"))), None)
        if kind is None:
            continue
        role = texts[0] if kind.startswith("NMT") else role
        said = [re.fullmatch(r"(.+), (\S+) s to (\S+) s", title.text or "") for title in group.iter(f"{SVG}title")]
        found[role, kind.split()[0]] = [(one[1], float(one[2])) for one in said if one]
    return found


def test_every_node_has_a_lane_of_its_state_whether_it_sends_heartbeats_or_not(browser: Any) -> None:
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle, LockstepBench(vehicle) as bench:
        world = World(bench, vehicle, NETWORK)

        def command(specifier: int, node_id: int) -> float:
            bench.bus.send(can.Message(arbitration_id=0, data=bytes((specifier, node_id)), is_extended_id=False))
            return world.now

        world.run(0.1)
        started = command(0x01, 0)
        world.run(0.2)
        stopped = command(0x02, 6)
        world.faults.add("power@drive_rr:to=0.3s")
        world.run(0.5)
        assert not any(frame.arbitration_id > 0x700 and frame.data[:1] == b"\x05" for frame in world.frames)
        drawn = timeline(world, "states")
    assert_legible(browser, drawn)
    states = lanes(drawn)
    assert set(states) == {(str(node.role), "NMT") for node in NETWORK.nodes} | {
        (str(node.role), "CiA") for node in NETWORK.nodes if node.is_drive
    }
    assert states["encoder_left", "NMT"] == near(("pre-operational", 0.0), ("operational", started))
    assert states["encoder_right", "NMT"] == near(
        ("pre-operational", 0.0), ("operational", started), ("stopped", stopped)
    )
    assert states["drive_rr", "NMT"] == near(
        ("pre-operational", 0.0), ("operational", started), ("off the bus", stopped), ("pre-operational", stopped + 0.3)
    )
    assert states["drive_fl", "CiA"] == near(("switch on disabled", 0.0))


def near(*bars: tuple[str, float]) -> list[tuple[str, Any]]:
    """Within the period of the samples."""
    return [(name, pytest.approx(begin, abs=0.011)) for name, begin in bars]


def test_the_picture_in_the_documents_is_one_of_these() -> None:
    drawn = (Path(__file__).parents[3] / "docs" / "images" / "timeline.svg").read_text()
    assert set(lanes(drawn)) >= {("encoder_left", "NMT"), ("encoder_right", "NMT"), ("drive_fl", "CiA")}
