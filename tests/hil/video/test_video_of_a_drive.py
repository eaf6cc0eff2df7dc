"""A drive with a video: the same drive, and a video of it that can be read back."""

from __future__ import annotations

import hashlib
import itertools
from contextlib import nullcontext
from pathlib import Path

import av
import can
import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.engine.choice import ENGINES
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.emulation import vehicle as emulated_vehicle
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import DEFAULT_NETWORK, load_network
from hil.video.developing import filmed
from hil.video.film import Caption, FilmedVehicle, Video
from ident.errors import CampaignError, UserError
from ident.extras import EngineName

RATE = 10
CYCLES = 300


def drive(engine: EngineName, video: Video | None) -> str:
    """Drive on and steer, and give a digest of all frames."""
    digest = hashlib.sha256()

    def tap(message: can.Message) -> None:
        digest.update(repr((message.timestamp, message.arbitration_id, bytes(message.data))).encode())

    prototype = load_prototype()
    with (
        EmulatedVehicle(prototype, seed=3, make_engine=ENGINES[engine]) as vehicle,
        nullcontext(vehicle) if video is None else filmed(vehicle, engine, video) as seen,
        LockstepBench(seen) as bench,
        Master(bench.bus, bench.clock, load_network(), tap) as master,
    ):
        master.boot()
        master.enable()
        for cycle in range(CYCLES):
            if video is not None:
                video.caption.text = "straight" if cycle < CYCLES / 2 else "aligning for rotation, attempt 1 of 12"
            master.exchange((1.5, 1.5, 1.5, 1.5) if cycle < CYCLES / 2 else (0.5, 2.5, 1.5, 1.5))
        seen.wet(0, 0.3)
        seen.dry(0)
        seen.lift()
        master.exchange((0.0,) * 4)
        seen.lower()
        seen.load(20.0)
        master.exchange((0.1,) * 4)
    return digest.hexdigest()


def read(path: Path) -> list[NDArray[np.uint8]]:
    with av.open(str(path)) as file:
        return [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]


def test_the_drive_is_the_same_bit_by_bit_and_the_video_shows_it(engine_name: EngineName, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    video = Video(tmp_path / "new" / "drive.mp4", RATE, Caption("at rest"), lambda *done: told.append(done))
    assert drive(engine_name, video) == drive(engine_name, None)

    pictures = read(video.path)
    assert pictures[0].shape == (720, 1280, 3)
    assert told[-1] == (len(pictures), len(pictures))
    # Boot takes simulated time, too.
    assert len(pictures) > CYCLES * 0.002 * RATE
    assert list(tmp_path.glob("new/*")) == [video.path]

    first, last = pictures[0].astype(int), pictures[-2].astype(int)
    yellow = [
        (p[..., 0] > 120) & (p[..., 1] > 0.75 * p[..., 0]) & (p[..., 2] < 0.45 * p[..., 0]) for p in (first, last)
    ]
    assert (yellow[0] ^ yellow[1]).sum() > 200

    band = slice(670, 715)
    texts = [p[band, :1000].astype(int) for p in pictures]
    changes = [int(np.abs(b - a).max() > 100) for a, b in itertools.pairwise(texts)]
    # At rest, straight, aligning; and nothing in between but what compression leaves.
    assert sum(changes) == 2
    clocks = [p[band, 1100:].astype(int) for p in pictures]
    assert all(np.abs(b - a).max() > 60 for a, b in itertools.pairwise(clocks))


def test_stills_are_as_many_as_the_time_that_passed_says_however_it_passed() -> None:
    with EmulatedVehicle(load_prototype(), seed=1) as vehicle:
        film = FilmedVehicle(vehicle, 25, caption := Caption("one"))
        for _ in range(60):
            film.advance(0.002)
        caption.text = "two"
        film.advance(0.1)
        film.advance(0.0004)
    # 0, 40, 80, 120 ms, and at 220 ms the two that were due at 160 and 200.
    assert [round(still.time, 6) for still in film.stills] == [0.0, 0.04, 0.08, 0.12, 0.22, 0.22]
    assert [still.caption for still in film.stills] == ["one"] * 4 + ["two"] * 2


@pytest.mark.parametrize(
    ("error", "is_shown"), [(CampaignError("It failed.", "Look."), True), (KeyboardInterrupt(), False)]
)
def test_a_drive_that_failed_is_shown_and_one_that_was_stopped_is_not(
    error: BaseException, is_shown: bool, tmp_path: Path
) -> None:
    video = Video(tmp_path / "drive.gif", 5, Caption("drive"))

    def fail() -> None:
        with (
            EmulatedVehicle(load_prototype(), seed=1, make_engine=ENGINES[EngineName.PYBULLET]) as vehicle,
            filmed(vehicle, EngineName.PYBULLET, video) as film,
        ):
            film.advance(0.4)
            raise error

    with pytest.raises(type(error)):
        fail()
    assert list(tmp_path.iterdir()) == ([video.path] if is_shown else [])


def test_what_cannot_be_filmed_is_refused(tmp_path: Path) -> None:
    video = Video(tmp_path / "a.mp4", 5, Caption(""))
    with (
        pytest.raises(UserError, match="no video"),
        emulated_vehicle("prototype", 1, False, DEFAULT_NETWORK, fmu=tmp_path / "x.fmu", video=video),
    ):
        pass
    with (
        pytest.raises(UserError, match="not both"),
        emulated_vehicle("prototype", 1, True, DEFAULT_NETWORK, engine=EngineName.MUJOCO, video=video),
    ):
        pass
