"""What a video costs: while it is noted, and when it is drawn."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path

import pytest

from emulator.engine.camera import HEIGHT, WIDTH
from emulator.engine.choice import ENGINES, PAINTERS
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import load_network
from hil.video.developing import develop
from hil.video.film import Caption, FilmedVehicle, Video
from ident.extras import EngineName

CYCLES = 1000
SIMULATED = 0.002 * CYCLES
RATE = 25


def drive(vehicle: EmulatedVehicle | FilmedVehicle) -> float:
    """CPU time of a drive in closed loop [s]."""
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, load_network()) as master:
        master.boot()
        master.enable()
        begin = time.process_time()
        for _ in range(CYCLES):
            master.exchange((0.5,) * 4)
        return time.process_time() - begin


@pytest.mark.bench
@pytest.mark.parametrize("engine", list(EngineName))
def test_noting_costs_next_to_nothing_and_drawing_is_said(engine: EngineName, tmp_path: Path) -> None:
    prototype = load_prototype()
    times: dict[bool, list[float]] = {False: [], True: []}
    for _ in range(3):
        for with_film in times:
            with EmulatedVehicle(prototype, seed=1, make_engine=ENGINES[engine]) as vehicle:
                film = FilmedVehicle(vehicle, RATE, Caption("straight"))
                times[with_film].append(drive(film if with_film else vehicle))
                stills, built = film.stills[-RATE:], vehicle.built
    bare, noted = min(times[False]) / SIMULATED, min(times[True]) / SIMULATED
    with closing(PAINTERS[engine](built, width=WIDTH, height=HEIGHT)) as painter:
        begin = time.process_time()
        develop(stills, painter, prototype, Video(tmp_path / "a.mp4", RATE, Caption("")))
        drawn = (time.process_time() - begin) * RATE / len(stills)
    print(
        f"\n{engine}: {bare:.3f} s of CPU a simulated second, {noted:.3f} with a film, and {drawn:.1f} to draw it at "
        f"{RATE} pictures a second ({drawn / RATE * 1e3:.0f} ms each)"
    )
    assert noted < 1.2 * bare
