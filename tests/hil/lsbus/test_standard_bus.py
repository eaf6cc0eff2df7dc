"""The vehicle's devices on the standard's example of a bus simulation, against the emulator's firmware."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from hil.lsbus.operations import CanFrame
from tests.hil.lsbus.demo_bus import Coupling, Heard, build_demo_bus, coupled
from tests.hil.lsbus.stimuli import (
    CYCLE,
    ENABLE,
    FAULT_RESET,
    START,
    SYNC,
    command,
    heartbeat,
    nmt,
    read,
    to_operation_enabled,
    write,
)
from tests.hil.lsbus.twins import Data, Frame, Remote, Stimulus, Wait, emulated_twin

EXAMPLES = os.environ.get("QUASIOMNI_LS_BUS_EXAMPLES", "")

pytestmark = pytest.mark.skipif(
    not EXAMPLES, reason="QUASIOMNI_LS_BUS_EXAMPLES does not name modelica/fmi-ls-bus-examples"
)

DRIVES = (1, 2, 3, 4)
PAUSE = Wait(0.002)
"""The queue of the demo bus takes 127 frames of a node."""

SHORTEST_FRAME = 44e-6
"""As the demo bus counts the bits of a frame without data, at 1 Mbit/s [s]."""


@pytest.fixture(scope="module")
def demo_bus(need: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_demo_bus(Path(EXAMPLES), tmp_path_factory.mktemp("demo") / "bus", need("gcc"))


@pytest.fixture
def coupling(demo_bus: Path, bus_fmu: Path) -> Iterator[Coupling]:
    with coupled(demo_bus, bus_fmu) as found:
        yield found


def spaced(stimuli: Sequence[Stimulus]) -> list[Stimulus]:
    """With a pause after each."""
    return [one for stimulus in stimuli for one in (stimulus, PAUSE)]


def cycles(torques: tuple[int, int, int, int], count: int) -> list[Stimulus]:
    commands = [command(node, ENABLE, torque) for node, torque in zip(DRIVES, torques, strict=True)]
    return [stimulus for _ in range(count) for stimulus in (*commands, SYNC, Wait(CYCLE))]


DRIVING = [
    *spaced(to_operation_enabled(DRIVES)),
    *cycles((300, 300, -300, -300), 150),
    *cycles((400, -300, 200, -100), 150),
]
DIALOGUE = spaced(
    [
        *(write(node, 0x1017, 0, 20, 2) for node in range(1, 7)),
        *(read(node, index, sub) for node in (1, 6) for index, sub in ((0x1000, 0), (0x1018, 1), (0x1234, 0))),
        read(1, 0x1008),
        *(Data(0x601, bytes((0x60 | toggle,)) + bytes(7)) for toggle in (0x00, 0x10, 0x00)),
        Remote(0x181),
        nmt(START),
        Remote(0x181),
        Wait(0.1),
    ]
)
DEATH = [
    *spaced([*(write(node, 0x1016, 1, 0x7F << 16 | 50, 4) for node in DRIVES), *to_operation_enabled(DRIVES)]),
    heartbeat(),
    *cycles((500, 500, -500, -500), 20),
    Wait(0.6),
    *spaced([nmt(START), heartbeat(), *(command(node, FAULT_RESET) for node in DRIVES), SYNC, SYNC]),
]


def emulated(platform: Path, given: Sequence[Heard], until: float) -> list[Frame]:
    """What the emulator's firmware sends, given the same frames at the same instants."""
    with emulated_twin(platform) as twin:
        sent = twin.take(Wait(0.0))
        for instant, frame in given:
            sent += twin.take(Wait(instant - twin.time))
            sent += twin.take(Remote(frame.can_id) if frame.remote else Data(frame.can_id, frame.data))
        return sent + twin.take(Wait(until - twin.time))


@pytest.mark.parametrize("stimuli", [DRIVING, DIALOGUE, DEATH], ids=["driving", "dialogue", "death of the master"])
def test_on_the_standards_bus_the_devices_send_what_the_emulators_firmware_sends(
    coupling: Coupling, platform: Path, stimuli: list[Stimulus]
) -> None:
    """Frame by frame with instants and bytes; the bus decides when each of the master's frames arrives."""
    traffic = coupling.play(stimuli)
    sent = [(round(instant, 9), frame.can_id, frame.data) for instant, frame in traffic.sent]
    assert len(sent) > 60
    assert sent == emulated(platform, traffic.given, coupling.time)


def test_the_bus_carries_every_frame_once_one_after_the_other(coupling: Coupling) -> None:
    traffic = coupling.play([*DIALOGUE, Wait(0.05)])
    asked = [
        CanFrame(each.can_id, each.data) if isinstance(each, Data) else CanFrame(each.can_id, remote=True)
        for each in DIALOGUE
        if not isinstance(each, Wait)
    ]
    assert [frame for _, frame in traffic.given] == asked
    assert sorted(map(repr, (frame for _, frame in traffic.heard))) == sorted(
        map(repr, (frame for _, frame in traffic.sent))
    )
    instants = [instant for instant, _ in traffic.heard]
    assert min(later - earlier for earlier, later in pairwise(instants)) >= SHORTEST_FRAME
